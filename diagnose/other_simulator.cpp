#include "diagnose/other_simulator.h"

#include <cmath>
#include <functional>

#include "diagnose/weighing.h"
#include "files/bad_input.h"

namespace selvedge::diagnose {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int kLookedThrough = 24;     // cells of the sheet that is put through a simulator's motion
constexpr int kPointsAcross = 9;       // that are looked at where the recording has no markers
constexpr double kReadNoise_m = 1e-4;  // of a motion that no sensor saw
constexpr double kAlike = 1.25;        // parameters within this factor are not called more or less
constexpr double kNothingOf = 0.2;     // a drag of less than this share is none

// Points all over the fabric, at the recording's own times or those of its pictures.
observe::MarkerTrack looked_at(const model::ObservedTrial& trial) {
  observe::MarkerTrack track;
  if (trial.markers) {
    track = *trial.markers;
  } else {
    for (int i = 0; i < kPointsAcross; ++i)
      for (int j = 0; j < kPointsAcross; ++j)
        track.uv.push_back(Eigen::Vector2d(j * trial.width_m, i * trial.height_m) / (kPointsAcross - 1));
    for (const observe::StripeFrame& f : trial.stripes->frames) track.time_s.push_back(f.time_s);
  }
  track.noise_m = kReadNoise_m;
  return track;
}

// What was seen of each trial, replaced by the simulator's own motion of it, from the branch that was recorded.
void put_in_its_place(std::vector<model::ObservedTrial>& trials, const FittedSimulator& other) {
  model::SimulationOptions options;
  options.cells = kLookedThrough;
  options.simulator = other.simulator;
  const model::Simulation theirs(trials, options);
  const std::vector<model::Parameter> parameters = other.simulator->parameters();
  const model::State state = theirs.state_at(parameters, other.coordinates);
  for (size_t t = 0; t < trials.size(); ++t) {
    const model::Prediction prediction = theirs.predictions(state, parameters, other.coordinates, t, 0, 1).front();
    const cloth::Trajectory motion = theirs.trajectory(state, parameters, other.coordinates, t);
    if (!motion.start.allFinite() || motion.samples.empty())
      refuse(other.simulator->name(), "{} diverges at its fitted values: {}; expected positions", trials[t].name,
             other.simulator->last_divergence());
    model::ObservedTrial& trial = trials[t];
    trial.markers = looked_at(trial);
    trial.stripes = nullptr;
    std::vector<cloth::SurfacePoint> points;
    for (const Eigen::Vector2d& uv : trial.markers->uv) points.push_back(surface_point(theirs.sheet(), uv));
    trial.markers->position = model::seen_markers(theirs.sheet(), trial, points, prediction, motion);
  }
}

double rms_mm(const VectorXd& r) { return std::sqrt(3 * r.squaredNorm() / static_cast<double>(r.size())); }

enum class Group { elasticity, damping, drag };

Group group_of(const std::string& parameter) {
  if (parameter.ends_with("_damping")) return Group::damping;
  return parameter.starts_with("drag") ? Group::drag : Group::elasticity;
}

// How much of it the simulator has, beside the fabric: geometric mean over the group's parameters that tell how strong
// it is.
double times_the_fabrics(const std::vector<BehavesAs>& parameters) {
  double sum = 0, count = 0;
  for (const BehavesAs& p : parameters) {
    if (p.name == "drag_fade" || p.name == "drag_tangent" || !(p.simulator > 0) || !(p.fabric > 0)) continue;
    sum += std::log(p.simulator / p.fabric);
    ++count;
  }
  return count > 0 ? std::exp(sum / count) : 1;
}

std::string in_words(Group group, const std::vector<BehavesAs>& parameters) {
  const double times = times_the_fabrics(parameters);
  switch (group) {
    case Group::elasticity: return "elasticity";
    case Group::damping:
      return times > kAlike ? "numerical damping" : times < 1 / kAlike ? "too little damping" : "damping";
    case Group::drag:
      return times < kNothingOf   ? "no drag"
             : times < 1 / kAlike ? "too little drag"
             : times > kAlike     ? "too much drag"
                                  : "drag";
  }
  return "";
}

// A part with the coordinates that it moves.
struct Moved {
  SimulatorPart part;
  std::vector<Index> coordinates;
};

std::vector<Moved> parts_of(const Study& study, const Arm& arm, const VectorXd& theirs, const VectorXd& likeliest) {
  std::vector<Moved> out;
  for (const Group group : {Group::drag, Group::damping, Group::elasticity}) {
    Moved moved;
    for (size_t k = 0; k < study.base_count; ++k) {
      const model::Parameter& p = study.parameters[k];
      if (group_of(p.name) != group) continue;
      const auto at = static_cast<Index>(k);
      moved.coordinates.push_back(at);
      moved.part.parameters.push_back(
          {p.name, p.unit, model::to_value(p, theirs(at)), model::to_value(p, likeliest(at))});
    }
    if (moved.coordinates.empty()) continue;
    moved.part.name = in_words(group, moved.part.parameters);
    out.push_back(std::move(moved));
  }
  for (const size_t e : arm.effects) {
    Moved moved;
    moved.part.name = study.effects[e].name;
    for (size_t k = 0; k < study.effects[e].parameters.size(); ++k)
      moved.coordinates.push_back(static_cast<Index>(study.first_parameter[e] + k));
    out.push_back(std::move(moved));
  }
  return out;
}

}  // namespace

