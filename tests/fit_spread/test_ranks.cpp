// Ranks as threads of one process, on pairs of sockets.
#include <atomic>
#include <thread>

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include "estimate/optimisers/cma.h"
#include "fit/spread/ranks.h"

namespace selvedge::fit {
namespace {

const auto kAsTheyAre = [](estimate::BatchCosts costs) { return costs; };

estimate::SearchProblem valley(const estimate::BatchCosts& costs) {
  estimate::SearchProblem problem;
  problem.lower = Eigen::VectorXd::Constant(4, -2);
  problem.upper = Eigen::VectorXd::Constant(4, 3);
  problem.start = Eigen::VectorXd::Constant(4, 2);
  problem.costs = costs;
  return problem;
}

std::vector<double> rosenbrock(const Eigen::MatrixXd& points) {
  std::vector<double> costs;
  for (const auto& x : points.colwise()) {
    double sum = 0;
    for (Eigen::Index i = 0; i + 1 < x.size(); ++i)
      sum += 100 * std::pow(x(i + 1) - x(i) * x(i), 2) + std::pow(1 - x(i), 2);
    costs.push_back(sum);
  }
  return costs;
}

// A search on this many ranks. lost_after: the last rank falls silent after that many shares.
struct SpreadRun {
  estimate::SearchResult found;
  int left = 0;                   // ranks, at the end
  std::atomic<int> elsewhere{0};  // points that other ranks computed
};

void run_search(int count, int lost_after, SpreadRun& run) {
  std::vector<int> firsts;
  std::vector<std::thread> others;
  estimate::SearchLimits limits;
  limits.evaluations = 300;
  for (int k = 1; k < count; ++k) {
    int pair[2];
    ASSERT_EQ(::socketpair(AF_UNIX, SOCK_STREAM, 0, pair), 0);
    firsts.push_back(pair[0]);
    others.emplace_back([&run, limits, end = pair[1], lost_after, last = k + 1 == count] {
      const auto ranks = std::make_shared<Ranks>(false, std::vector<int>{end});
      int shares = 0;
      const estimate::BatchCosts costs = [&](const Eigen::MatrixXd& points) {
        if (last && shares++ == lost_after) ::shutdown(end, SHUT_RDWR);
        run.elsewhere += static_cast<int>(points.cols());
        return rosenbrock(points);
      };
      try {
        search_cma(valley(spread(ranks, costs, kAsTheyAre)), limits);
      } catch (const std::runtime_error&) { EXPECT_TRUE(last && lost_after >= 0); }
    });
  }
  {
    const auto ranks = std::make_shared<Ranks>(true, firsts);
    run.found = search_cma(valley(spread(ranks, rosenbrock, kAsTheyAre)), limits);
    run.left = ranks->alive();
  }
  for (std::thread& t : others) t.join();
}

TEST(Ranks, TheirNumberDoesNotChangeTheResult) {
  const estimate::SearchResult alone = search_cma(valley(rosenbrock), [] {
    estimate::SearchLimits limits;
    limits.evaluations = 300;
    return limits;
  }());
  for (const int count : {1, 2, 3, 5}) {
    SpreadRun run;
    run_search(count, -1, run);
    EXPECT_EQ(run.found.point, alone.point) << count;
    EXPECT_EQ(run.found.cost, alone.cost) << count;
    EXPECT_EQ(run.found.trace.size(), alone.trace.size()) << count;
    EXPECT_EQ(run.left, count);
    EXPECT_GE(run.elsewhere, count > 1 ? 300 / count : 0) << count;
  }
}

TEST(Ranks, ALostOneCostsItsShareOnly) {
  SpreadRun whole, lost;
  run_search(3, -1, whole);
  run_search(3, 2, lost);
  EXPECT_EQ(lost.left, 2);
  EXPECT_EQ(lost.found.point, whole.found.point);
  EXPECT_EQ(lost.found.evaluations, whole.found.evaluations);
}

TEST(Ranks, WhatIsRememberedIsNotAskedAgain) {
  int pair[2];
  ASSERT_EQ(::socketpair(AF_UNIX, SOCK_STREAM, 0, pair), 0);
  std::vector<double> other;
  std::thread worker([&] {
    other = spread(std::make_shared<Ranks>(false, std::vector<int>{pair[1]}), rosenbrock,
                   kAsTheyAre)(Eigen::MatrixXd::Zero(4, 2));
  });
  const auto known = [](estimate::BatchCosts) {
    return [](const Eigen::MatrixXd&) { return std::vector<double>{7, 8}; };
  };
  EXPECT_EQ(
      spread(std::make_shared<Ranks>(true, std::vector<int>{pair[0]}), rosenbrock, known)(Eigen::MatrixXd::Zero(4, 2)),
      (std::vector<double>{7, 8}));
  worker.join();
  EXPECT_EQ(other, (std::vector<double>{7, 8}));
}

TEST(Ranks, NoLauncherNoRanks) {
  if (std::getenv("OMPI_COMM_WORLD_SIZE")) GTEST_SKIP() << "this test itself was started by a launcher";
  EXPECT_EQ(Ranks::join(), nullptr);
}

}  // namespace
}  // namespace selvedge::fit
