#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "cli/verify/proofs/cloth_cases.h"
#include "cloth/simulate.h"

namespace selvedge::cloth {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(GuideTrack, FollowsAMotionBetweenItsTimesAndRestsBeside) {
  GuideTrack track;
  track.points.resize(2);
  track.time_s = {0, 0.1, 0.2, 0.3, 0.4};
  track.position.resize(3, 10);
  for (int j = 0; j < 5; ++j) {
    const double t = 0.1 * j;
    track.position.col(j) = Eigen::Vector3d(t, t * t, 1);
    track.position.col(5 + j) = j == 4 ? Eigen::Vector3d(kNan, kNan, kNan) : Eigen::Vector3d(0, 0, t);
  }
  const GuideTrack::Seen seen = track.at(0.17);
  EXPECT_LT((seen.position.col(0) - Eigen::Vector3d(0.17, 0.0289, 1)).norm(), 1e-12);
  EXPECT_LT((seen.velocity.col(0) - Eigen::Vector3d(1, 0.34, 0)).norm(), 1e-12);
  EXPECT_TRUE(seen.position.col(1).allFinite());
  EXPECT_FALSE(track.at(0.25).position.col(1).allFinite()) << "a time beside one at which it was not seen";
  EXPECT_EQ(track.at(-1).position.col(0), track.position.col(0));
  EXPECT_TRUE(track.at(9).velocity.col(0).isZero());
}

TEST(Guide, PullsAlongItsNormalsAlone) {
  auto track = std::make_shared<GuideTrack>();
  track->points = {{{0}, {1}}};
  track->time_s = {0};
  track->position = Eigen::Vector3d(1, 2, 3);
  Guide guide{track, 10};
  Eigen::Vector3d at(0, 0, 0), force(0, 0, 0);
  add_nudging(guide, 0.5, 0, at.data(), nullptr, force.data());
  EXPECT_LT((force - 50 * Eigen::Vector3d(1, 2, 3)).norm(), 1e-9) << "mass times the gain's square times the distance";
  track->normal = Eigen::Vector3d(0, 0.6, 0.8);
  force.setZero();
  add_nudging(guide, 0.5, 0, at.data(), nullptr, force.data());
  EXPECT_LT((force - 50 * 3.6 * Eigen::Vector3d(0, 0.6, 0.8)).norm(), 1e-9);
}

TEST(GuideTrack, HasTheNormalOfTheNearerTime) {
  GuideTrack track;
  track.points.resize(2);
  track.time_s = {0, 1};
  track.position = Eigen::Matrix3Xd::Zero(3, 4);
  track.normal.resize(3, 4);
  track.normal << 1, 0, 0, 0, 0, 1, 0, -1, 0, 0, 1, 0;
  for (const double t : {-1.0, 0.4}) {
    EXPECT_EQ(track.at(t).normal.col(0), Eigen::Vector3d::UnitX()) << t;
    EXPECT_EQ(track.at(t).normal.col(1), Eigen::Vector3d::UnitZ()) << t;
  }
  for (const double t : {0.6, 2.0}) {
    EXPECT_EQ(track.at(t).normal.col(0), Eigen::Vector3d::UnitY()) << t;
    EXPECT_EQ(track.at(t).normal.col(1), -Eigen::Vector3d::UnitY()) << t;
  }
}

class Guided : public testing::Test {
 protected:
  Guided() {
    seen_.start_shape = hung_shape(sheet_, seen_, 1);
    truth_ = simulate(sheet_, {seen_})[0];
    auto track = std::make_shared<GuideTrack>();
    for (const double u : {0.06, 0.15, 0.24})
      for (const double v : {0.06, 0.15, 0.24}) track->points.push_back(surface_point(sheet_, {u, v}));
    track->time_s = seen_.sample_s;
    const auto times = static_cast<Eigen::Index>(track->time_s.size());
    track->position.resize(3, 9 * times);
    for (Eigen::Index k = 0; k < 9; ++k)
      for (Eigen::Index j = 0; j < times; ++j)
        track->position.col(k * times + j) =
            position_of(track->points[static_cast<size_t>(k)], truth_.samples[static_cast<size_t>(j)]);
    track_ = track;
  }

  Experiment pulled(const Experiment& e) const {
    Experiment out = e;
    out.guide = std::make_shared<Guide>(Guide{track_, 10});
    return out;
  }

  double distance_m(const Trajectory& t) const {
    double sum = 0;
    for (size_t i = 0; i < t.samples.size(); ++i)
      sum += (t.samples[i] - truth_.samples[i]).colwise().squaredNorm().mean();
    return std::sqrt(sum / static_cast<double>(t.samples.size()));
  }

