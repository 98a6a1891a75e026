#include "calib/verdict.h"

#include <algorithm>
#include <cmath>
#include <set>

#include <Eigen/Geometry>
#include <fmt/format.h>

namespace selvedge::calib {

namespace {

Eigen::Isometry3d as_transform(const Eigen::Vector3d& rotation_vector, const Eigen::Vector3d& translation) {
  Eigen::Isometry3d transform = Eigen::Isometry3d::Identity();
  const double angle = rotation_vector.norm();
  if (angle > 0) transform.linear() = Eigen::AngleAxisd(angle, rotation_vector / angle).toRotationMatrix();
  transform.translation() = translation;
  return transform;
}

Eigen::Isometry3d camera_from_world(const CameraParameters& camera) {
  return as_transform(camera.segment<3>(kRotation), camera.segment<3>(kTranslation));
}

double angle_deg(const PoseShift& shift) { return shift.head<3>().norm() * 180 / M_PI; }

// Lowers the verdict, never raises it, and keeps the sentence.
struct Judgement {
  Verdict verdict = Verdict::good;
  std::vector<std::string> happened;  // stands before everything else
  std::vector<std::string> sentences;

  void say(Verdict at_best, const std::string& sentence) {
    verdict = std::max(verdict, at_best);
    sentences.push_back(sentence);
  }
  void tell(Verdict at_best, const std::string& event) {
    verdict = std::max(verdict, at_best);
    happened.push_back(event);
  }
};

void judge_degeneracy(Judgement& judgement, const std::string& name, const DeviceSolution& d) {
  switch (d.degeneracy) {
    case Degeneracy::none: return;
    case Degeneracy::too_few:
      return judgement.say(Verdict::refused,
                           fmt::format("The {} sees {} markers in all poses together; at least 12 are needed, and "
                                       "some 300 for a good calibration.",
                                       name, d.seen().size()));
    case Degeneracy::one_plane:
      return judgement.say(Verdict::refused,
                           fmt::format("All markers that the {} sees lie on one plane (flat grid in one position): "
                                       "depth is missing, and no matrix follows. Fold the grid by 30 degrees or "
                                       "more and record at least 6 poses that fill the fabric's volume.",
                                       name));
    case Degeneracy::inconsistent:
      return judgement.say(Verdict::refused,
                           fmt::format("No projection explains 40 % of the {}'s sightings: check that labels, "
                                       "tracker frame and pixel order (u to the right, v down) belong together.",
                                       name));
    case Degeneracy::one_pose:
      return judgement.say(Verdict::refused,
                           fmt::format("The {} has a single pose: its training residual of {:.2f} px says nothing of "
                                       "the rest of the fabric's volume. Poses are missing: record at least 6 (12 "
                                       "are good), near and far, to every side, tilted.",
                                       name, d.rms_px));
    case Degeneracy::flat_grid:
      return judgement.say(Verdict::refused,
                           fmt::format("The grid is flat in every pose the {} sees: depth within a pose is missing. "
                                       "Fold the grid by 30 degrees or more, or set markers on posts, and record "
                                       "the poses again.",
                                       name));
    case Degeneracy::undetermined:
      return judgement.say(Verdict::refused,
                           fmt::format("The poses leave a direction of the {}'s parameters undetermined (singular "
                                       "value ratio {:.2f}): depth is missing. Record poses nearer and farther.",
                                       name, d.singular_ratio));
  }
}

Eigen::Vector3d board_mean(const DeviceSolution& d, int pose) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double count = 0;
  for (const Sighting& s : d.seen())
    if (s.pose == pose) {
      mean += s.point;
      ++count;
    }
  return mean / std::max(count, 1.0);
}

const PoseEvent* same_event(const DeviceCalibration* other, const PoseEvent& event) {
  if (!other) return nullptr;
  for (const PoseEvent& candidate : other->solution.events)
    if (candidate.knocked == event.knocked && candidate.pose == event.pose) return &candidate;
  return nullptr;
}

// "pose 3", "poses 3 to 7": the first and last of a run.
std::string pose_range(int first, int last) {
  return first == last ? fmt::format("pose {}", first) : fmt::format("poses {} to {}", first, last);
}

void judge_knock(Judgement& judgement, const std::string& who, const DeviceSolution& d, const PoseEvent& event,
                 const std::vector<Eigen::Vector3d>& volume) {
  const std::vector<int> poses = poses_of(d.seen());
  const std::string before = pose_range(poses.front(), pose_before(d, event.pose));
  const Displacement moved = device_displacement(d.refined.camera, event.shift);
  judgement.tell(
      Verdict::doubtful,
      fmt::format("{} moved between poses {} and {}: in {} it was turned by {:.2f} degrees and {:.1f} mm away from "
                  "where it stands now, {:.1f} px at the fabric. The matrix is that of {}; {} lent intrinsics and "
                  "distortion alone. "
                  "Fasten the mount, and record {} again.",
                  who, pose_before(d, event.pose), event.pose, before, moved.angle_deg, moved.distance_mm,
                  shift_at_fabric_px(d.refined.camera, event.shift, volume), pose_range(event.pose, poses.back()),
                  before, before));
}

// Whether a device saw a pose and found nothing wrong with it.
bool fits_pose(const DeviceCalibration* device, int pose) {
  if (!device || !device->solution.solved) return false;
  const auto& events = device->solution.events;
  const std::vector<int> poses = poses_of(device->solution.seen());
  return std::find(poses.begin(), poses.end(), pose) != poses.end() &&
         std::none_of(events.begin(), events.end(), [pose](const PoseEvent& event) { return event.pose == pose; });
}

// A board that moved shows in both devices: where the other one fits, this one was turned.
std::string cause_of(const std::string& name, const DeviceSolution& d, const PoseEvent& event, bool both,
                     bool other_fits) {
  const std::vector<int> poses = poses_of(d.seen());
  const Displacement board = board_displacement(d.refined.camera, event.shift, board_mean(d, event.pose));
  const std::string moved =
      fmt::format("the board moved by {:.1f} mm and {:.2f} degrees between the tracker's look and the images",
                  board.distance_mm, board.angle_deg);
  const bool first = event.pose == poses.front(), last = event.pose == poses.back();
  if (both) return moved;
  if (other_fits)
    return fmt::format("the {} was turned by {:.2f} degrees {}", name, angle_deg(event.shift),
                       first  ? "after it"
                       : last ? "before it, and stands elsewhere since than its matrix says"
                              : "in it alone");
  return fmt::format("{}, or the {} was touched ({:.2f} degrees){}", moved, name, angle_deg(event.shift),
                     first || last ? " and may stand elsewhere since" : "");
}

void judge_left_out_pose(Judgement& judgement, const std::string& name, const DeviceSolution& d, const PoseEvent& event,
                         bool both, bool other_fits) {
  // A device touched in the last pose may no longer stand where its matrix says.
  const bool last = event.pose == poses_of(d.seen()).back();
  judgement.tell(!both && last ? Verdict::doubtful : Verdict::good,
                 fmt::format("Pose {} is left out, for the {} it does not fit the others: {}. {}", event.pose,
                             both ? "camera and the projector" : name, cause_of(name, d, event, both, other_fits),
                             !both && last ? "Fasten the mount, and record the poses again." : "Record it again."));
}

void judge_accuracy(Judgement& judgement, const std::string& name, const DeviceCalibration& device, double good_sd_px,
                    const Options& options) {
  const DeviceSolution& d = device.solution;
  const double sd = device.deviation.mean_sd_px;
  if (!std::isfinite(sd)) {
    judgement.say(Verdict::refused, fmt::format("The fabric's volume is nowhere in the {}'s view: check "
                                                "fabric_volume_m and where the {} points.",
                                                name, name));
    return;
  }
  if (device.deviation.share_in_view < 0.5)
    judgement.say(Verdict::doubtful, fmt::format("Only {:.0f} % of the fabric's volume is in the {}'s view.",
                                                 100 * device.deviation.share_in_view, name));
  if (sd > options.refused_sd_px)
    judgement.say(Verdict::refused, fmt::format("The {}'s matrix is expected to be off by {:.2f} px at the fabric; "
                                                "more poses, farther apart and through the fabric's volume, are "
                                                "missing.",
                                                name, sd));
  else if (sd > good_sd_px)
    judgement.say(Verdict::doubtful, fmt::format("The {}'s matrix is expected to be off by {:.2f} px at the fabric "
                                                 "({:.2f} is good): record more poses.",
                                                 name, sd, good_sd_px));
  if (const size_t poses = poses_of(d.seen()).size(); poses > 1 && poses < 4)
    judgement.say(Verdict::doubtful, fmt::format("The {} has {} poses; 6 are the least from which a bad one can be "
                                                 "told.",
                                                 name, poses_of(d.seen()).size()));
  if (d.leave_one_pose_out_px > options.good_left_out_ratio * d.rms_px)
    judgement.say(Verdict::doubtful,
                  fmt::format("The {} does worse on a pose it has not seen ({:.2f} px) than in training ({:.2f} px), "
                              "worst on pose {}: record more poses like it.",
                              name, d.leave_one_pose_out_px, d.rms_px, d.worst_pose));
}

void judge_rejected(Judgement& judgement, const std::string& name, const DeviceSolution& d, const Options& options) {
  size_t wrong_labels = 0, others = 0;
  for (const RejectedSighting& r : d.rejected) {
    const bool moved = std::any_of(d.events.begin(), d.events.end(),
                                   [&](const PoseEvent& event) { return !event.knocked && event.pose == r.pose; });
    if (moved) continue;
    ++(r.why.find("wrong label") != std::string::npos ? wrong_labels : others);
  }
  if (wrong_labels + others == 0) return;
  const double share = static_cast<double>(wrong_labels + others) / static_cast<double>(d.seen().size());
  std::string text = fmt::format("Rejected: {} of the {}'s {} sightings", wrong_labels + others, name, d.seen().size());
  if (wrong_labels > 0)
    text += fmt::format(", {} of them with the label of another marker; check the labelling", wrong_labels);
  text += ".";
  judgement.say(share > options.many_rejected_share ? Verdict::doubtful : Verdict::good, text);
}

std::string summary(const Calibration& calibration, Verdict verdict) {
  if (verdict == Verdict::refused) return "Do not use this calibration.";
  std::string text =
      fmt::format("Expected error at the fabric: camera {:.3f} px per axis", calibration.camera.deviation.mean_sd_px);
  if (calibration.projector)
    text += fmt::format(", projector {:.3f} px, a triangulated point {:.2f} mm",
                        calibration.projector->deviation.mean_sd_px, calibration.triangulation_sd_mm);
  return text + ".";
}

}  // namespace

