// Residuals of recorded trials under a model with given parameters.
//
// Residuals are in mm: three a marker and time, one a stripe or outline point. Each has a standard deviation
// sd_mm, from the sensor's noise and what the mesh leaves undetermined. Parameter sets of one call go through
// the simulation together in SIMD lanes, and trials over the cores; results do not depend on either.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cloth/surface_point.h"
#include "fit/model.h"
#include "fit/observed_trial.h"

namespace selvedge::fit {

class Objective;
class Ranks;

// One trial on one mesh, with the shape from which its equilibrium is sought.
struct Scene {
  ObservedTrial trial;
  Eigen::Matrix3Xd start_shape;
};

struct Residuals {
  std::vector<Eigen::VectorXd> mm;      // one a trial; NaN where the marker was not seen, empty where a trial was not
                                        // wanted or is left out as a whole
  std::vector<Eigen::Matrix3Xd> start;  // equilibrium of each trial
  bool finite = true;                   // false: a simulation blew up
};

struct ObjectiveOptions {
  int columns = 17;          // of the mesh along the width
  double model_sd_mm = 0.5;  // what the mesh alone may be off by, added to sensor noise
  cloth::Options simulation;
  std::shared_ptr<Ranks> ranks;  // that share out evaluate() (fit/spread/ranks.h); empty: this process alone
  bool shared_rests = false;  // sets that differ in parameters of motion alone start from one equilibrium, sought once
  double skipped_s =
      0;  // from each trial's start, where residuals are NaN; where it is not 0, still trials are left out as a whole
  double pull_per_s = 0;                 // towards the markers that were seen (cloth/guide.h); 0: simulations run free
  const Objective* branch_of = nullptr;  // equilibria start from this one's, on another mesh, and are not sought
};

class Objective {
 public:
  // Finds each trial's branch of equilibrium: of the shapes tried, the one nearest to the first observation.
  // usual: parameters at which that is decided.
  Objective(std::vector<ObservedTrial> trials, const ObjectiveOptions& options,
            const std::vector<Parameter>& parameters, const Eigen::VectorXd& usual);

  const cloth::Sheet& sheet() const { return sheet_; }
  const std::vector<Scene>& scenes() const { return scenes_; }
  const ObjectiveOptions& options() const { return options_; }

  // coordinates: parameters × sets. trials: which to evaluate (empty: all). One Residuals a set.
  std::vector<Residuals> evaluate(const std::vector<Parameter>& parameters, const Eigen::MatrixXd& coordinates,
                                  const std::vector<size_t>& trials = {}) const;

  // Standard deviations beside Residuals::mm of a trial.
  Eigen::VectorXd sd_mm(size_t trial) const;
  // Time of each residual, s, in the trial's own clock.
  Eigen::VectorXd time_s(size_t trial) const;
  // Whether residuals of then are left out (ObjectiveOptions::skipped_s).
  bool is_skipped(size_t trial, double time_s) const;

  // Seeks each trial's branch of equilibrium again, at these coordinates: among shapes bent through what was seen and
  // the one in use. True where a trial (of those wanted, empty: all) left its branch for one that lies nearer to the
  // first observation. An optimiser stays on a branch that once was near, also when the parameters have moved away.
  bool rematch(const std::vector<Parameter>& parameters, const Eigen::VectorXd& coordinates,
               const std::vector<size_t>& trials = {});

  // Goes on from the equilibria of another objective over the same trials (of those wanted, empty: all), on another
  // mesh.
  void take_branches_of(const Objective& other, const std::vector<size_t>& trials = {});

  // Start equilibria for the next evaluations.
  void set_start(const std::vector<Eigen::Matrix3Xd>& start);

  // What a finer mesh adds to the residuals, mm, one a trial (empty: nothing). It is added to all later residuals,
  // so that a coarse mesh serves for derivatives and a fine one for what they are derivatives of.
  void set_mesh_correction(std::vector<Eigen::VectorXd> correction) { mesh_correction_ = std::move(correction); }
  const std::vector<Eigen::VectorXd>& mesh_correction() const { return mesh_correction_; }

