// Recorded trials, simulated: residuals as a const function of parameters and an explicit state.
//
// A Simulation holds what does not change: the trials and the grid. A State holds, for each trial, the branch of
// equilibrium that it hangs on, how it is held near its recording, and what a finer grid adds. Who searches owns a
// State and changes it; the same parameters and state always give the same residuals.
// Residuals are in mm: three a marker and time, one a stripe or outline point. Each has a standard deviation
// sd_mm, from the sensor's noise and what the grid leaves undetermined. The swatch is a sheet of splines. All trials
// and parameter sets of one call go through the simulation together in SIMD lanes, and these over the cores; results do
// not depend on either. Shapes are control points of the sheet; view() makes triangles of them to look at.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "cloth/spline/simulate.h"
#include "cloth/spline/view.h"
#include "cloth/surface_point.h"
#include "model/observed_trial.h"
#include "model/parameter.h"
#include "model/seen_markers.h"
#include "model/simulator.h"
#include "model/underway.h"

namespace selvedge::model {

class Ranks;

// One entry a trial.
struct State {
  std::vector<Eigen::Matrix3Xd> branch;  // the shape from which its equilibrium is sought, m
  std::vector<double> nudging_per_s;  // the hold, towards the markers that were seen (cloth/guide.h); 0: it runs free
  cloth::LetGo let_go;                // when the hold lets go of moving trials, their leads over
  // What a finer grid adds to the residuals, mm; empty: nothing. It is added to all residuals, so that a coarse grid
  // serves for derivatives and a fine one for what they are derivatives of.
  std::vector<Eigen::VectorXd> grid_correction_mm;
  std::vector<Underway> underway;  // of pieces out of longer trials (lead_in()); empty: all begin at rest
  bool is_underway(size_t trial) const { return trial < underway.size() && underway[trial].position.cols() > 0; }
};

// Trials to be evaluated in a state; none: all.
struct Asked {
  State state;
  std::vector<size_t> trials;
};

struct Residuals {
  std::vector<Eigen::VectorXd> mm;      // one a trial; NaN where the marker was not seen, empty where a trial was not
                                        // wanted
  std::vector<Eigen::Matrix3Xd> start;  // equilibrium of each trial
  bool finite = true;                   // false: a simulation diverged
};

struct SimulationOptions {
  int cells = 12;            // of the spline sheet along the width; as large down the height
  double model_sd_mm = 0.5;  // what the grid alone may be off by, added to sensor noise
  cloth::spline::Options sheet;
  std::shared_ptr<Ranks> ranks;  // that share out evaluate() (model/ranks/ranks.h); empty: this process alone
  std::shared_ptr<const Simulator> simulator;  // in the place of the sheet of splines; empty: that
};

class Simulation {
 public:
  Simulation(std::vector<ObservedTrial> trials, const SimulationOptions& options);

  const cloth::spline::SplineSheet& sheet() const { return sheet_; }
  const cloth::spline::View& view() const { return view_; }
  const std::vector<ObservedTrial>& trials() const { return trials_; }
  const SimulationOptions& options() const { return options_; }

  // The state in which each trial hangs on its recorded branch: of the shapes tried, the equilibrium nearest to the
  // first observation, at these coordinates; pieces out of longer trials are led in. nudging_per_s: of all trials.
  State state_at(const std::vector<Parameter>& parameters, const Eigen::VectorXd& coordinates,
                 double nudging_per_s = 0) const;
  // The branches of `other` in the state `there`, over the same trials on another grid; held as there, uncorrected.
  State state_of(const Simulation& other, const State& there) const;

  // Lets pieces out of longer trials begin as a fabric with these parameters moves there that is nudged hard towards
  // what was seen before. One that began at rest, as it was not, would bring that into what counts of it: few markers
  // take a second to make it forget.
  void lead_in(State& state, const std::vector<Parameter>& parameters, const Eigen::VectorXd& coordinates) const;

  // Goes on from the branches of another grid for some trials (empty: all).
  void take_branches(State& state, const Simulation& other, const State& there,
                     const std::vector<size_t>& trials = {}) const;
  // Goes on from these equilibria; trials whose shape is not finite, or of another grid, keep theirs.
  void take_branches(State& state, const std::vector<Eigen::Matrix3Xd>& shapes) const;

  // Seeks each trial's branch of equilibrium again, at these coordinates: among what markers, or the surface that
  // stripes show, leave that let go of the sheet, and the one in use. True where a trial (of those wanted, empty: all)
  // left its branch for one that lies nearer to the first observation; a piece that is led in has none to leave. An
  // optimiser stays on a branch that once was near, also when the parameters have moved away.
  bool rematch(State& state, const std::vector<Parameter>& parameters, const Eigen::VectorXd& coordinates,
               const std::vector<size_t>& trials = {}) const;

