// Optimisers on functions whose minimum is known, and a search broken off and continued against one that ran through.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>
#include <stdexcept>

#include <gtest/gtest.h>

#include "files/bad_input.h"
#include "files/whole_file.h"
#include "estimate/optimisers/registry.h"
#include "estimate/optimisers/annealing.h"
#include "estimate/optimisers/cma.h"
#include "estimate/optimisers/evolution.h"
#include "estimate/optimisers/grid.h"
#include "estimate/optimisers/journal.h"

namespace selvedge::estimate {
namespace {

namespace fs = std::filesystem;
using Eigen::MatrixXd;
using Eigen::VectorXd;

estimate::BatchCosts one_by_one(std::function<double(const VectorXd&)> cost) {
  return [cost](const MatrixXd& points) {
    std::vector<double> out;
    for (Eigen::Index i = 0; i < points.cols(); ++i) out.push_back(cost(points.col(i)));
    return out;
  };
}

estimate::SearchProblem box(Eigen::Index n, double low, double high, double start,
                            std::function<double(const VectorXd&)> cost) {
  return {VectorXd::Constant(n, low), VectorXd::Constant(n, high), VectorXd::Constant(n, start),
          one_by_one(std::move(cost))};
}

double rosenbrock(const VectorXd& x) {
  double sum = 0;
  for (Eigen::Index k = 0; k + 1 < x.size(); ++k)
    sum += 100 * std::pow(x(k + 1) - x(k) * x(k), 2) + std::pow(1 - x(k), 2);
  return sum;
}

// A bowl with ripples, 8 from crest to trough: many local minima, the global one at 0.3 in each coordinate.
double rippled(const VectorXd& x) {
  const Eigen::ArrayXd d = x.array() - 0.3;
  return (d * d).sum() + 4 * (1 - (2 * M_PI * d).cos()).mean();
}

estimate::SearchLimits limits(int evaluations, unsigned seed = 1) {
  estimate::SearchLimits l;
  l.evaluations = evaluations;
  l.seed = seed;
  return l;
}

TEST(Grid, EvaluatesEveryCombinationOnceWithBothEnds) {
  std::set<std::pair<double, double>> seen;
  const estimate::SearchProblem problem = box(2, -1, 2, 0, [&](const VectorXd& x) {
    EXPECT_TRUE(seen.emplace(x(0), x(1)).second);
    return std::abs(x(0) - 1) + std::abs(x(1) + 1);
  });
  const estimate::SearchResult found = search_grid(problem, limits(16));
  EXPECT_EQ(seen.size(), 16u);
  EXPECT_EQ(found.evaluations, 16);
  EXPECT_EQ(found.point(0), 1);  // −1, 0, 1, 2
  EXPECT_EQ(found.point(1), -1);
  EXPECT_EQ(found.cost, 0);
}

TEST(Grid, RefusesABudgetThatDoesNotHoldIt) {
  const estimate::SearchProblem problem = box(3, 0, 1, 0, rosenbrock);
  EXPECT_THROW(search_grid(problem, limits(63)), BadInput);
}

TEST(Annealing, FindsTheEndOfABentValley) {
  const estimate::SearchResult found = anneal(box(2, -2, 2, -1.2, rosenbrock), limits(1500));
  EXPECT_LT((found.point - VectorXd::Ones(2)).norm(), 0.06) << found.point.transpose();
  EXPECT_LT(found.cost, 1e-3);
  EXPECT_LE(found.evaluations, 1500);
}

TEST(Annealing, LeavesLocalMinimaThatDownhillAloneStaysIn) {
  int warm = 0, cold = 0;
  for (unsigned seed = 1; seed <= 10; ++seed) {
    estimate::AnnealingOptions melted, frozen;
    melted.edge = frozen.edge = 0.02;  // a fifth of a ripple
    melted.first_temperature = 6;
    frozen.first_temperature = 1e-12;
    warm += anneal(box(2, -5, 5, 3.3, rippled), limits(1500, seed), melted).cost < 0.1;
    cold += anneal(box(2, -5, 5, 3.3, rippled), limits(1500, seed), frozen).cost < 0.1;
  }
  EXPECT_GE(warm, 3);
  EXPECT_EQ(cold, 0);
}

TEST(Annealing, TemperatureFallsGeometricallyToItsEnd) {
  estimate::AnnealingOptions options;
  options.first_temperature = 2;
  const estimate::SearchResult found = anneal(box(4, -2, 2, 0, rosenbrock), limits(2000), options);
  double last = 2;
  for (const estimate::SearchStep& step : found.trace)
    if (std::isfinite(step.temperature)) {
      EXPECT_LE(step.temperature, last);
      if (step.temperature < last) { EXPECT_NEAR(step.temperature / last, options.cooling, 1e-12); }
      last = step.temperature;
    }
  EXPECT_NEAR(std::log(last / (2 * options.last_temperature)), 0, 0.7);
}

TEST(Evolution, KeepsTheBetterHalfAndConverges) {
  int evaluations = 0;
  const estimate::SearchProblem problem = box(3, -5, 5, 0, [&](const VectorXd& x) {
    ++evaluations;
    return (x.array() - 1).square().sum();
  });
  const estimate::SearchResult found = evolve(problem, limits(100 + 60 * 50));
  EXPECT_EQ(evaluations, 100 + 60 * 50);  // the kept half is not evaluated again
  EXPECT_LT((found.point.array() - 1).abs().maxCoeff(), 0.02) << found.point.transpose();
  for (size_t i = 1; i < found.trace.size(); ++i) EXPECT_LE(found.trace[i].best_cost, found.trace[i - 1].best_cost);
}

TEST(Evolution, FirstValuesLieInTheirRange) {
  estimate::EvolutionOptions options;
  options.first_lower = VectorXd::Constant(2, 1);
  options.first_upper = VectorXd::Constant(2, 2);
  evolve(box(
             2, -5, 5, 0,
             [](const VectorXd& x) {
    EXPECT_GE(x.minCoeff(), 1);
    EXPECT_LE(x.maxCoeff(), 2);
    return 1.0;
             }),
         limits(options.individuals), options);
}

TEST(Evolution, OursFollowsAValleyThatIsNotAlongAnAxis) {
  const auto valley = [](const VectorXd& x) { return 1e4 * std::pow(x(0) - x(1), 2) + std::pow(x(0) + x(1) - 1, 2); };
  double plain = 0, ours = 0;
  for (unsigned seed = 1; seed <= 5; ++seed) {
    estimate::EvolutionOptions options;
    plain += std::log(evolve(box(2, -5, 5, 0, valley), limits(4000, seed), options).cost);
    options.variant = estimate::EvolutionOptions::Variant::ours;
    ours += std::log(evolve(box(2, -5, 5, 0, valley), limits(4000, seed), options).cost);
  }
  EXPECT_LT(ours, plain - 5 * std::log(100.0));
}

TEST(Cma, FindsTheEndOfABentValleyInBatches) {
  size_t largest = 0;
  estimate::SearchProblem problem = box(6, -2, 2, -1.2, rosenbrock);
  const estimate::BatchCosts inner = problem.costs;
  problem.costs = [&](const MatrixXd& points) {
    largest = std::max(largest, static_cast<size_t>(points.cols()));
    return inner(points);
  };
  const estimate::SearchResult found = search_cma(problem, limits(6000));
  EXPECT_GE(largest, 8u);
  EXPECT_LT((found.point - VectorXd::Ones(6)).norm(), 1e-3) << found.point.transpose() << " " << found.cost;
}

TEST(Cma, ReachesABoundThatHoldsTheMinimumBack) {
  const estimate::SearchResult found =
      search_cma(box(3, 0, 1, 0.5, [](const VectorXd& x) { return (x.array() + 0.5).square().sum(); }), limits(2000));
  EXPECT_LT(found.point.maxCoeff(), 1e-3);
  EXPECT_GE(found.point.minCoeff(), 0);
}

TEST(Cma, PointsWithoutCostDoNotStopIt) {
  const auto holed = [](const VectorXd& x) { return x(0) > 0.8 ? std::nan("") : (x.array() - 0.6).square().sum(); };
  EXPECT_LT(search_cma(box(3, 0, 1, 0.7, holed), limits(1500)).cost, 1e-5);
}

class EveryOptimiser : public testing::TestWithParam<std::string> {
 protected:
  estimate::SearchProblem problem() const { return box(2, -2, 2, -1.2, rosenbrock); }
  estimate::SearchResult run(const estimate::SearchProblem& p, const estimate::SearchLimits& l) const {
    return estimate::optimiser_named(GetParam()).run(p, l);
  }
};

TEST_P(EveryOptimiser, StopsAtTheCostAskedFor) {
  estimate::SearchLimits l = limits(3000);
  l.stop_cost = 20;
  const estimate::SearchResult found = run(problem(), l);
  EXPECT_LE(found.cost, 20);
  EXPECT_EQ(found.ended, "cost reached");
  EXPECT_LT(found.evaluations, 3000);
}

TEST_P(EveryOptimiser, NeverAsksForMoreThanItsBudgetNorOutsideTheBox) {
  int evaluations = 0;
  const estimate::SearchProblem p = box(2, -2, 2, 1.9, [&](const VectorXd& x) {
    ++evaluations;
    EXPECT_GE(x.minCoeff(), -2);
    EXPECT_LE(x.maxCoeff(), 2);
    return rosenbrock(x);
  });
  const estimate::SearchResult found = run(p, limits(333));
  EXPECT_LE(evaluations, 333);
  EXPECT_EQ(found.evaluations, evaluations);
}

// Killed after any evaluation, the continued search gives the same bits and evaluates nothing twice.
TEST_P(EveryOptimiser, ContinuesBitForBitFromItsJournal) {
  const fs::path folder = fs::path(testing::TempDir()) / ("selvedge_journal_" + GetParam());
  const estimate::SearchResult through = run(problem(), limits(400));
  for (const int killed_after : {1, 7, 16, 150}) {
    fs::remove_all(folder);
    int evaluations = 0;
    estimate::SearchProblem p = problem();
    const auto with = [&](estimate::Journal& journal, int last) {
      p.costs = journal.recorded(one_by_one([&, last](const VectorXd& x) {
        if (++evaluations > last) throw std::runtime_error("killed");
        return rosenbrock(x);
      }));
      return run(p, limits(400));
    };
    {
      estimate::Journal journal(folder / "evaluations.txt", GetParam());
      if (killed_after < through.evaluations) { EXPECT_THROW(with(journal, killed_after), std::runtime_error); }
    }
    // The line being written when it was killed.
    std::ofstream(folder / "evaluations.txt", std::ios::app) << "0.125,-1.2";
    estimate::Journal journal(folder / "evaluations.txt", GetParam());
    evaluations = 0;
    const estimate::SearchResult continued = with(journal, 1000000);
    EXPECT_EQ(continued.cost, through.cost);
    EXPECT_EQ(continued.point, through.point);
    EXPECT_EQ(continued.evaluations, through.evaluations);
    ASSERT_EQ(continued.trace.size(), through.trace.size());
    for (size_t i = 0; i < through.trace.size(); ++i)
      EXPECT_EQ(continued.trace[i].best_cost, through.trace[i].best_cost);
    EXPECT_LE(evaluations + static_cast<int>(journal.found()), through.evaluations);
  }
  estimate::Journal whole(folder / "evaluations.txt", GetParam());
  int evaluations = 0;
  estimate::SearchProblem p = problem();
  p.costs = whole.recorded(one_by_one([&](const VectorXd& x) { return ++evaluations, rosenbrock(x); }));
  EXPECT_EQ(run(p, limits(400)).point, through.point);
  EXPECT_EQ(evaluations, 0);
  fs::remove_all(folder);
}

INSTANTIATE_TEST_SUITE_P(ByName, EveryOptimiser, testing::Values("grid", "annealing", "evolution", "cma"),
                         [](const auto& info) { return info.param; });

TEST(OptimiserNamed, RefusesAnUnknownOneAndNamesTheOthers) {
  try {
    estimate::optimiser_named("tabu");
    FAIL();
  } catch (const BadInput& e) { EXPECT_NE(std::string(e.what()).find("annealing"), std::string::npos); }
}

TEST(Journal, RefusesThatOfAnotherSearchAndForeignLines) {
  const fs::path path = fs::path(testing::TempDir()) / "selvedge_journal_foreign" / "evaluations.txt";
  fs::remove_all(path.parent_path());
  { estimate::Journal journal(path, "annealing seed 1"); }
  EXPECT_THROW(estimate::Journal(path, "annealing seed 2"), BadInput);
  EXPECT_NO_THROW(estimate::Journal(path, "annealing seed 1"));
  std::ofstream(path, std::ios::app) << "not a point\n";
  EXPECT_THROW(estimate::Journal(path, "annealing seed 1"), BadInput);
  fs::remove_all(path.parent_path());
}

TEST(Journal, KilledInItsFirstLineBeginsAgain) {
  const fs::path path = fs::path(testing::TempDir()) / "selvedge_journal_begun" / "evaluations.txt";
  for (const char* begun : {"", "selvedge-journal/1 anneal"}) {
    fs::create_directories(path.parent_path());
    std::ofstream(path) << begun;
    EXPECT_EQ(estimate::Journal(path, "annealing seed 1").found(), 0u);
    EXPECT_NO_THROW(estimate::Journal(path, "annealing seed 1"));
    fs::remove_all(path.parent_path());
  }
}

TEST(Journal, KeepsInfiniteCostsAndEveryBit) {
  const fs::path path = fs::path(testing::TempDir()) / "selvedge_journal_bits" / "evaluations.txt";
  fs::remove_all(path.parent_path());
  MatrixXd points(2, 3);
  points << 0.1, 1.0 / 3, -0.0, 1e-300, 5e17 + 64, 2;
  const std::vector<double> costs = {1.0 / 7, std::numeric_limits<double>::infinity(), 4e-320};
  {
    estimate::Journal journal(path, "bits");
    journal.recorded([&](const MatrixXd&) { return costs; })(points);
  }
  estimate::Journal journal(path, "bits");
  EXPECT_EQ(journal.found(), 3u);
  EXPECT_EQ(journal.recorded([](const MatrixXd&) -> std::vector<double> { throw std::logic_error("evaluated again"); })(
                points),
            costs);
  fs::remove_all(path.parent_path());
}

}  // namespace
}  // namespace selvedge::estimate
