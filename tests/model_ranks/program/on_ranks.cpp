// on_ranks search|uneven|remembered|failing: what the tests of ranks start under mpirun. The first rank prints the bits
// of what was found, and how many points it computed itself.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <string>
#include <thread>

#include <fmt/format.h>

#include "estimate/optimisers/cma.h"
#include "estimate/spread_costs.h"

using namespace selvedge::estimate;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using selvedge::model::Ranks;

namespace {

double rosenbrock(const VectorXd& x) {
  double sum = 0;
  for (Eigen::Index i = 0; i + 1 < x.size(); ++i)
    sum += 100 * std::pow(x(i + 1) - x(i) * x(i), 2) + std::pow(1 - x(i), 2);
  return sum;
}

struct Program {
  std::shared_ptr<Ranks> ranks = Ranks::join();
  std::string mode;
  int rank = std::getenv("OMPI_COMM_WORLD_RANK") ? std::atoi(std::getenv("OMPI_COMM_WORLD_RANK")) : 0;
  int computed = 0, batches = 0;

  std::vector<double> costs(const MatrixXd& points) {
    if (mode == "failing" && rank == 1 && ++batches == 3) throw std::runtime_error("this fabric has torn");
    if (mode == "uneven" && rank == 2) std::this_thread::sleep_for(std::chrono::seconds(1));
    computed += static_cast<int>(points.cols());
    std::vector<double> found;
    for (const auto& x : points.colwise()) found.push_back(rosenbrock(x));
    return found;
  }

  void search(const BatchCosts& spread_costs) const {
    SearchProblem problem;
    problem.lower = VectorXd::Constant(4, -2);
    problem.upper = VectorXd::Constant(4, 3);
    problem.start = VectorXd::Constant(4, 2);
    problem.costs = spread_costs;
    SearchLimits limits;
    limits.evaluations = 300;
    const SearchResult found = search_cma(problem, limits);
    if (rank > 0) return;
    for (const double x : found.point) fmt::print("{:a} ", x);
    fmt::print("cost {:a} evaluations {} batches {}\n", found.cost, found.evaluations, found.trace.size());
  }

  void one_batch(const BatchCosts& spread_costs) const {
    const std::vector<double> all = spread_costs(MatrixXd::Random(4, 4000));
    if (rank > 0) return;
    double sum = 0;
    for (size_t i = 0; i < all.size(); ++i) sum += static_cast<double>(i + 1) * all[i];
    fmt::print("{} costs, weighted {:a}\n", all.size(), sum);
  }

  void run() {
    const auto remembered = [&](BatchCosts shared) -> BatchCosts {
      if (mode != "remembered") return shared;
      return [](const MatrixXd& points) { return std::vector<double>(static_cast<size_t>(points.cols()), 7.0); };
    };
    const BatchCosts shared_out = spread_costs(
        ranks, [&](const MatrixXd& points) { return costs(points); }, remembered);
    if (mode == "search" || mode == "failing") search(shared_out);
    else one_batch(shared_out);
    if (rank == 0) fmt::print(stderr, "computed by the first: {}\n", computed);
    if (ranks) ranks->end();
  }
};

}  // namespace

int main(int, char** argv) {
  Program program;
  program.mode = argv[1];
  try {
    program.run();
    return 0;
  } catch (const std::exception& error) {
    if (program.rank == 0) fmt::print(stderr, "error: {}\n", error.what());
    else program.ranks->give_up(error.what());
  }
  return program.rank == 0 ? 3 : 4;
}