Imitation imitate(const trial::Campaign& campaign, const StudyOptions& recorded, const FittedSimulator& other) {
  StudyOptions options = recorded;
  options.fitted.reset();
  options.base_fit.reset();
  // A simulator is no fabric: nothing of it need be usual.
  options.protocol.usual_within = 1e9;
  options.protocol.least_shear = 1e-9;
  options.protocol.most_shear = 1e9;
  options.seen_instead = [&](std::vector<model::ObservedTrial>& trials) { put_in_its_place(trials, other); };
  FittedStudy fitted = make_study(campaign, {}, options);
  Study& study = fitted.study;
  const Windows windows(*study.simulation, study.protocol);
  WeighingOptions told;
  told.begins = options.progress;
  const Weighing weighing = weigh(study, windows, told);
  return {weighing.none.x.head(static_cast<Index>(study.base_count)), rms_mm(weighing.none.residual)};
}

SimulatorGap simulator_gap(Study& study, const Windows& windows, const Evidence& evidence, const Arm& arm,
                           const VectorXd& likeliest, const Imitation& imitation) {
  SimulatorGap out;
  out.imitated_mm = imitation.left_mm;
  VectorXd theirs = likeliest;
  theirs.head(imitation.base.size()) = imitation.base;
  for (const size_t e : arm.effects)
    for (size_t k = 0; k < study.effects[e].parameters.size(); ++k) {
      const model::Parameter& p = study.effects[e].parameters[k];
      theirs(static_cast<Index>(study.first_parameter[e] + k)) = model::to_coordinate(p, p.start);
    }
  std::vector<Moved> parts = parts_of(study, arm, theirs, likeliest);
  MatrixXd sets = theirs.replicate(1, Index{1} << parts.size());
  for (Index set = 0; set < sets.cols(); ++set)
    for (size_t k = 0; k < parts.size(); ++k)
      if (set >> k & 1)
        for (const Index c : parts[k].coordinates) sets(c, set) = likeliest(c);
  MatrixXd left = simulated(study, windows, arm.branches, sets);
  std::vector<HeldOut> taken;
  for (Index set = 0; set < sets.cols(); ++set) {
    left.col(set) += grid_share(study, sets.col(set)) * arm.grid;
    if (!left.col(set).allFinite()) {
      out.diverged = true;
      return out;
    }
    taken.push_back(left_by(study, windows, evidence, left.col(set)));
  }
  out.before_mm = taken.front().mm();
  out.after_mm = taken.back().mm();
  const std::vector<Share> shares =
      shares_of(taken, noise_of(study, windows, evidence), study.groups.size(), out.unexplained);
  for (size_t k = 0; k < parts.size(); ++k) {
    parts[k].part.share = shares[k];
    parts[k].part.alone_mm = taken[size_t{1} << k].mm();
    out.parts.push_back(std::move(parts[k].part));
  }
  return out;
}

}  // namespace selvedge::diagnose
