#include "station/calibration_watch.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "files/whole_file.h"
#include "fit/silhouette.h"

namespace selvedge::station {

namespace {

constexpr double kEdge_px = 60;        // of the side edge below the corner
constexpr size_t kLeastPoints = 6;     // on it
constexpr double kAcross = 0.7;        // an edge point's normal points so far sideways

struct Line {
  Eigen::Vector2d point, direction;    // direction points up in the image
};

// Principal axis; points further than two pixels from it are left out once.
std::optional<Line> fit_line(std::vector<Eigen::Vector2d> points) {
  Line line;
  for (int round = 0; round < 2; ++round) {
    if (points.size() < kLeastPoints) return std::nullopt;
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    for (const auto& p : points) mean += p / static_cast<double>(points.size());
    Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
    for (const auto& p : points) spread += (p - mean) * (p - mean).transpose();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(spread);
    line = {mean, axes.eigenvectors().col(1)};
    if (line.direction.y() > 0) line.direction = -line.direction;
    const Eigen::Vector2d across = axes.eigenvectors().col(0);
    std::erase_if(points, [&](const auto& p) { return std::abs(across.dot(p - mean)) > 2; });
  }
  return line;
}

bool is_inside(const std::vector<unsigned char>& mask, const trial::GreyImage& image, const Eigen::Vector2d& p) {
  const auto x = static_cast<Eigen::Index>(std::lround(p.x())), y = static_cast<Eigen::Index>(std::lround(p.y()));
  return x >= 0 && y >= 0 && x < image.cols() && y < image.rows() && mask[static_cast<size_t>(y * image.cols() + x)] != 0;
}

// Mean of the tracked samples around a time; nullopt where the corner is hidden or outside the recording.
std::optional<Eigen::Vector3d> tracked_at(const std::vector<double>& time_s, const Eigen::Matrix3Xd& corner, double t_s) {
  const auto after = std::lower_bound(time_s.begin(), time_s.end(), t_s);
  if (after == time_s.begin() || after == time_s.end()) return std::nullopt;
  const auto i = static_cast<Eigen::Index>(after - time_s.begin());
  const double t0 = time_s[static_cast<size_t>(i) - 1], share = (t_s - t0) / (*after - t0);
  const Eigen::Vector3d at = corner.col(i - 1) + share * (corner.col(i) - corner.col(i - 1));
  if (!at.allFinite()) return std::nullopt;
  return at;
}

calib::MarkerTrack track_of(const trial::Corners& corners, int side) {
  calib::MarkerTrack track;
  track.marker = side;
  const Eigen::Matrix3Xd& positions = side == 0 ? corners.left : corners.right;
  for (size_t i = 0; i < corners.time_s.size(); ++i) {
    const Eigen::Vector3d p = positions.col(static_cast<Eigen::Index>(i));
    if (!p.allFinite() || (!track.time_s.empty() && corners.time_s[i] <= track.time_s.back())) continue;
    track.time_s.push_back(corners.time_s[i]);
    track.position.push_back(p);
  }
  return track;
}

calib::TimeOffset delay_of(const trial::Trial& trial, const WatchedTrial& watched, const WatchOptions& options) {
  calib::TimeOffsetOptions o;
  o.pixel_noise_px = options.pixel_noise_px;
  o.tracker_noise_m = trial.mocap_noise_m.value_or(o.tracker_noise_m);
  std::vector<calib::TimedSighting> sightings;
  for (const SeenCorner& c : watched.corners) sightings.push_back({c.time_s, c.corner, c.pixel});
  return calib::estimate_time_offset(calib::from_projection(*trial.camera), {track_of(trial.corners, 0), track_of(trial.corners, 1)}, sightings, o);
}

WatchedTrial look_at(const trial::Trial& trial, calib::TrialSightings& sightings, const WatchOptions& options) {
  WatchedTrial watched;
  watched.name = trial.name;
  double next_s = -1e300;
  for (size_t i = 0; i < trial.frames->time_s.size(); ++i) {
    const double t = trial.frames->time_s[i];
    if (t < next_s) continue;
    next_s = t + 0.999 / options.frame_rate_hz;
    ++watched.frames;
    const trial::GreyImage image = trial::read_frame(trial, i);
    for (int side = 0; side < 2; ++side) {
      const auto at = tracked_at(trial.corners.time_s, side == 0 ? trial.corners.left : trial.corners.right, t);
      if (!at) continue;
      const auto pixel = find_corner(image, geometry::project(*trial.camera, *at), side == 0, options);
      if (!pixel) continue;
      watched.corners.push_back({t, side, *pixel});
      sightings.sightings.push_back({0, side, 0, *at, *pixel});
    }
  }
  return watched;
}

nlohmann::json to_json(const calib::TimeOffset& delay) {
  if (!delay.known) return {{"known", false}, {"why", delay.why}};
  return {{"known", true}, {"offset_s", delay.offset_s}, {"sd_s", delay.sd_s}, {"rms_px", delay.rms_px}};
}

}  // namespace

std::optional<Eigen::Vector2d> find_corner(const trial::GreyImage& image, const Eigen::Vector2d& expected, bool left, const WatchOptions& options) {
  const fit::Background background = fit::measure_background(image);
  const std::vector<unsigned char> mask = fit::silhouette_mask(image, background);
  std::vector<Eigen::Vector2d> edge;
  for (const fit::SilhouettePoint& p : fit::outline_points(image, mask, background, 2, 0.1)) {
    const double out = left ? -p.normal.x() : p.normal.x();
    const Eigen::Vector2d from = p.pixel - expected;
    if (out > kAcross && std::abs(from.x()) < options.reach_px && from.y() > 0 && from.y() < kEdge_px + options.reach_px) edge.push_back(p.pixel);
  }
  if (edge.empty()) return std::nullopt;
  const auto top = std::min_element(edge.begin(), edge.end(), [](const auto& a, const auto& b) { return a.y() < b.y(); })->y();
  std::erase_if(edge, [&](const auto& p) { return p.y() > top + kEdge_px; });
  const std::optional<Line> line = fit_line(edge);
  if (!line) return std::nullopt;
  // Two pixels inside the edge, upwards until the fabric ends.
  const Eigen::Vector2d inwards((left ? 1 : -1) * std::abs(line->direction.y()), 0);
  Eigen::Vector2d p = line->point;
  constexpr double kStep_px = 0.25;
  int outside = 0;
  Eigen::Vector2d last = p;
  for (double s = 0; s < 3 * kEdge_px && outside < 12; s += kStep_px) {
    p = line->point + s * line->direction;
    if (is_inside(mask, image, p + 2 * inwards)) last = p, outside = 0;
    else ++outside;
  }
  if ((last - expected).norm() > options.reach_px) return std::nullopt;
  return last;
}

CalibrationWatch watch_calibration(const trial::Campaign& campaign, const report::ProgressCallback& progress, const WatchOptions& options) {
  CalibrationWatch watch;
  std::vector<calib::TrialSightings> all;
  std::optional<calib::CameraParameters> camera;
  double noise_m = calib::DriftOptions().tracker_noise_m;
  for (size_t i = 0; i < campaign.trials.size(); ++i) {
    const trial::Trial& trial = campaign.trials[i];
    progress(static_cast<double>(i) / static_cast<double>(campaign.trials.size()), "looking at the held corners of " + trial.name);
    if (!trial.frames || !trial.camera) continue;
    if (!camera) camera = calib::from_projection(*trial.camera);
    noise_m = trial.mocap_noise_m.value_or(noise_m);
    calib::TrialSightings sightings;
    sightings.trial = trial.name;
    WatchedTrial watched = look_at(trial, sightings, options);
    watched.delay = delay_of(trial, watched, options);
    all.push_back(std::move(sightings));
    watch.trials.push_back(std::move(watched));
  }
  if (!camera) {
    watch.camera.sentence = "The camera could not be checked: no trial has images.";
    return watch;
  }
  calib::DriftOptions drift;
  drift.tracker_noise_m = noise_m;
  drift.pixel_noise_px = options.pixel_noise_px;
  drift.harmless_px = 2 * options.pixel_noise_px;
  watch.camera = calib::check_drift("camera", *camera, all, drift);
  progress(1, "done");
  return watch;
}

void write_watch(const CalibrationWatch& watch, const std::filesystem::path& folder) {
  nlohmann::json trials = nlohmann::json::object();
  for (const WatchedTrial& t : watch.trials) {
    trials[t.name] = {{"frames", t.frames}, {"corners_seen", t.corners.size()}, {"delay", to_json(t.delay)}};
    for (const calib::TrialDrift& d : watch.camera.trials)
      if (d.trial == t.name && d.judged)
        trials[t.name]["camera"] = {{"moved", d.moved}, {"shift_px", d.shift_px}, {"sd_px", d.sd_px}, {"turn_deg", d.turn_deg}, {"rms_px", d.rms_px}};
  }
  nlohmann::json out = {{"format", "calibration-watch/1"}, {"sentence", watch.camera.sentence}, {"trials", trials}};
  if (watch.camera.since) out["moved_since"] = *watch.camera.since;
  files::write_json(folder / "calibration-watch.json", out);
}

std::string to_text(const CalibrationWatch& watch) {
  std::string text = watch.camera.sentence + "\n";
  for (const WatchedTrial& t : watch.trials)
    text += fmt::format("{:<14} held corners seen {} times in {} frames; {}\n", t.name, t.corners.size(), t.frames,
                        t.delay.known ? fmt::format("frames late by {:.1f} ± {:.1f} ms", -1e3 * t.delay.offset_s, 1e3 * t.delay.sd_s)
                                      : "delay not known: " + t.delay.why);
  return text;
}

}  // namespace selvedge::station
