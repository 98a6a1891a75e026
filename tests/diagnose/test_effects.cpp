// Every effect of the library: neutral changes nothing, off neutral changes what is predicted.
#include <set>

#include <gtest/gtest.h>

#include "diagnose/effects/library.h"
#include "diagnose/study.h"
#include "model/simulation.h"
#include "tests/diagnose/grid_campaign.h"
#include "tests/diagnose/simulated_campaign.h"

namespace selvedge::diagnose {
namespace {

TEST(Effects, NamesAreTheFormatsAndBoundsHoldNeutral) {
  const std::set<std::string> format = {"camera_delay",
                                        "rolling_shutter",
                                        "dropped_frames",
                                        "camera_distortion",
                                        "projector_moved",
                                        "rig_tilt",
                                        "outline_jitter",
                                        "outline_erosion",
                                        "grid_drift",
                                        "pose_error",
                                        "depth_bias",
                                        "smoothing",
                                        "marker_offset",
                                        "grip_slip",
                                        "anisotropy",
                                        "coupling",
                                        "stretch_stiffening",
                                        "bend_nonlinearity",
                                        "hem",
                                        "rest_curvature",
                                        "bend_friction",
                                        "stretch_friction",
                                        "creep",
                                        "nonlinear_drag",
                                        "draught",
                                        "added_mass",
                                        "mass_error",
                                        "local_mass",
                                        "integrator_damping",
                                        "mesh_resolution"};
  std::set<std::string> found;
  for (const Effect& e : effect_library()) {
    EXPECT_TRUE(format.count(e.name)) << e.name;
    EXPECT_TRUE(found.insert(e.name).second) << e.name;
    EXPECT_FALSE(e.summary.empty()) << e.name;
    ASSERT_FALSE(e.parameters.empty()) << e.name;
    for (const model::Parameter& p : e.parameters) {
      EXPECT_LE(p.lower, p.start) << e.name << " " << p.name;
      EXPECT_LT(p.start, p.upper) << e.name << " " << p.name;
      EXPECT_GT(p.scale, 0) << e.name << " " << p.name;
    }
  }
  EXPECT_EQ(found, format);
}

class EffectOnTrial : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    const trial::Campaign campaign = simulated_campaign(usual_fabric());
    model::SimulationOptions options;
    options.cells = 6;
    base_ = model::base_parameters();
    Eigen::VectorXd x(static_cast<Eigen::Index>(base_.size()));
    for (size_t k = 0; k < base_.size(); ++k)
      x(static_cast<Eigen::Index>(k)) = model::to_coordinate(base_[k], base_[k].start);
    simulation_ = std::make_unique<model::Simulation>(
        std::vector<model::ObservedTrial>{model::observe_trial(campaign.trials[1])}, options);
    state_ = simulation_->state_at(base_, x);
    const Tracker shaken = [](const Surface& surface, const Eigen::Vector2d& uv, double t) -> Eigen::Vector3d {
      return surface(uv, t) + Eigen::Vector3d(0, 0.004 * std::sin(700 * t), 0);
    };
    grid_ = std::make_unique<model::Simulation>(
        std::vector<model::ObservedTrial>{model::observe_trial(
            grid_trial({.amplitude_m = 0.1, .tracker = [=](unsigned) { return shaken; }}, "robot-1", 1))},
        options);
    state_of_grid_ = grid_->state_at(base_, x);
    state_of_grid_.grid_correction_mm = {Eigen::VectorXd::Constant(grid_->time_s(0).size(), 0.5)};
    state_.grid_correction_mm = {Eigen::VectorXd::Constant(simulation_->time_s(0).size(), 0.5)};
    start_ = x;
  }
  static inline std::vector<model::Parameter> base_;
  static inline std::unique_ptr<model::Simulation> simulation_, grid_;  // dots on a swatch held at its corners; nodes
  static inline model::State state_, state_of_grid_;
  static inline Eigen::VectorXd start_;
};

TEST_F(EffectOnTrial, NeutralChangesNothingAndScaleChangesSomething) {
  const Eigen::VectorXd plain_dots = simulation_->evaluate(state_, base_, start_).front().mm[0],
                        plain_nodes = grid_->evaluate(state_of_grid_, base_, start_).front().mm[0];
  for (const Effect& e : effect_library()) {
    if (e.applies_to == AppliesTo::images) continue;  // markers do not show them
    const bool on_grid = e.applies_to == AppliesTo::outlines || e.applies_to == AppliesTo::grids ||
                         e.name == "depth_bias";  // where a camera is told of
    const model::Simulation& simulation = on_grid ? *grid_ : *simulation_;
    const model::State& state = on_grid ? state_of_grid_ : state_;
    const Eigen::VectorXd& plain = on_grid ? plain_nodes : plain_dots;
    std::vector<model::Parameter> parameters = base_;
    parameters.insert(parameters.end(), e.parameters.begin(), e.parameters.end());
    const auto n = static_cast<Eigen::Index>(parameters.size());
    Eigen::MatrixXd sets(n, 2);
    sets.col(0).head(start_.size()) = start_;
    for (Eigen::Index k = start_.size(); k < n; ++k)
      sets(k, 0) = model::to_coordinate(parameters[static_cast<size_t>(k)], parameters[static_cast<size_t>(k)].start);
    sets.col(1) = sets.col(0);
    sets.col(1).tail(n - start_.size()).array() += 1;
    const std::vector<model::Residuals> r = simulation.evaluate(state, parameters, sets);
    ASSERT_TRUE(r[1].finite) << e.name;
    // By itself, for all lanes of a call take the step of the stiffest.
    const Eigen::VectorXd neutral = simulation.evaluate(state, parameters, sets.col(0)).front().mm[0];
    if (e.name != "nonlinear_drag") { EXPECT_LT((neutral - plain).cwiseAbs().maxCoeff(), 1e-6) << e.name; }
    EXPECT_GT((r[1].mm[0] - r[0].mm[0]).cwiseAbs().maxCoeff(), 1e-2) << e.name;
  }
}

TEST(Effects, MassIsAbsorbedByScalingEverything) {
  const trial::Campaign campaign = simulated_campaign(usual_fabric());
  model::SimulationOptions options;
  options.cells = 6;
  std::vector<model::Parameter> parameters = model::base_parameters();
  Eigen::VectorXd x(static_cast<Eigen::Index>(parameters.size()));
  for (size_t k = 0; k < parameters.size(); ++k)
    x(static_cast<Eigen::Index>(k)) = model::to_coordinate(parameters[k], parameters[k].start);
  const model::Simulation simulation({model::observe_trial(campaign.trials[1])}, options);
  const model::State state = simulation.state_at(parameters, x);
  for (const Effect& e : effect_library())
    if (e.name == "mass_error") parameters.push_back(e.parameters[0]);
  Eigen::MatrixXd sets(x.size() + 1, 2);
  sets << x, x, 0, 0.2 / parameters.back().scale;
  for (Eigen::Index k = 0; k < x.size(); ++k)
    if (parameters[static_cast<size_t>(k)].name != "drag_fade") sets(k, 1) += std::log(1.2);
  const std::vector<model::Residuals> r = simulation.evaluate(state, parameters, sets);
  EXPECT_LT((r[0].mm[0] - r[1].mm[0]).cwiseAbs().maxCoeff(), 0.05);
}

}  // namespace
}  // namespace selvedge::diagnose