  // From now on instead of ObjectiveOptions::pull_per_s, one a trial.
  void set_pulls(std::vector<double> per_s) { pulls_per_s_ = std::move(per_s); }
  const std::vector<double>& pulls() const { return pulls_per_s_; }
  // When the pull lets go of moving trials.
  void set_let_go(const cloth::LetGo& let_go) { let_go_ = let_go; }

  // Simulated positions of a trial's samples for one set, for pictures and maps.
  cloth::Trajectory trajectory(const std::vector<Parameter>& parameters, const Eigen::VectorXd& coordinates,
                               size_t trial) const;

  // What is to be simulated for a trial: one prediction for each of `count` sets from `first`.
  std::vector<Prediction> predictions(const std::vector<Parameter>& parameters, const Eigen::MatrixXd& coordinates,
                                      size_t trial, Eigen::Index first, Eigen::Index count) const;

 private:
  // Some sets of one trial, side by side in SIMD lanes.
  struct Group {
    size_t trial = 0;
    Eigen::Index first = 0, count = 0;
  };
  // The trials wanted (empty: all) but those that are left out as a whole.
  std::vector<size_t> simulated_of(const std::vector<size_t>& wanted) const;
  std::vector<Group> groups_of(const std::vector<size_t>& trials, Eigen::Index sets) const;
  // Fills in the residuals of the groups' sets; an empty start shape of a set: its simulation blew up.
  void evaluate_groups(const std::vector<Parameter>& parameters, const Eigen::MatrixXd& coordinates,
                       const std::vector<Group>& groups, std::vector<Residuals>& out) const;
  // Equilibria of the groups' sets, by trial and set; sets alike but for parameters of motion share one.
  std::map<std::pair<size_t, Eigen::Index>, Eigen::Matrix3Xd> shared_rests(const std::vector<Parameter>& parameters,
                                                                           const Eigen::MatrixXd& coordinates,
                                                                           const std::vector<Group>& groups) const;
  void evaluate_on_ranks(const std::vector<Parameter>& parameters, const Eigen::MatrixXd& coordinates,
                         const std::vector<Group>& groups, std::vector<Residuals>& out) const;
  // Sets the scene's start_shape; keeps the present one where there is one and none lies clearly nearer.
  void choose_branch(Scene& scene, const std::vector<Parameter>& parameters, const Eigen::VectorXd& usual) const;
  double distance_at_first_sight_mm(size_t trial, Prediction prediction, const Eigen::Matrix3Xd& rest) const;
  // trial: that of the scene at index, or some times of it.
  Eigen::VectorXd residual_of(size_t index, const ObservedTrial& trial, const Prediction& prediction,
                              const cloth::Trajectory& trajectory) const;

  cloth::Sheet sheet_;
  ObjectiveOptions options_;
  std::vector<Scene> scenes_;
  std::vector<std::vector<cloth::SurfacePoint>> marker_points_;  // a trial, a marker
  std::vector<Eigen::VectorXd> mesh_correction_;
  std::vector<std::shared_ptr<const cloth::GuideTrack>> guide_tracks_;  // a trial; null without markers
  std::vector<double> pulls_per_s_;                                     // a trial
  cloth::LetGo let_go_;
};

// Positions of all vertices between the samples of a trajectory (cubic in time).
Eigen::Matrix3Xd position_at(const cloth::Experiment& experiment, const cloth::Trajectory& trajectory, double t_s);

// Root mean square of the finite residuals of a trial between two times, mm: distance of markers in space
// (three residuals a marker count as one), or of stripe and outline points.
double rms_mm(const ObservedTrial& trial, const Eigen::VectorXd& residual, const Eigen::VectorXd& time_s,
              double from_s = -1e300, double to_s = 1e300);

// 90 % interval of that, with blocks of 1 s as independent draws; nothing where fewer than four blocks were seen.
using Interval = std::pair<double, double>;
std::optional<Interval> rms_interval_mm(const ObservedTrial& trial, const Eigen::VectorXd& residual,
                                        const Eigen::VectorXd& time_s, double from_s = -1e300, double to_s = 1e300);

}  // namespace selvedge::fit