Displacement device_displacement(const CameraParameters& camera, const PoseShift& shift) {
  const Eigen::Isometry3d now = camera_from_world(camera);
  const Eigen::Isometry3d before = as_transform(shift.head<3>(), shift.tail<3>()) * now;
  return {angle_deg(shift), 1000 * (before.inverse().translation() - now.inverse().translation()).norm()};
}

double shift_at_fabric_px(const CameraParameters& camera, const PoseShift& shift,
                          const std::vector<Eigen::Vector3d>& volume) {
  double sum = 0;
  for (const Eigen::Vector3d& point : volume) sum += (pixel_of(camera, point, &shift) - pixel_of(camera, point)).norm();
  return sum / static_cast<double>(volume.size());
}

int pose_before(const DeviceSolution& d, int pose) {
  int before = pose;
  for (const int candidate : poses_of(d.seen()))
    if (candidate < pose) before = candidate;
  return before;
}

Displacement board_displacement(const CameraParameters& camera, const PoseShift& shift,
                                const Eigen::Vector3d& board_mean) {
  const Eigen::Vector3d seen = camera_from_world(camera) * board_mean;
  const Eigen::Vector3d moved = as_transform(shift.head<3>(), shift.tail<3>()) * seen;
  return {angle_deg(shift), 1000 * (moved - seen).norm()};
}

