#include "station/calibrating.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "calib/calibration_file.h"
#include "calib/calibration_report.h"
#include "calib/read_images.h"
#include "capture/session/operator_stop.h"
#include "files/bad_input.h"
#include "rig/clock.h"
#include "station/pattern_images.h"

namespace selvedge::station {

namespace {

using session::DeviceFailed;
using session::RigClient;

constexpr double kStill_s = 0.4;           // the grid must stand still for so long
constexpr double kStillTravel_m = 0.0008;  // between the two halves of that time, mean over the markers
constexpr double kOtherPose_m = 0.02;      // a new pose is at least so far from the one before
constexpr double kMoved_m = 0.002;         // a grid that moved more than this meanwhile spoils its pose
constexpr double kLeastSeen = 0.7;         // of the grid's markers
constexpr int kAttempts = 3;

using MarkerMeans = std::map<int, Eigen::Vector3d>;  // marker number: position

std::string marker_name(const session::GridPlan& grid, int number) {
  return fmt::format("g{}_{}", number / grid.columns, number % grid.columns);
}

// Means over the samples of a span of time; markers seen in less than half of them are left out.
MarkerMeans means(const std::vector<selvedge_rig::corner_sample_t>& samples, size_t from, size_t to,
                  const session::GridPlan& grid) {
  MarkerMeans result;
  for (int number = 0; number < grid.columns * grid.rows; ++number) {
    const std::string name = marker_name(grid, number);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    size_t seen = 0;
    for (size_t i = from; i < to; ++i)
      if (const auto position = session::marker(samples[i], name)) sum += *position, ++seen;
    if (2 * seen > to - from) result[number] = sum / static_cast<double>(seen);
  }
  return result;
}

// Mean distance of the markers that both have; infinite where there are none.
double distance_m(const MarkerMeans& a, const MarkerMeans& b) {
  double sum = 0;
  size_t both = 0;
  for (const auto& [number, position] : a)
    if (const auto other = b.find(number); other != b.end()) sum += (position - other->second).norm(), ++both;
  return both == 0 ? INFINITY : sum / static_cast<double>(both);
}

// Markers of a grid that stands still now; empty where it moves or is not there.
MarkerMeans still_now(const std::vector<selvedge_rig::corner_sample_t>& recent, const session::GridPlan& grid) {
  if (recent.size() < 10 || recent.back().utime - recent.front().utime < static_cast<int64_t>(0.8 * kStill_s * 1e6))
    return {};
  const size_t half = recent.size() / 2;
  const MarkerMeans first = means(recent, 0, half, grid), second = means(recent, half, recent.size(), grid);
  if (static_cast<double>(second.size()) < kLeastSeen * grid.columns * grid.rows ||
      distance_m(first, second) > kStillTravel_m)
    return {};
  return means(recent, 0, recent.size(), grid);
}

MarkerMeans wait_for_grid(RigClient& rig, const session::SessionPlan& plan, const MarkerMeans& pose_before) {
  rig.forget_samples();
  std::vector<selvedge_rig::corner_sample_t> recent;
  const double until_s = rig::host_now_s() + plan.answer_timeout_s;
  while (rig::host_now_s() < until_s) {
    rig.remind();
    session::require_no_stop(rig);
    rig.corners_after(rig::host_now_s() + 0.05, plan.answer_timeout_s);
    for (auto& sample : rig.take_corners()) recent.push_back(std::move(sample));
    const auto oldest = recent.empty() ? 0 : recent.back().utime - static_cast<int64_t>(kStill_s * 1e6);
    std::erase_if(recent, [oldest](const auto& sample) { return sample.utime < oldest; });
    MarkerMeans markers = still_now(recent, plan.grid);
    if (!markers.empty() && distance_m(markers, pose_before) > kOtherPose_m) return markers;
  }
  throw DeviceFailed(
      fmt::format("tracker: no grid that stands still in a new pose within {:.0f} s; at least {:.0f} % of its {} "
                  "markers must be seen",
                  plan.answer_timeout_s, 100 * kLeastSeen, plan.grid.columns * plan.grid.rows));
}

struct Capture {
  RigClient& rig;
  const session::SessionPlan& plan;
  std::vector<calib::PatternStep> sequence;
  const report::ProgressCallback& progress;
  MarkerMeans last_pose;
};

// One pose, or nothing where the grid moved meanwhile.
std::optional<calib::PoseImages> capture_pose(Capture& capture, int pose) {
  selvedge_rig::operator_prompt_t prompt{};
  prompt.step = "show_grid_pose";
  prompt.index = pose;
  prompt.text =
      fmt::format("hold the marker grid in pose {} of {} and let go of it", pose + 1, capture.plan.grid.poses);
  capture.rig.ask(prompt);
  const MarkerMeans markers = wait_for_grid(capture.rig, capture.plan, capture.last_pose);
  calib::PoseImages images;
  images.pose = pose;
  for (const auto& [number, position] : markers) images.markers.push_back({number, position});
  capture.rig.skip_to_newest_frame();
  images.marker_image = image_under(capture.rig, {});
  for (size_t k = 0; k < capture.sequence.size(); ++k) {
    images.sequence.push_back({capture.sequence[k], image_under(capture.rig, to_pattern(capture.sequence[k]))});
    const double within = static_cast<double>(k + 1) / static_cast<double>(capture.sequence.size());
    capture.progress((pose + within) / capture.plan.grid.poses,
                     fmt::format("grid pose {} of {}", pose + 1, capture.plan.grid.poses));
  }
  const double moved_m = distance_m(wait_for_grid(capture.rig, capture.plan, {}), markers);
  if (moved_m > kMoved_m) {
    spdlog::warn("grid pose {}: the grid moved by {:.1f} mm meanwhile, once more", pose + 1, 1e3 * moved_m);
    return std::nullopt;
  }
  capture.last_pose = markers;
  return images;
}

calib::Poses header(RigClient& rig, const session::SessionPlan& plan) {
  calib::Poses poses;
  poses.camera = {rig.width_px(), rig.height_px()};
  poses.projector = {rig.projector_width_px(), rig.projector_height_px()};
  poses.tracker_noise_m = plan.grid.tracker_noise_m;
  poses.volume_low = plan.grid.volume_low_m;
  poses.volume_high = plan.grid.volume_high_m;
  return poses;
}

}  // namespace

calib::Calibration calibrate_rig(RigClient& rig, const session::SessionPlan& plan, const std::filesystem::path& folder,
                                 const report::ProgressCallback& progress) {
  std::filesystem::create_directories(folder);
  const calib::Poses description = header(rig, plan);
  Capture capture{rig, plan, calib::grey_code_sequence(description.projector), progress, {}};
  std::vector<calib::PoseImages> poses;
  for (int pose = 0; pose < plan.grid.poses; ++pose) {
    std::optional<calib::PoseImages> images;
    for (int attempt = 0; attempt < kAttempts && !images;) {
      session::wait_for_reset(rig, progress);
      try {
        ++attempt;
        images = capture_pose(capture, pose);
      } catch (const session::ArmStopped& stopped) {
        spdlog::warn("grid pose {}: {}", pose + 1, stopped.what());
        --attempt;  // a person's stop, and no fault of the pose's
      }
    }
    if (!images)
      throw DeviceFailed(
          fmt::format("tracker: the grid moved {} times while pose {} was recorded", kAttempts, pose + 1));
    poses.push_back(std::move(*images));
  }
  progress(1, "solving camera and projector");
  calib::Calibration calibration = calib::calibrate_images(poses, description);
  calib::write_poses(calibration.inputs, folder);
  calib::write_calibration(calibration, folder / "calibration.json");
  calib::write_report(calibration, folder / "report.html");
  return calibration;
}

}  // namespace selvedge::station
