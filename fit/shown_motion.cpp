#include "fit/shown_motion.h"

#include <algorithm>
#include <limits>

namespace selvedge::fit {

using Eigen::Index;

namespace {

constexpr size_t kMostTimes = 48;

void add(report::Points& points, const Eigen::Vector3d& p) {
  for (const double value : p) points.push_back(static_cast<float>(value));
}

}  // namespace

std::vector<size_t> shown_times(size_t count) {
  std::vector<size_t> out;
  const size_t wanted = std::min(count, kMostTimes);
  for (size_t i = 0; i < wanted; ++i) out.push_back(i * (count - 1) / std::max<size_t>(1, wanted - 1));
  return out;
}

report::Points flat(const Eigen::Matrix3Xd& columns) {
  report::Points out;
  for (Index i = 0; i < columns.cols(); ++i) add(out, columns.col(i));
  return out;
}

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

report::Points surface_at(const observe::StripeTrack& track, const observe::StripeFrame& frame) {
  constexpr size_t kMost = 400;
  const size_t every = 1 + frame.depth.size() / kMost;
  Eigen::Matrix3Xd seen(3, static_cast<Index>((frame.depth.size() + every - 1) / every));
  for (Index i = 0; i < seen.cols(); ++i)
    seen.col(i) = place_of(track.camera, frame.depth[static_cast<size_t>(i) * every]);
  return flat(seen);
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
