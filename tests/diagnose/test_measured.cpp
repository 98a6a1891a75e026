// What recordings show of their own sensors, and effects of measurement: each is found with its size.
#include <algorithm>
#include <map>
#include <set>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "diagnose/diagnosis.h"
#include "diagnose/effects/library.h"
#include "model/excerpts.h"
#include "diagnose/measured.h"
#include "diagnose/windows.h"
#include "geometry/projection.h"
#include "model/seen_markers.h"
#include "tests/diagnose/grid_campaign.h"
#include "tests/diagnose/simulated_campaign.h"

namespace selvedge::diagnose {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

Tracker truthful(unsigned /*seed*/) {
  return [](const Surface& surface, const Vector2d& uv, double t) { return surface(uv, t); };
}

Tracker late(double by_s) {
  return [=](const Surface& surface, const Vector2d& uv, double t) { return surface(uv, t - by_s); };
}

// The four corners of the outline jump at each time, and what is inside goes with them.
std::function<Tracker(unsigned)> jumping(double by_m) {
  return [=](unsigned seed) -> Tracker {
    return [=](const Surface& surface, const Vector2d& uv, double t) -> Vector3d {
      std::mt19937 generator(1000 * seed + static_cast<unsigned>(std::lround(120 * t)));
      std::normal_distribution<double> jump(0, by_m);
      Eigen::Matrix<double, 3, 4> corner;
      for (double& x : corner.reshaped()) x = jump(generator);
      const double u = uv.x() / kGridWidth_m, v = uv.y() / kGridWidth_m;
      return surface(uv, t) + (1 - v) * ((1 - u) * corner.col(0) + u * corner.col(1)) +
             v * ((1 - u) * corner.col(2) + u * corner.col(3));
    };
  };
}

model::ObservedTrial observed(const std::function<Tracker(unsigned)>& tracker) {
  return model::observe_trial(grid_trial({.amplitude_m = 0.12, .frequency_hz = 1.4, .tracker = tracker}, "robot-1", 2));
}

TEST(Measured, FindsHowLateTheMarkersAre) {
  for (const double by_s : {0.0, 0.31, -0.12}) {
    std::vector<model::ObservedTrial> trials = {observed([=](unsigned) { return late(by_s); })};
    const Measured m = measure(trials, {});
    ASSERT_TRUE(m.delay);
    EXPECT_NEAR(m.delay->delay_s, by_s, 0.003);
  }
}

TEST(Measured, SaysNothingOfADelayWhereNoHeldPointIsSeen) {
  std::vector<model::ObservedTrial> trials = {
      model::observe_trial(simulated_trial({}, {.amplitude_m = 0.09, .samples = 97}, "waving-1", 1))};
  EXPECT_FALSE(measure(trials, {}).delay);
  EXPECT_FALSE(model::is_outline_grid(trials[0]));
}

TEST(Measured, TellsJumpsOfAnOutlineFromNoise) {
  std::vector<model::ObservedTrial> still = {observed(truthful)}, jumps = {observed(jumping(0.01))};
  const Measured none = measure(still, {}), some = measure(jumps, {});
  EXPECT_LT(none.middle_m[0], 5e-4);
  // The mean of two corners that jump by 10 mm each, and half of what lies between them.
  EXPECT_NEAR(some.middle_m[0], 0.0071, 0.0025);
  EXPECT_NEAR(some.ends_m[0], 0.0071, 0.0025);
  EXPECT_LT(jumps[0].markers->noise_m, 5e-4);  // jumps are no noise of single markers
}

TEST(Measured, FindsMoreNoiseThanATrialStates) {
  std::vector<model::ObservedTrial> trials = {observed([](unsigned seed) -> Tracker {
    auto generator = std::make_shared<std::mt19937>(seed);
    return [=](const Surface& surface, const Vector2d& uv, double t) -> Vector3d {
      std::normal_distribution<double> noise(0, 2e-3);
      return surface(uv, t) + Vector3d(noise(*generator), noise(*generator), noise(*generator));
    };
  })};
  ASSERT_NEAR(trials[0].markers->noise_m, 2e-4, 1e-6);
  measure(trials, {});
  EXPECT_NEAR(trials[0].markers->noise_m, 2e-3, 4e-4);
}

// One frame that is 24 mm off would push the sheet with ω² 24 mm, 1 g.
TEST(GuideTrack, HoldsBackAFrameThatJumps) {
  model::ObservedTrial trial = observed(truthful);
  const size_t times = trial.markers->time_s.size(), jumps = times / 2;
  model::SimulationOptions options;
  options.cells = 6;
  const auto track_of = [&] {
    return model::Simulation({trial}, options)
        .predictions({{Eigen::Matrix3Xd()}, {20}, {}, {}, {}}, {}, Eigen::MatrixXd(0, 1), 0, 0, 1)
        .front()
        .experiment.guide->track->position;
  };
  const Eigen::Matrix3Xd before = track_of();
  EXPECT_LT((before - trial.markers->position).cwiseAbs().maxCoeff(), 1e-12);  // what moves is not held back
  for (size_t k = 0; k < trial.markers->uv.size(); ++k)
    trial.markers->position.col(static_cast<Eigen::Index>(k * times + jumps)) += Vector3d(0, 0.024, 0);
  const Eigen::Matrix3Xd off = track_of() - before;
  for (size_t k = 0; k < trial.markers->uv.size(); ++k) {
    const auto first = static_cast<Eigen::Index>(k * times);
    EXPECT_LT(off.col(first + static_cast<Eigen::Index>(jumps)).norm(), 0.006);
    EXPECT_LT(off.col(first + static_cast<Eigen::Index>(jumps) + 2).norm(), 1e-4);
  }
}

TEST(Excerpts, TakeTheMostMovedPieceOfALongCampaign) {
  model::ObservedTrial trial = observed(truthful);
  const double whole_s = trial.markers->time_s.back() - trial.experiment.start_s;
  EXPECT_EQ(model::excerpts({trial}, {.most_motion_s = 10})[0].lead_s, 0);
  const model::ObservedTrial piece = model::excerpts({trial}, {.most_motion_s = 0.3, .lead_s = 0.1})[0];
  EXPECT_EQ(piece.lead_s, 0.1);
  const double from = piece.markers->time_s.front(), to = piece.markers->time_s.back();
  EXPECT_LT(to - from, 0.4 + 1e-6);
  EXPECT_LT(to - from, whole_s);
  EXPECT_GT(from, 0.1 - 1e-9);  // before that the bar rests
  EXPECT_EQ(piece.markers->position.cols(),
            static_cast<Eigen::Index>(piece.markers->uv.size() * piece.markers->time_s.size()));
  const auto at = std::find(trial.markers->time_s.begin(), trial.markers->time_s.end(), from);
  ASSERT_NE(at, trial.markers->time_s.end());
  EXPECT_EQ(piece.markers->position.col(0), trial.markers->position.col(at - trial.markers->time_s.begin()));
}

// Pictures hold nothing, so their piece begins at rest, half a second before the edge moves: as early as stamps may be.
TEST(Excerpts, OfPicturesBeginAtRest) {
  model::ObservedTrial trial = observed(truthful);
  cloth::HeldPath& path = trial.experiment.path;
  for (double& t : path.time_s) t += 1;
  trial.experiment.sample_s = model::sample_times(trial.experiment.start_s, trial.experiment.start_s + 2);
  auto stripes = std::make_shared<observe::StripeTrack>();
  for (double t = trial.experiment.start_s; t < trial.experiment.start_s + 2; t += 0.1) {
    stripes->frames.emplace_back();
    stripes->frames.back().time_s = t;
  }
  trial.markers.reset();
  trial.stripes = stripes;
  EXPECT_EQ(model::excerpts({trial}, {.most_motion_s = 1})[0].stripes, trial.stripes);
  const model::ObservedTrial piece = model::excerpts({trial}, {.most_motion_s = 1, .pictures = true})[0];
  const double from = piece.experiment.start_s;
  EXPECT_TRUE(piece.experiment.starts_at_rest);
  EXPECT_EQ(piece.lead_s, 0);
  const auto moved = [&](double t) { return (path.at(t) - path.at(trial.experiment.start_s)).norm(); };
  EXPECT_LT(moved(from + 0.45), 0.006);
  EXPECT_GT(moved(from + 0.6), 0.004);
  EXPECT_GE(piece.stripes->frames.front().time_s, from);
  EXPECT_LE(piece.stripes->frames.back().time_s, from + 1);
  EXPECT_GE(piece.stripes->frames.size(), 9U);
  EXPECT_NEAR(piece.experiment.sample_s.front(), from, 1e-12);
}

TEST(Excerpts, TheBeginningIsWhatWasSeenUntilThen) {
  const model::ObservedTrial trial = observed(truthful);
  const std::vector<double>& time_s = trial.markers->time_s;
  const size_t kept = time_s.size() / 3;
  const model::ObservedTrial part = model::beginning_of(trial, time_s[kept - 1]);
  ASSERT_EQ(part.markers->time_s.size(), kept);
  const auto last = static_cast<Eigen::Index>(time_s.size() + kept) - 1;  // of the second marker
  EXPECT_EQ(part.markers->position.col(static_cast<Eigen::Index>(2 * kept) - 1), trial.markers->position.col(last));
  // Positions between samples are interpolated, so the last seen needs one after it.
  EXPECT_GT(part.experiment.sample_s.back(), time_s[kept - 1]);
  EXPECT_LT(part.experiment.sample_s.back(), time_s[kept]);
  model::ObservedTrial still = trial;
  still.still = true;
  EXPECT_EQ(model::beginning_of(still, time_s[kept - 1]).markers->time_s, time_s);
}

// A piece begins alike for all fabrics, as one moved there, and leaves that in its lead.
TEST(Excerpts, BeginAlikeForAllFabrics) {
  const std::vector<model::ObservedTrial> pieces =
      model::excerpts({observed(truthful)}, {.most_motion_s = 0.3, .lead_s = 0.1});
  model::SimulationOptions options;
  options.cells = 6;
  const model::Simulation simulation(pieces, options);
  const std::vector<model::Parameter> base = model::base_parameters(model::Drag::nonlinear);
  Eigen::MatrixXd two = model::usual_coordinates(base).replicate(1, 2);
  two.col(1).array() += 0.5;
  model::State state = simulation.state_at(base, two.col(1), 20);
  simulation.lead_in(state, base, two.col(1));
  const std::vector<model::Residuals> both = simulation.evaluate(state, base, two);
  EXPECT_EQ(both[0].start[0], both[1].start[0]);
  EXPECT_NE(both[0].mm[0], both[1].mm[0]);
  EXPECT_EQ(simulation.evaluate(state, base, two.col(1))[0].start[0], both[0].start[0]);  // whoever is beside it
  EXPECT_FALSE(simulation.rematch(state, base, two.col(0)));
}

// Of a trial that the model made, a piece begins as the fabric moved there, on another grid too; at rest it would begin
// millimetres off.
TEST(Excerpts, BeginAsTheFabricMoved) {
  const SimulatedSwatch fabric = usual_fabric();
  std::vector<model::ObservedTrial> trials;
  for (const trial::Trial& t : simulated_campaign(fabric).trials) trials.push_back(model::observe_trial(t));
  const std::vector<model::Parameter> base = model::base_parameters();
  const Eigen::VectorXd x = base_of(fabric, fabric.material.stretch, fabric.material.shear);
  std::vector<model::ObservedTrial> pieces = model::excerpts(trials, {.most_motion_s = 0.4, .lead_s = 0.1});
  const auto led = static_cast<size_t>(
      std::find_if(pieces.begin(), pieces.end(), [](const model::ObservedTrial& p) { return p.before; }) -
      pieces.begin());
  ASSERT_LT(led, pieces.size());
  model::SimulationOptions options;
  options.cells = 9;
  const model::Simulation simulation(pieces, options);
  options.cells = 12;
  const model::Simulation finer(pieces, options);
  const model::State underway = simulation.state_at(base, x);
  model::State at_rest = underway;
  at_rest.underway.clear();
  // Off in the first 0.1 s, mm.
  const auto off = [&](const model::Simulation& on, const model::State& state) {
    const Eigen::VectorXd r = on.evaluate(state, base, x)[0].mm[led], time = on.time_s(led);
    const double until = pieces[led].experiment.start_s + 0.1;
    return std::sqrt(3 * (time.array() < until).select(r.array().square(), 0).sum() /
                     static_cast<double>((time.array() < until).count()));
  };
  EXPECT_LT(off(simulation, underway), 1);
  EXPECT_LT(off(finer, finer.state_of(simulation, underway)), 1);
  EXPECT_GT(off(simulation, at_rest), 2);
}

// What counts of a piece is free in one of its two runs, and held until then; its lead is held in both.
TEST(Excerpts, AreHeldThroughTheirLeads) {
  const std::vector<model::ObservedTrial> pieces =
      model::excerpts({observed(truthful)}, {.most_motion_s = 0.6, .lead_s = 0.1});
  const model::ObservedTrial& piece = pieces[0];
  ASSERT_GT(piece.lead_s, 0);
  model::SimulationOptions options;
  options.cells = 6;
  const model::Simulation simulation(pieces, options);
  const Protocol protocol;
  const Windows windows(simulation, protocol);
  const std::vector<model::Parameter> base = model::base_parameters(model::Drag::nonlinear);
  const Eigen::MatrixXd usual = model::usual_coordinates(base);
  const model::State state = simulation.state_at(base, usual.col(0), protocol.hold_per_s);
  for (int phase = 0; phase < 2; ++phase) {
    const model::Prediction p =
        simulation.predictions(windows.held(simulation, state, phase), base, usual, 0, 0, 1).front();
    for (double since = 0.005; since < 0.6; since += 0.01)
      EXPECT_EQ(p.experiment.guide->let_go.is_free(since),
                since > piece.lead_s && windows.phase_at(piece, piece.experiment.start_s + since) == phase)
          << since << " s, run " << phase;
  }
}

// Of a trial that diverges nothing is known; what is known of the others stays.
TEST(Windows, LeaveOutTheRowsOfATrialThatDiverges) {
  std::vector<model::ObservedTrial> trials(2, observed(truthful));
  trials[1].experiment.air_velocity_m_s.setConstant(std::nan(""));
  model::SimulationOptions options;
  options.cells = 6;
  const model::Simulation simulation(trials, options);
  const Windows windows(simulation, {});
  const std::vector<model::Parameter> base = model::base_parameters(model::Drag::nonlinear);
  const Eigen::MatrixXd usual = model::usual_coordinates(base);
  const Eigen::MatrixXd left = windows.residuals(simulation, simulation.state_at(base, usual.col(0), 20), base, usual);
  ASSERT_GT(windows.rows(), 0);
  for (Eigen::Index row = 0; row < windows.rows(); ++row)
    EXPECT_EQ(std::isfinite(left(row, 0)), windows.trial(row) == 0) << row;
}

// A lag moves the grips' path: where a piece begins they are held, and nothing is jerked there.
TEST(Excerpts, BeginWhereTheirGripsAre) {
  const std::vector<model::ObservedTrial> pieces =
      model::excerpts({observed(truthful)}, {.most_motion_s = 0.3, .lead_s = 0.1});
  model::SimulationOptions options;
  options.cells = 6;
  const model::Simulation simulation(pieces, options);
  const std::vector<Effect> library = effect_library();
  const std::vector<model::Parameter> delay = std::find_if(library.begin(), library.end(), [](const Effect& e) {
                                                return e.name == "camera_delay";
                                              })->parameters;
  const Eigen::MatrixXd late = Eigen::MatrixXd::Constant(1, 1, model::to_coordinate(delay[0], 0.15));
  model::State state = simulation.state_at(delay, late.col(0), 20);
  simulation.lead_in(state, delay, Eigen::VectorXd::Zero(1));
  ASSERT_GT(state.underway[0].velocity.norm(), 0.1);
  const Eigen::Matrix3Xd start = simulation.evaluate(state, delay, late)[0].start[0];
  const cloth::Experiment& e = pieces[0].experiment;
  const Vector3d left = cloth::position_of(surface_point(simulation.sheet(), Vector2d(0, 0)), start);
  EXPECT_GT((e.path.at(e.start_s).col(0) - e.path.at(e.start_s - 0.15).col(0)).norm(), 0.005);
  EXPECT_LT((left - e.path.at(e.start_s - 0.15).col(0)).norm(), 1e-4);
}

struct Fault {
  std::string effect;
  std::function<Tracker(unsigned)> tracker;
  std::map<std::string, double> truth;
};

class FaultOfMeasurement : public testing::TestWithParam<size_t> {};

std::vector<Fault> faults() {
  const auto same = [](const Tracker& tracker) { return [=](unsigned) { return tracker; }; };
  return {{"camera_delay", same(late(0.28)), {{"delay", 0.28}}},
          {"outline_erosion",
           same([](const Surface& surface, const Vector2d& uv, double t) -> Vector3d {
             const double share = 1 - 2 * 0.006 / kGridWidth_m;
             return surface(share * uv + Vector2d::Constant(0.006), t);
           }),
           {{"erosion", 0.006}}}};
}

TEST_P(FaultOfMeasurement, IsNamedAndSized) {
  const Fault fault = faults()[GetParam()];
  std::vector<Effect> measurement;
  const std::set<std::string> tried = {"camera_delay",    "pose_error", "depth_bias", "smoothing", "outline_jitter",
                                       "outline_erosion", "grid_drift", "draught",    "mass_error"};
  for (const Effect& e : effect_library())
    if (tried.contains(e.name)) measurement.push_back(e);
  DiagnosisOptions options;
  options.study.protocol.cells = 8;
  options.study.protocol.rate_hz = 20;
  const Diagnosis d = diagnose(grid_campaign(fault.tracker), measurement, options);
  EXPECT_EQ(d.cause, fault.effect);
  EXPECT_EQ(d.side, "measurement");
  const auto found =
      std::find_if(d.effects.begin(), d.effects.end(), [&](const EffectFinding& f) { return f.name == fault.effect; });
  ASSERT_NE(found, d.effects.end());
  ASSERT_FALSE(found->size.empty());
  for (const SizedParameter& p : found->size) {
    const auto truth = fault.truth.find(p.name);
    if (truth == fault.truth.end()) continue;
    EXPECT_LE(p.low, truth->second) << p.name;
    EXPECT_GE(p.high, truth->second) << p.name;
    EXPECT_NEAR(p.value, truth->second, 0.35 * std::abs(truth->second)) << p.name;
  }
  double part = 0;
  for (const BudgetPart& p : d.budget.parts)
    if (p.effect == fault.effect) part = p.share.value;
  EXPECT_GT(part, 0.5);
}

INSTANTIATE_TEST_SUITE_P(Each, FaultOfMeasurement, testing::Range<size_t>(0, faults().size()),
                         [](const auto& info) { return faults()[info.param].effect; });

}  // namespace
}  // namespace selvedge::diagnose