void judge(Calibration& calibration) {
  Judgement judgement;
  const auto judge_device = [&](const std::string& name, const DeviceCalibration& device, double good_sd_px) {
    judge_degeneracy(judgement, name, device.solution);
    if (!device.solution.solved) return;
    for (const PoseEvent& event : device.solution.events) {
      const bool is_projector = name == "projector";
      const DeviceCalibration* other = is_projector            ? &calibration.camera
                                       : calibration.projector ? &*calibration.projector
                                                               : nullptr;
      const bool both = !is_projector && same_event(other, event);
      // What both saw was told with the camera.
      if (is_projector && same_event(&calibration.camera, event)) continue;
      if (event.knocked)
        judge_knock(judgement, both ? "Camera and projector both, or the tracker's frame," : "The " + name,
                    device.solution, event,
                    volume_points(calibration.inputs.volume_low, calibration.inputs.volume_high, 3));
      else judge_left_out_pose(judgement, name, device.solution, event, both, fits_pose(other, event.pose));
    }
    judge_accuracy(judgement, name, device, good_sd_px, calibration.options);
    judge_rejected(judgement, name, device.solution, calibration.options);
  };
  judge_device("camera", calibration.camera, calibration.options.good_camera_sd_px);
  if (calibration.projector)
    judge_device("projector", *calibration.projector, calibration.options.good_projector_sd_px);
  else judgement.say(Verdict::doubtful, "No row has a projector pixel: the projector is not calibrated.");
  calibration.verdict = judgement.verdict;
  calibration.advice.clear();
  for (const std::string& event : judgement.happened) calibration.advice += event + " ";
  calibration.advice += summary(calibration, judgement.verdict);
  for (const std::string& sentence : judgement.sentences) calibration.advice += " " + sentence;
}

}  // namespace selvedge::calib
