#include "fit/shown_motion.h"

#include <algorithm>
#include <limits>

namespace selvedge::fit {

using Eigen::Index;

namespace {

constexpr int kSheetAcross = 10;  // points of a sheet that is shown, each way
constexpr size_t kMostTimes = 48, kMostPoints = 400;

void add(report::Points& points, const Eigen::Vector3d& p) {
  for (const double value : p) points.push_back(static_cast<float>(value));
}

// The markers at one time: where they were seen, off by `off_mm` (3 a marker and time; empty: not at all).
report::Points markers_at(const observe::MarkerTrack& track, size_t time, const Eigen::VectorXd& off_mm) {
  report::Points out;
  for (size_t k = 0; k < track.uv.size(); ++k) {
    const auto at = static_cast<Index>(k * track.time_s.size() + time);
    Eigen::Vector3d p = track.position.col(at);
    if (off_mm.size() > 0) p += 1e-3 * off_mm.segment<3>(3 * at);
    add(out, p);
  }
  return out;
}

// Points of the surface that one frame or cloud showed.
report::Points surface_at(const observe::StripeTrack& track, const observe::StripeFrame& frame) {
  const size_t every = 1 + frame.depth.size() / kMostPoints;
  report::Points out;
  for (size_t i = 0; i < frame.depth.size(); i += every) add(out, place_of(track.camera, frame.depth[i]));
  return out;
}

}  // namespace

report::Points flat(const Eigen::Matrix3Xd& columns) {
  report::Points out;
  for (Index i = 0; i < columns.cols(); ++i) add(out, columns.col(i));
  return out;
}

RecordedMotion recorded_motion(const model::ObservedTrial& trial) {
  RecordedMotion out;
  out.shown.name = trial.name;
  out.shown.across = kSheetAcross;
  const size_t count = trial.markers ? trial.markers->time_s.size() : trial.stripes->frames.size(),
               wanted = std::min(count, kMostTimes);
  for (size_t i = 0; i < wanted; ++i) {
    const size_t at = i * (count - 1) / std::max<size_t>(1, wanted - 1);
    out.place.push_back(at);
    out.time_s.push_back(trial.markers ? trial.markers->time_s[at] : trial.stripes->frames[at].time_s);
    out.shown.time_s.push_back(static_cast<float>(out.time_s.back()));
    out.shown.seen.push_back(trial.markers ? markers_at(*trial.markers, at, {})
                                           : surface_at(*trial.stripes, trial.stripes->frames[at]));
  }
  return out;
}

std::vector<report::Points> expected_markers(const model::ObservedTrial& trial, const RecordedMotion& recorded,
                                             const Eigen::VectorXd& off_mm) {
  std::vector<report::Points> out;
  if (!trial.markers) return out;
  for (const size_t at : recorded.place) out.push_back(markers_at(*trial.markers, at, off_mm));
  return out;
}

ShownSwatch::ShownSwatch(const model::Simulation& simulation, size_t trial)
    : sample_s_(simulation.trials()[trial].experiment.sample_s) {
  const model::ObservedTrial& seen = simulation.trials()[trial];
  for (int r = 0; r < kSheetAcross; ++r)
    for (int c = 0; c < kSheetAcross; ++c)
      points_.push_back(surface_point(simulation.sheet(),
                                      {seen.width_m * c / (kSheetAcross - 1), seen.height_m * r / (kSheetAcross - 1)}));
}

report::Points ShownSwatch::at(const cloth::Trajectory& run, double time_s) const {
  const auto after = std::lower_bound(sample_s_.begin(), sample_s_.end(), time_s) - sample_s_.begin();
  const size_t at = std::min(static_cast<size_t>(after), run.samples.size() - 1);
  report::Points out;
  for (const cloth::SurfacePoint& p : points_)
    add(out, run.finite ? position_of(p, run.samples[at])
                        : Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()));
  return out;
}

}  // namespace selvedge::fit