  Sheet sheet_ = make_sheet(geometry::make_grid_mesh(0.3, 0.3, 9, 9));
  Experiment seen_ = cli::waving_experiment(0.1, 40);
  Trajectory truth_;
  std::shared_ptr<const GuideTrack> track_;
};

TEST_F(Guided, LeavesTheRightModelAloneAndKeepsAWrongOneNear) {
  Experiment wrong = seen_;
  wrong.material.bend *= 4;
  wrong.material.drag_normal *= 3;
  const double free_m = distance_m(simulate(sheet_, {wrong})[0]),
               pulled_m = distance_m(simulate(sheet_, {pulled(wrong)})[0]);
  EXPECT_GT(free_m, 5e-3);
  EXPECT_LT(pulled_m, 0.5 * free_m);
  EXPECT_GT(pulled_m, 0.5e-3) << "what the model lacks must still show";
  EXPECT_LT(distance_m(simulate(sheet_, {pulled(seen_)})[0]), 6e-4) << "cubics between 30 pictures a second";
}

TEST(LetGo, IsFreeAndHeldByTurns) {
  const LetGo second{0.5, 0.5};
  EXPECT_FALSE(LetGo{}.is_free(3));
  for (const double t : {0.0, 0.49, 1.0, 1.49}) EXPECT_FALSE(second.is_free(t)) << t;
  for (const double t : {0.5, 0.99, 1.5}) EXPECT_TRUE(second.is_free(t)) << t;
  for (const double t : {0.0, 0.3, 0.7, 1.2}) EXPECT_NE((LetGo{0.5, 0}.is_free(t)), second.is_free(t)) << t;
}

TEST(LetGo, HoldsToTheEndOfALeadFirst) {
  const LetGo led_in{0.5, 0, 0.7};
  for (const double t : {0.0, 0.3, 0.69, 1.21}) EXPECT_FALSE(led_in.is_free(t)) << t;
  for (const double t : {0.71, 1.19, 1.71}) EXPECT_TRUE(led_in.is_free(t)) << t;
}

TEST_F(Guided, RunsFreeWhileItIsLetGo) {
  Experiment wrong = pulled(seen_);
  wrong.material.drag_normal *= 3;
  const auto with = [&](const LetGo& let_go) {
    Experiment e = wrong;
    auto guide = std::make_shared<Guide>(*e.guide);
    guide->let_go = let_go;
    e.guide = guide;
    return simulate(sheet_, {e})[0];
  };
  const Trajectory held = with({}), at_first = with({0.3, 0}), later = with({0.3, 0.3}), always = with({10, 0});
  const auto apart_m = [](const Trajectory& a, const Trajectory& b, size_t i) {
    return (a.samples[i] - b.samples[i]).norm();
  };
  for (size_t i = 0; i < seen_.sample_s.size(); ++i) {
    const double t = seen_.sample_s[i] - seen_.start_s;
    if (t <= 0.3) {
      EXPECT_EQ(apart_m(at_first, always, i), 0) << t;
      EXPECT_EQ(apart_m(later, held, i), 0) << t;
    }
  }
  EXPECT_GT(apart_m(at_first, always, seen_.sample_s.size() - 1), 0);
  EXPECT_GT(apart_m(later, held, seen_.sample_s.size() - 1), 0);
}

TEST_F(Guided, EquilibriumIsPulledToo) {
  Experiment wrong = seen_;
  wrong.material.bend *= 4;
  const auto off = [&](const Experiment& e) {
    return (relax(sheet_, {e})[0].position - truth_.start).colwise().norm().mean();
  };
  EXPECT_LT(off(pulled(wrong)), 0.9 * off(wrong));
}

TEST(Guide, PullsToWhatLateStampsShow) {
  auto track = std::make_shared<GuideTrack>();
  track->points = {{{0}, {1}}};
  track->time_s = {0, 1};
  track->position = Eigen::Matrix<double, 3, 2>{{0, 1}, {0, 0}, {0, 0}};
  Guide guide{track, 10};
  guide.stamp_of = [](double t_s) { return t_s + 0.3; };
  Eigen::Vector3d at(0, 0, 0), force(0, 0, 0);
  add_nudging(guide, 1, 0.2, at.data(), nullptr, force.data());
  EXPECT_NEAR(force.x(), 100 * track->at(0.5).position(0, 0), 1e-12);
}

TEST_F(Guided, LanesGiveTheBitsOfSingleRuns) {
  std::vector<Experiment> lanes(3, pulled(seen_));
  lanes[1].material.stretch *= 1.1;
  lanes[2].material.bend *= 2;
  Options options;
  options.step_s = common_step_s(sheet_, lanes);
  const std::vector<Trajectory> together = simulate(sheet_, lanes, options);
  for (size_t i = 0; i < lanes.size(); ++i)
    EXPECT_EQ(together[i].samples.back(), simulate(sheet_, {lanes[i]}, options)[0].samples.back()) << i;
  lanes[1].guide = nullptr;
  EXPECT_THROW(simulate(sheet_, lanes, options), std::invalid_argument);
}

}  // namespace
}  // namespace selvedge::cloth
