// `./selvedge prove calibration`: the solver against made-up rigs whose truth is known.
#include <cmath>
#include <set>

#include <Eigen/Core>
#include <fmt/format.h>

#include "calib/calibration.h"
#include "calib/linear_projection.h"
#include "calib/read_images.h"
#include "hardware_sim/synthetic_grid/synthetic_motion.h"
#include "hardware_sim/synthetic_grid/synthetic_recording.h"
#include "cli/verify/figures.h"
#include "cli/verify/proofs/calibration_peers.h"
#include "cli/verify/proofs/calibration_watch.h"

namespace selvedge::cli {

namespace {

using namespace calib;

const char* const kIssue = "required";
const char* const kPeer = "same sightings, one run";

struct MeanSquare {
  double sum = 0;
  int count = 0;
  void add(double value) {
    sum += value * value;
    ++count;
  }
  double root() const { return std::sqrt(sum / std::max(count, 1)); }
};

struct Device {
  MeanSquare truth, predicted;
};

void push(std::vector<Figure>& figures, const std::string& what, double measured, double reference,
          const std::string& unit, Relation relation, const std::string& source) {
  figures.push_back({what, measured, reference, unit, relation, source});
}

Options without_leave_one_out() {
  Options options;
  options.device.leave_one_pose_out = false;
  return options;
}

CameraParameters linear_start(const std::vector<Sighting>& sightings) {
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector2d> pixels;
  for (const Sighting& s : sightings) {
    points.push_back(s.point);
    pixels.push_back(s.pixel);
  }
  geometry::Projection linear;
  linear.matrix = direct_linear_transform(points, pixels).matrix;
  return from_projection(linear);
}

// Error in truth and predicted deviation over draws of noise and poses, with both peers on the same sightings.
void prove_accuracy(std::vector<Figure>& figures, const FigureOptions& options) {
  const int draws = options.quick ? 10 : 50;
  Device camera, projector;
  MeanSquare opencv_camera, opencv_projector, mrcal_camera, mrcal_projector;
  for (int draw = 0; draw < draws; ++draw) {
    options.progress(0.6 * draw / draws, "draws");
    hardware_sim::SyntheticOptions made;
    made.seed = 1000 * options.seed + static_cast<unsigned>(draw);
    const hardware_sim::SyntheticPoses truth = hardware_sim::make_synthetic_poses(made);
    const Calibration solved = calibrate(truth.poses, without_leave_one_out());
    camera.truth.add(hardware_sim::volume_error_px(solved.camera.projection(), truth.camera, truth.poses));
    camera.predicted.add(solved.camera.deviation.mean_sd_px);
    projector.truth.add(hardware_sim::volume_error_px(solved.projector->projection(), truth.projector, truth.poses));
    projector.predicted.add(solved.projector->deviation.mean_sd_px);
    const auto of_camera = camera_sightings(truth.poses), of_projector = projector_sightings(truth.poses);
    const CameraParameters camera_start = linear_start(of_camera), projector_start = linear_start(of_projector);
    const auto error = [&](const geometry::Projection& p, const geometry::Projection& t) {
      return hardware_sim::volume_error_px(p, t, truth.poses);
    };
    opencv_camera.add(error(solve_with_opencv(of_camera, truth.poses.camera, camera_start), truth.camera));
    opencv_projector.add(
        error(solve_with_opencv(of_projector, truth.poses.projector, projector_start), truth.projector));
    mrcal_camera.add(error(solve_with_mrcal(of_camera, truth.poses.camera, camera_start), truth.camera));
    mrcal_projector.add(error(solve_with_mrcal(of_projector, truth.poses.projector, projector_start), truth.projector));
  }
  const std::string over = " over " + std::to_string(draws) + " draws of 12 poses, per axis";
  push(figures, "camera: error in truth at the fabric" + over, camera.truth.root(), 0.08, "px", Relation::at_most,
       kIssue);
  push(figures, "projector: error in truth at the fabric" + over, projector.truth.root(), 0.15, "px", Relation::at_most,
       kIssue);
  push(figures, "camera: |true / predicted deviation - 1|", std::abs(camera.truth.root() / camera.predicted.root() - 1),
       0.25, "", Relation::at_most, kIssue);
  push(figures, "projector: |true / predicted deviation - 1|",
       std::abs(projector.truth.root() / projector.predicted.root() - 1), 0.25, "", Relation::at_most, kIssue);
  push(figures, "camera: ours beside cv::calibrateCamera", camera.truth.root(), opencv_camera.root(), "px",
       Relation::shown, kPeer);
  push(figures, "camera: ours beside mrcal", camera.truth.root(), mrcal_camera.root(), "px", Relation::shown, kPeer);
  push(figures, "projector: ours beside cv::calibrateCamera", projector.truth.root(), opencv_projector.root(), "px",
       Relation::shown, kPeer);
  push(figures, "projector: ours beside mrcal", projector.truth.root(), mrcal_projector.root(), "px", Relation::shown,
       kPeer);
}

bool mentions(const Calibration& calibration, const std::string& text) {
  return calibration.advice.find(text) != std::string::npos;
}

// 20 % of the labels passed around in every pose.
void prove_wrong_labels(std::vector<Figure>& figures, const FigureOptions& options) {
  int missed = 0, blamed = 0;
  MeanSquare error, peer;
  for (unsigned draw = 0; draw < (options.quick ? 3U : 10U); ++draw) {
    hardware_sim::SyntheticOptions made;
    made.swapped_share = 0.2;
    made.seed = options.seed + 77 + draw;
    const hardware_sim::SyntheticPoses truth = hardware_sim::make_synthetic_poses(made);
    const Calibration solved = calibrate(truth.poses, without_leave_one_out());
    std::set<std::pair<int, int>> rejected;
    for (const RejectedSighting& r : solved.rejected) rejected.emplace(r.pose, r.marker);
    for (const Correspondence& row : truth.poses.rows) {
      if (!row.camera) continue;
      const bool wrong = (geometry::project(truth.camera, row.position) - *row.camera).norm() > 5;
      missed += wrong && !rejected.contains({row.pose, row.marker});
      blamed += !wrong && rejected.contains({row.pose, row.marker});
    }
    error.add(hardware_sim::volume_error_px(solved.camera.projection(), truth.camera, truth.poses));
    const auto sightings = camera_sightings(truth.poses);
    peer.add(hardware_sim::volume_error_px(solve_with_opencv(sightings, truth.poses.camera, linear_start(sightings)),
                                           truth.camera, truth.poses));
  }
  push(figures, "20 % wrong labels: wrong ones kept", missed, 0, "", Relation::at_most, kIssue);
  push(figures, "20 % wrong labels: right ones rejected", blamed, options.quick ? 2 : 5, "", Relation::at_most,
       "chance at 4.5 deviations");
  push(figures, "20 % wrong labels: camera error in truth", error.root(), 0.10, "px", Relation::at_most,
       "1.25 x the clean bound");
  push(figures, "20 % wrong labels: ours beside cv::calibrateCamera", error.root(), peer.root(), "px", Relation::shown,
       kPeer);
}

// Poses and devices that move: found at the right pose, in how many of the draws.
void prove_events(std::vector<Figure>& figures, const FigureOptions& options) {
  const int draws = options.quick ? 3 : 12;
  int knocks = 0, boards = 0, alarms = 0;
  MeanSquare angle_error;
  for (int draw = 0; draw < draws; ++draw) {
    options.progress(0.6 + 0.15 * draw / draws, "moved poses and knocked cameras");
    hardware_sim::SyntheticOptions made;
    made.seed = options.seed + 500 + static_cast<unsigned>(draw);
    const Calibration clean = calibrate(hardware_sim::make_synthetic_poses(made).poses, without_leave_one_out());
    alarms += !clean.camera.solution.events.empty() || !clean.projector->solution.events.empty();
    hardware_sim::SyntheticOptions knocked = made;
    knocked.knocked_pose = 3 + draw % 7;
    const Calibration bumped = calibrate(hardware_sim::make_synthetic_poses(knocked).poses, without_leave_one_out());
    const auto& events = bumped.camera.solution.events;
    const bool named = events.size() == 1 && events[0].knocked && events[0].pose == knocked.knocked_pose;
    knocks += named && bumped.verdict != Verdict::good &&
              mentions(bumped, fmt::format("camera moved between poses {} and {}", knocked.knocked_pose - 1,
                                           knocked.knocked_pose));
    if (named) angle_error.add(events[0].shift.head<3>().norm() * 180 / M_PI - 0.5);
    hardware_sim::SyntheticOptions moved = made;
    moved.moved_pose = draw;
    const Calibration displaced = calibrate(hardware_sim::make_synthetic_poses(moved).poses, without_leave_one_out());
    const auto& board = displaced.camera.solution.events;
    boards += board.size() == 1 && !board[0].knocked && board[0].pose == draw &&
              mentions(displaced, "Pose " + std::to_string(draw));
  }
  push(figures, "camera hardware_sim::turned by 0.5 degrees between poses: named at the right pose",
       1.0 * knocks / draws, 1, "share", Relation::at_least, kIssue);
  push(figures, "the turn found, off by", angle_error.root(), 0.1, "deg", Relation::at_most, "a fifth of it");
  push(figures, "board moved by 4.5 mm in one pose: named", 1.0 * boards / draws, 1, "share", Relation::at_least,
       kIssue);
  push(figures, "nothing moved: false alarms", alarms, 0, "", Relation::at_most, kIssue);
}

// A flat grid in one pose or twelve, and one pose of a folded grid.
void prove_refusals(std::vector<Figure>& figures, const FigureOptions& options) {
  int refused = 0;
  for (const auto& [poses, fold] : {std::pair(1, 0.0), std::pair(12, 0.0), std::pair(1, 0.9)}) {
    hardware_sim::SyntheticOptions made;
    made.seed = options.seed;
    made.poses = poses;
    made.grid.fold_rad = fold;
    const Calibration solved = calibrate(hardware_sim::make_synthetic_poses(made).poses, without_leave_one_out());
    refused += solved.verdict == Verdict::refused && mentions(solved, fold == 0 ? "flat" : "single pose");
  }
  push(figures, "flat grid, flat grid in 12 poses, single pose: refused with what is missing", refused, 3, "",
       Relation::at_least, kIssue);
}

struct ImageRun {
  double camera_px = 0, projector_px = 0;  // of markers, per axis
  double labelled = 0;
  ImageReading reading;
  Calibration calibration;
  hardware_sim::SyntheticPoses truth;
};

ImageRun run_images(const hardware_sim::BoardLook& board, int poses, unsigned seed, const FigureOptions& options,
                    double progress) {
  ImageRun run;
  hardware_sim::SyntheticOptions made;
  made.poses = poses;
  made.seed = seed;
  run.truth = hardware_sim::make_synthetic_poses(made);
  options.progress(progress, "images of " + std::to_string(poses) + " poses");
  const std::vector<PoseImages> images = hardware_sim::record_images(run.truth, made.grid, board);
  run.reading = read_images(images, run.truth.poses);
  run.calibration = calibrate_images(images, run.truth.poses);
  const auto markers = marker_positions(made.grid);
  MeanSquare camera, projector;
  int right = 0;
  for (const Correspondence& row : run.reading.poses.rows) {
    const Eigen::Vector3d point = run.truth.world_from_grid[row.pose] * markers[row.marker];
    if (row.camera) {
      const Eigen::Vector2d off = *row.camera - geometry::project(run.truth.camera, point);
      right += off.norm() < 3;
      camera.add(off.norm() / std::sqrt(2.0));
    }
    if (row.projector)
      projector.add((*row.projector - geometry::project(run.truth.projector, point)).norm() / std::sqrt(2.0));
  }
  run.camera_px = camera.root();
  run.projector_px = projector.root();
  run.labelled = static_cast<double>(right) / static_cast<double>(run.reading.poses.rows.size());
  return run;
}

void prove_images(std::vector<Figure>& figures, const FigureOptions& options) {
  const int poses = options.quick ? 4 : 6;
  const ImageRun sharp = run_images({}, poses, options.seed + 9, options, 0.75);
  push(figures, "images: marker centres, per axis", sharp.camera_px, 0.1, "px", Relation::at_most, kIssue);
  push(figures, "images: projector pixel at the markers, per axis", sharp.projector_px, 0.2, "px", Relation::at_most,
       "the noise assumed above");
  push(figures, "images: markers labelled rightly, no camera known beforehand", sharp.labelled, 1, "share",
       Relation::at_least, kIssue);
  const auto sightings = camera_sightings(sharp.reading.poses);
  const auto error = [&](const geometry::Projection& p) {
    return hardware_sim::volume_error_px(p, sharp.truth.camera, sharp.truth.poses);
  };
  const double ours = error(sharp.calibration.camera.projection());
  const CameraParameters start = linear_start(sightings);
  push(figures, "same images: camera, ours beside cv::calibrateCamera", ours,
       error(solve_with_opencv(sightings, sharp.truth.poses.camera, start)), "px", Relation::shown, kPeer);
  push(figures, "same images: camera, ours beside mrcal", ours,
       error(solve_with_mrcal(sightings, sharp.truth.poses.camera, start)), "px", Relation::shown, kPeer);

  hardware_sim::BoardLook curved;
  curved.gamma = 2.2;
  const ImageRun gamma = run_images(curved, options.quick ? 4 : poses, options.seed + 9, options, 0.8);
  push(figures, "images, gamma 2.2: measured gamma off by", std::abs(gamma.reading.gamma - 2.2), 0.1, "",
       Relation::at_most, kIssue);
  push(figures, "images, gamma 2.2: projector pixel", gamma.projector_px, 0.2, "px", Relation::at_most,
       "as without gamma");

  hardware_sim::BoardLook soft;
  soft.projector_blur_px = 5;
  const ImageRun blurred = run_images(soft, 4, options.seed + 9, options, 0.85);
  push(figures, "projector out of focus by 5 px: blur measured off by", std::abs(blurred.reading.projector_blur_px - 5),
       1, "px", Relation::at_most, kIssue);
  push(figures, "projector out of focus: named, and not called good",
       mentions(blurred.calibration, "out of focus") && blurred.calibration.verdict != Verdict::good, 1, "",
       Relation::at_least, kIssue);
  push(figures, "projector out of focus: projector pixel", blurred.projector_px, 0.2, "px", Relation::at_most,
       "survived");

  hardware_sim::BoardLook bright;
  bright.exposure = 1.9;
  const ImageRun clipped = run_images(bright, 4, options.seed + 9, options, 0.9);
  push(figures, "clipped highlights: named, and not called good",
       mentions(clipped.calibration, "lipped") && clipped.calibration.verdict != Verdict::good, 1, "",
       Relation::at_least, kIssue);
}

void prove_delay(std::vector<Figure>& figures, const FigureOptions& options) {
  const hardware_sim::SyntheticPoses truth = hardware_sim::make_synthetic_poses({});
  const CameraParameters camera = from_projection(truth.camera);
  const Eigen::Vector3d middle = (truth.poses.volume_low + truth.poses.volume_high) / 2;
  MeanSquare error, predicted, without, with, gentle_error, gentle_predicted;
  int refused = 0;
  const int draws = options.quick ? 4 : 8;
  for (int draw = 0; draw < draws; ++draw) {
    options.progress(0.92 + 0.08 * draw / draws, "delay");
    hardware_sim::MotionOptions motion;
    motion.seed = options.seed + static_cast<unsigned>(draw);
    const hardware_sim::SyntheticMotion moving = hardware_sim::make_synthetic_motion(truth.camera, middle, motion);
    const TimeOffset offset = estimate_time_offset(camera, moving.tracks, moving.sightings);
    error.add(1e3 * (offset.offset_s - motion.offset_s));
    predicted.add(1e3 * offset.sd_s);
    with.add(offset.rms_px);
    without.add(offset.rms_without_px);
    motion.amplitude_m = 0.02;
    motion.frequency_hz = 0.5;
    const hardware_sim::SyntheticMotion gentle = hardware_sim::make_synthetic_motion(truth.camera, middle, motion);
    const TimeOffset uncertain = estimate_time_offset(camera, gentle.tracks, gentle.sightings);
    gentle_error.add(1e3 * (uncertain.offset_s - motion.offset_s));
    gentle_predicted.add(1e3 * uncertain.sd_s);
    motion.amplitude_m = 0.001;
    const hardware_sim::SyntheticMotion still = hardware_sim::make_synthetic_motion(truth.camera, middle, motion);
    refused += !estimate_time_offset(camera, still.tracks, still.sightings).known;
  }
  const std::string over = std::to_string(draws) + " draws";
  push(figures, "camera 13.7 ms late, markers move 120 mm at 1.2 Hz for 6 s: delay off by", error.root(), 0.03, "ms",
       Relation::at_most, "trial run: 0.011");
  push(figures, "delay: predicted deviation", predicted.root(), 0.03, "ms", Relation::at_most, over);
  push(figures, "delay: true / predicted deviation", error.root() / predicted.root(), 1, "", Relation::shown, over);
  push(figures, "delay: residual with, beside without", with.root(), without.root(), "px", Relation::shown,
       "trial run: 0.48 and 9.0");
  push(figures, "delay from 20 mm at 0.5 Hz: off by", gentle_error.root(), 1, "ms", Relation::at_most, over);
  push(figures, "delay from 20 mm at 0.5 Hz: true / predicted deviation", gentle_error.root() / gentle_predicted.root(),
       2, "", Relation::at_most, over);
  push(figures, "delay from 1 mm at 0.5 Hz: refused", 1.0 * refused / draws, 1, "share", Relation::at_least, kIssue);
}

}  // namespace

std::vector<Figure> prove_calibration(const FigureOptions& options) {
  std::vector<Figure> figures;
  prove_accuracy(figures, options);
  prove_wrong_labels(figures, options);
  prove_events(figures, options);
  prove_refusals(figures, options);
  prove_images(figures, options);
  prove_delay(figures, options);
  const std::vector<Figure> watch = prove_calibration_watch(options);
  figures.insert(figures.end(), watch.begin(), watch.end());
  return figures;
}

}  // namespace selvedge::cli
