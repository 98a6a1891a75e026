#include "model/observed_trial.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "capture/trial/trial_summary.h"
#include "files/bad_input.h"
#include "geometry/projection.h"
#include "observe/cloud_track.h"

namespace selvedge::model {

namespace {

cloth::Hold hold_of(trial::Held held) {
  switch (held) {
    case trial::Held::corners: return cloth::Hold::corners;
    case trial::Held::top_edge: return cloth::Hold::top_edge;
    case trial::Held::top_edge_clamped: return cloth::Hold::top_edge_clamped;
  }
  return cloth::Hold::corners;
}

// Diagonal of the box that a corner stays in, m: still corners show the tracker's noise alone.
double travel(const Eigen::Matrix3Xd& corner) {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (Eigen::Index i = 0; i < corner.cols(); ++i)
    if (corner.col(i).allFinite()) {
      low = low.cwiseMin(corner.col(i));
      high = high.cwiseMax(corner.col(i));
    }
  return (high - low).norm();
}

}  // namespace

std::vector<double> sample_times(double start_s, double end_s) {
  std::vector<double> times;
  for (int k = 0; start_s + (k - 2) / kSampleRate_hz < end_s; ++k) times.push_back(start_s + k / kSampleRate_hz);
  return times;
}

ObservedTrial observe_trial(const trial::Trial& trial, const observe::ObserveOptions& options) {
  if (trial::is_material_test(trial.experiment))
    refuse(trial.folder.string(), "found a material test, expected a fabric that hangs from a rig");
  for (const auto* corner : {&trial.corners.left, &trial.corners.right})
    if (corner->array().isNaN().all())
      refuse((trial.folder / "corners.csv").string(),
             "found no sample of one of the corners, expected both to be seen");
  ObservedTrial out;
  out.name = trial.name;
  out.kind = trial.experiment;
  out.width_m = trial.fabric.width_m;
  out.height_m = trial.fabric.height_m;
  const double noise = observe::stated_noise_m(trial);
  out.still = trial.starts_at_rest &&
              std::max(travel(trial.corners.left), travel(trial.corners.right)) < std::max(0.004, 12 * noise);

  cloth::Experiment& e = out.experiment;
  e.material.density = trial.fabric.mass_kg / (trial.fabric.width_m * trial.fabric.height_m);
  e.gravity_m_s2 = trial.gravity_m_s2;
  const trial::Corners corners = trial.damaged.empty() ? trial.corners : trial::with_gaps_hidden(trial.corners);
  e.path = cloth::smooth_path(hold_of(trial.held), corners.time_s, corners.left, corners.right, out.still);
  e.path.clamp_direction = trial.clamp_direction.normalized();
  e.starts_at_rest = true;  // a trial that does not start at rest is led in from rest: its transient dies out
  e.start_s = out.recorded_from_s = trial.corners.time_s.front();

  if (trial.camera) out.camera_centre = geometry::centre(*trial.camera);
  if (trial.surface && trial.surface->seen_from_m) out.camera_centre = trial.surface->seen_from_m;
  double last = e.start_s;
  if (trial.markers) {
    out.markers = observe::track_markers(trial, options, out.still);
    last = std::max(last, out.markers->time_s.back());
  }
  if (!trial.markers && (trial.surface || trial.frames)) {
    out.stripes = trial.surface ? observe::track_cloud(trial, options, out.still)
                                : observe::track_stripes(trial, options, out.still);
    last = std::max(last, observe::last_time_s(*out.stripes));
  }
  if (!out.markers && !out.stripes)
    refuse(trial.folder.string(), "found none of markers.csv, surface.csv and frames.csv, expected one of them");
  e.sample_s = out.still ? std::vector<double>{e.start_s} : sample_times(e.start_s, last);
  return out;
}

}  // namespace selvedge::model