  // coordinates: parameters × sets. trials: which to evaluate (empty: all). One Residuals a set.
  std::vector<Residuals> evaluate(const State& state, const std::vector<Parameter>& parameters,
                                  const Eigen::MatrixXd& coordinates, const std::vector<size_t>& trials = {}) const;
  // The same in several states, side by side: one list for each.
  std::vector<std::vector<Residuals>> evaluate(const std::vector<Asked>& asked,
                                               const std::vector<Parameter>& parameters,
                                               const Eigen::MatrixXd& coordinates) const;

  // Standard deviations beside Residuals::mm of a trial.
  Eigen::VectorXd sd_mm(size_t trial) const;
  // Time of each residual, s, in the trial's own clock.
  Eigen::VectorXd time_s(size_t trial) const;

  // Simulated positions of a trial's samples for one set, for pictures and maps.
  cloth::Trajectory trajectory(const State& state, const std::vector<Parameter>& parameters,
                               const Eigen::VectorXd& coordinates, size_t trial) const;

  // Equilibria and motions of experiments on sheet(), by whatever simulates here. step_s: of our own sheet; 0: as the
  // lanes ask.
  std::vector<cloth::Rest> relaxed(const std::vector<cloth::Experiment>& lanes) const;
  std::vector<cloth::Trajectory> simulated(const std::vector<cloth::Experiment>& lanes, double step_s = 0) const;

  // What is to be simulated for a trial: one prediction for each of `count` sets from `first`.
  std::vector<Prediction> predictions(const State& state, const std::vector<Parameter>& parameters,
                                      const Eigen::MatrixXd& coordinates, size_t trial, Eigen::Index first,
                                      Eigen::Index count) const;

 private:
  // One set of one trial in one of the states, and as many as go side by side in SIMD lanes.
  struct Run {
    size_t asked = 0, trial = 0;
    Eigen::Index set = 0;
  };
  using Group = std::vector<Run>;
  // One call of evaluate(), and its answer.
  struct Call {
    const std::vector<Asked>& asked;
    const std::vector<Parameter>& parameters;
    const Eigen::MatrixXd& coordinates;
    std::vector<std::vector<Residuals>> out = {};
    double step_s = 0;  // of all runs, where some are simulated elsewhere; 0: as these runs ask
    Residuals& of(const Run& run) { return out[run.asked][static_cast<size_t>(run.set)]; }
  };
  std::vector<size_t> all_or(const std::vector<size_t>& wanted) const;  // all trials where none is named
  double common_step_s(const Call& call, const std::vector<Run>& runs) const;
  // Motions of the runs, each from where it begins.
  std::vector<cloth::Trajectory> trajectories_of(const Call& call, const std::vector<Run>& runs,
                                                 const std::vector<Prediction>& predicted) const;
  // Fills in the residuals of these runs; an empty start shape: it diverged.
  void evaluate_runs(Call& call, const std::vector<Run>& runs) const;
  void evaluate_on_ranks(Call& call, const std::vector<Run>& runs) const;
  // Where the runs begin: equilibria, of which those that differ in parameters of motion alone share one, sought once;
  // pieces that are underway as they are.
  std::vector<cloth::Rest> rests_of(const Call& call, const std::vector<Run>& runs,
                                    const std::vector<Prediction>& predicted) const;
  Prediction prediction_of(const Call& call, const Run& run) const;
  // The shape that is left where markers, or the surface that stripes show (seen_surface.h), pull the sheet to where
  // they were first seen and let go of it bit by bit: it depends neither on where the sheet hung before nor on which
  // way a long step fell.
  Eigen::Matrix3Xd let_go_of(size_t trial, const Prediction& prediction) const;
  // What the hold of a trial follows.
  std::shared_ptr<const cloth::GuideTrack> track_of(size_t trial, const Prediction& prediction) const;
  // A trial's branch: the present one of the state where there is one and none lies clearly nearer.
  Eigen::Matrix3Xd branch_of(const State& state, size_t trial, const std::vector<Parameter>& parameters,
                             const Eigen::VectorXd& coordinates) const;
  double distance_at_first_sight_mm(size_t trial, Prediction prediction, const Eigen::Matrix3Xd& rest) const;
  // seen: the trial's, or some times of it.
  Eigen::VectorXd residual_of(size_t trial, const ObservedTrial& seen, const Prediction& prediction,
                              const cloth::Trajectory& trajectory) const;
  // Whether who simulates can be set to a shape: a simulator that cannot chooses branches of equilibrium itself.
  bool begins_at_shapes() const { return !options_.simulator || options_.simulator->begins_at_shapes(); }

  cloth::spline::SplineSheet sheet_;
  cloth::spline::View view_;
  std::vector<int> rim_;  // of the view's mesh
  SimulationOptions options_;
  std::vector<ObservedTrial> trials_;
  std::vector<std::vector<cloth::SurfacePoint>> marker_points_;         // a trial, a marker
  std::vector<std::shared_ptr<const cloth::GuideTrack>> guide_tracks_;  // a trial; null without markers
};

// How many cells along the width make one a bending length, of a fabric with these parameters.
int cells_of_bending_length(const ObservedTrial& trial, const std::vector<Parameter>& parameters,
                            const Eigen::VectorXd& coordinates);

}  // namespace selvedge::model
