#include "station/calibration_watch.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "files/whole_file.h"
#include "station/projector_check.h"

namespace selvedge::station {

namespace {

// The tracked corner at a time, between its samples; nullopt where the corner is hidden or outside the recording.
std::optional<Eigen::Vector3d> tracked_at(const std::vector<double>& time_s, const Eigen::Matrix3Xd& corner,
                                          double t_s) {
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

// Longest way of a corner from where it was first seen, m.
double travel_m(const calib::MarkerTrack& track) {
  double longest = 0;
  for (const Eigen::Vector3d& p : track.position) longest = std::max(longest, (p - track.position.front()).norm());
  return longest;
}

// Tracks of the corners that move.
std::vector<calib::MarkerTrack> moving_tracks(const trial::Trial& trial, const WatchOptions& options) {
  std::vector<calib::MarkerTrack> tracks = {track_of(trial.corners, 0), track_of(trial.corners, 1)};
  std::erase_if(tracks, [&](const calib::MarkerTrack& track) { return travel_m(track) < options.least_travel_m; });
  return tracks;
}

// From the stripes about the corners, which show a corner's motion in depth; without stripes from the corners' pixels,
// which the fabric's lag behind the corner draws along. camera: as it stands in that trial.
calib::TimeOffset delay_of(const trial::Trial& trial, const WatchedTrial& watched,
                           const calib::CameraParameters& camera, const WatchOptions& options) {
  const std::vector<calib::MarkerTrack> tracks = moving_tracks(trial, options);
  calib::TimeOffset unknown;
  unknown.why = "the corners hold still";
  if (tracks.empty()) return unknown;
  const auto moves = [&](int corner) {
    return std::any_of(tracks.begin(), tracks.end(), [&](const auto& track) { return track.marker == corner; });
  };
  calib::TimeOffsetOptions o;
  o.tracker_noise_m = trial.mocap_noise_m.value_or(o.tracker_noise_m);
  o.turn_sd_rad = o.shift_sd_m = 0.003;
  if (trial.projector && trial.pattern) {
    calib::TimedLines lines;
    lines.projector = calib::from_projection(*trial.projector);
    lines.rows = trial.pattern->orientation == "horizontal";
    lines.period_px = trial.pattern->period_px;
    for (const SeenCorner& c : watched.corners)
      if (c.seen.line && moves(c.corner)) lines.sightings.push_back({c.time_s, c.corner, *c.seen.line});
    o.common_px = options.line_common_px;
    return calib::estimate_time_offset(camera, tracks, lines, o);
  }
  std::vector<calib::TimedSighting> sightings;
  for (const SeenCorner& c : watched.corners)
    if (c.seen.pixel && moves(c.corner)) sightings.push_back({c.time_s, c.corner, *c.seen.pixel});
  o.pixel_noise_px = options.pixel_noise_px;
  o.common_px = options.pixel_common_px;
  return calib::estimate_time_offset(camera, tracks, sightings, o);
}

WatchedTrial look_at(const trial::Trial& trial, const WatchOptions& options) {
  WatchedTrial watched;
  watched.name = trial.name;
  const bool moves = !moving_tracks(trial, options).empty();
  double next_s = -1e300;
  for (size_t i = 0; i < trial.frames->time_s.size(); ++i) {
    const double t = trial.frames->time_s[i];
    const bool due = t >= next_s;
    if (!due && !moves) continue;
    if (due) next_s = t + 0.999 / options.frame_rate_hz;
    ++watched.frames;
    const TrackedCorners tracked{tracked_at(trial.corners.time_s, trial.corners.left, t),
                                 tracked_at(trial.corners.time_s, trial.corners.right, t)};
    const HeldCorners seen = find_held_corners(trial, trial::read_frame(trial, i), tracked, options.corner);
    for (int side = 0; side < 2; ++side)
      if (seen[side].pixel || seen[side].line) watched.corners.push_back({t, side, *tracked[side], seen[side]});
  }
  return watched;
}

calib::TrialSightings camera_sightings(const trial::Trial& trial, const WatchedTrial& watched) {
  calib::TrialSightings sightings{trial.name, {}, calib::Seen::both, calib::from_projection(*trial.camera)};
  for (const SeenCorner& c : watched.corners)
    if (c.seen.pixel) sightings.sightings.push_back({0, c.corner, 0, c.tracked, *c.seen.pixel});
  return sightings;
}

// From the stripes about the corners. camera: as it stands in that trial.
calib::TrialSightings striped_sightings(const trial::Trial& trial, const WatchedTrial& watched,
                                        const calib::CameraParameters& camera) {
  const bool rows = trial.pattern->orientation == "horizontal";
  calib::TrialSightings sightings{
      trial.name, {}, rows ? calib::Seen::row : calib::Seen::column, calib::from_projection(*trial.projector)};
  for (const SeenCorner& c : watched.corners) {
    if (!c.seen.line) continue;
    Eigen::Vector2d pixel = calib::pixel_of(*sightings.calibrated, c.tracked);
    double& line_px = rows ? pixel.y() : pixel.x();
    const double off_px = c.seen.line->line_at(calib::pixel_of(camera, c.tracked)) - line_px;
    line_px += std::remainder(off_px, trial.pattern->period_px);
    sightings.sightings.push_back({0, c.corner, 0, c.tracked, pixel});
  }
  return sightings;
}

// From the grey code shown before the trial.
calib::TrialSightings coded_sightings(const trial::Trial& trial, const ProjectorCheck& check,
                                      const calib::CameraParameters& camera) {
  calib::TrialSightings sightings{trial.name, {}, calib::Seen::both, calib::from_projection(*trial.projector)};
  for (int side = 0; side < 2; ++side) {
    const auto& corner = check[static_cast<size_t>(side)];
    if (!corner) continue;
    if (const auto pixel = corner->projector_at(calib::pixel_of(camera, corner->tracked)))
      sightings.sightings.push_back({0, side, 0, corner->tracked, *pixel});
  }
  return sightings;
}

// Projector px that a camera px is worth across the stripes, mean over the corners seen.
double lines_per_px(const std::vector<WatchedTrial>& trials) {
  double sum = 0;
  int count = 0;
  for (const WatchedTrial& t : trials)
    for (const SeenCorner& c : t.corners)
      if (c.seen.line) sum += c.seen.line->per_px.norm(), ++count;
  return count > 0 ? sum / count : 1;
}

const calib::TrialDrift* judged(const calib::Drift& drift, const std::string& trial) {
  for (const calib::TrialDrift& d : drift.trials)
    if (d.trial == trial && d.judged) return &d;
  return nullptr;
}

void judge_camera(CalibrationWatch& watch, const std::vector<const trial::Trial*>& trials,
                  const WatchOptions& options) {
  calib::DriftOptions drift;
  drift.tracker_noise_m = trials.front()->mocap_noise_m.value_or(drift.tracker_noise_m);
  drift.pixel_noise_px = options.pixel_noise_px;
  drift.harmless_px = 2 * options.pixel_noise_px;
  drift.least_sightings = options.least_sightings;
  std::vector<calib::TrialSightings> all;
  for (size_t i = 0; i < trials.size(); ++i) all.push_back(camera_sightings(*trials[i], watch.trials[i]));
  watch.camera = calib::check_drift("camera", *all.front().calibrated, all, drift);
}

// The camera that a trial carries, moved to where it was found to stand in it.
calib::CameraParameters camera_in(const trial::Trial& trial, const calib::Drift& drift) {
  const calib::CameraParameters camera = calib::from_projection(*trial.camera);
  const calib::TrialDrift* d = judged(drift, trial.name);
  return d && d->moved ? calib::shifted(camera, d->shift) : camera;
}

void judge_projector(CalibrationWatch& watch, const std::vector<const trial::Trial*>& trials,
                     const WatchOptions& options) {
  std::vector<calib::TrialSightings> coded, striped;
  calib::DriftOptions drift;
  for (size_t i = 0; i < trials.size(); ++i) {
    const trial::Trial& trial = *trials[i];
    if (!trial.projector || !trial.pattern) continue;
    const calib::CameraParameters camera = camera_in(trial, watch.camera);
    striped.push_back(striped_sightings(trial, watch.trials[i], camera));
    drift.repeats_px = trial.pattern->period_px;
    if (const auto check = read_projector_check(trial.folder)) coded.push_back(coded_sightings(trial, *check, camera));
  }
  if (striped.empty()) {
    watch.projector.sentence = "The projector could not be checked: no trial has a projector and stripes.";
    return;
  }
  drift.tracker_noise_m = trials.front()->mocap_noise_m.value_or(drift.tracker_noise_m);
  const bool all_coded = coded.size() == striped.size();
  if (all_coded) {
    drift.repeats_px = 0;
    drift.pixel_noise_px = options.code_noise_px;
    drift.least_sightings = 1;
    drift.independent_share = 1;
  } else {
    drift.pixel_noise_px = options.line_noise_px * lines_per_px(watch.trials);
    drift.least_sightings = options.least_sightings;
  }
  drift.harmless_px = 2 * drift.pixel_noise_px;
  watch.projector = calib::check_drift("projector", *striped.front().calibrated, all_coded ? coded : striped, drift);
}

nlohmann::json to_json(const calib::TimeOffset& delay) {
  if (!delay.known) return {{"known", false}, {"why", delay.why}};
  return {{"known", true}, {"offset_s", delay.offset_s}, {"sd_s", delay.sd_s}, {"rms_px", delay.rms_px}};
}

nlohmann::json to_json(const calib::TrialDrift& d) {
  return {
      {"moved", d.moved}, {"shift_px", d.shift_px}, {"sd_px", d.sd_px}, {"turn_deg", d.turn_deg}, {"rms_px", d.rms_px}};
}

nlohmann::json to_json(const calib::Drift& drift) {
  return {{"sentence", drift.sentence},
          {"moved_since", drift.since ? nlohmann::json(*drift.since) : nlohmann::json(nullptr)}};
}

std::string delay_text(const calib::TimeOffset& delay) {
  if (!delay.known) return "delay not known: " + delay.why;
  return fmt::format("frames late by {:.1f} ± {:.1f} ms", -1e3 * delay.offset_s, 1e3 * delay.sd_s);
}

std::string drift_text(const calib::Drift& drift, const std::string& trial) {
  const calib::TrialDrift* d = judged(drift, trial);
  return d ? fmt::format("{:.2f} ± {:.2f} px{}", d->shift_px, d->sd_px, d->moved ? " MOVED" : "") : "too seldom seen";
}

}  // namespace

CalibrationWatch watch_calibration(const trial::Campaign& campaign, const report::ProgressCallback& progress,
                                   const WatchOptions& options) {
  CalibrationWatch watch;
  std::vector<const trial::Trial*> looked_at;
  for (size_t i = 0; i < campaign.trials.size(); ++i) {
    const trial::Trial& trial = campaign.trials[i];
    progress(static_cast<double>(i) / static_cast<double>(campaign.trials.size()),
             "looking at the held corners of " + trial.name);
    if (!trial.frames || !trial.camera) continue;
    watch.trials.push_back(look_at(trial, options));
    looked_at.push_back(&trial);
  }
  if (looked_at.empty()) {
    watch.camera.sentence = "The camera could not be checked: no trial has images.";
    watch.projector.sentence = "The projector could not be checked: no trial has images.";
    return watch;
  }
  judge_camera(watch, looked_at, options);
  judge_projector(watch, looked_at, options);
  for (size_t i = 0; i < looked_at.size(); ++i)
    watch.trials[i].delay = delay_of(*looked_at[i], watch.trials[i], camera_in(*looked_at[i], watch.camera), options);
  progress(1, "done");
  return watch;
}

void write_watch(const CalibrationWatch& watch, const std::filesystem::path& folder) {
  nlohmann::json trials = nlohmann::json::object();
  for (const WatchedTrial& t : watch.trials) {
    nlohmann::json& one =
        trials[t.name] = {{"frames", t.frames}, {"corners_seen", t.corners.size()}, {"delay", to_json(t.delay)}};
    if (const calib::TrialDrift* d = judged(watch.camera, t.name)) one["camera"] = to_json(*d);
    if (const calib::TrialDrift* d = judged(watch.projector, t.name)) one["projector"] = to_json(*d);
  }
  files::write_json(folder / "calibration-watch.json", {{"format", "calibration-watch/1"},
                                                        {"camera", to_json(watch.camera)},
                                                        {"projector", to_json(watch.projector)},
                                                        {"trials", trials}});
}

std::string to_text(const CalibrationWatch& watch) {
  std::string text = watch.camera.sentence + "\n" + watch.projector.sentence + "\n";
  for (const WatchedTrial& t : watch.trials)
    text += fmt::format("{:<14} camera {}; projector {}; {}\n", t.name, drift_text(watch.camera, t.name),
                        drift_text(watch.projector, t.name), delay_text(t.delay));
  return text;
}

}  // namespace selvedge::station
