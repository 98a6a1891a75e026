#include "capture/session/run_trial.h"

#include <cmath>
#include <limits>
#include <memory>
#include <optional>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "capture/recorder.h"
#include "capture/session/arm_lease.h"
#include "capture/session/operator_stop.h"
#include "capture/session/rest.h"
#include "files/durable.h"
#include "files/json_number.h"
#include "rig/arm/daemon.h"
#include "rig/arm/path.h"
#include "rig/clock.h"
#include "rig/clock_message.h"

namespace selvedge::session {

namespace {

constexpr double kFrameWait_s = 0.05;
constexpr double kPatience_s = 20;     // beyond the trial's end, for what was taken before it to arrive
constexpr double kFewestFrames = 0.6;  // of those that the rate promises; fewer spoil the trial
constexpr double kMostOccluded = 0.3;  // of the samples
constexpr double kStatus_s = 0.1;
constexpr double kStartDelay_s = 0.05;  // from the decision to record to the first frame

// A trial that must be recorded again; the text says why.
class AttemptFailed : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

selvedge_rig::operator_prompt_t prompt(const std::string& step, const std::string& text) {
  selvedge_rig::operator_prompt_t message{};
  message.step = step;
  message.text = text;
  return message;
}

struct Rest {
  bool reached = false;
  double waited_s = 0;
};

// Watches corners and frames until both are still.
Rest wait_for_rest(RigClient& rig, const SessionPlan& session, const report::ProgressCallback& progress) {
  RestDetector detector;
  rig.forget_samples();
  rig.skip_to_newest_frame();
  const double from_s = rig::host_now_s();
  while (true) {
    rig.remind();
    require_no_stop(rig);
    const double waited_s = rig::host_now_s() - from_s;
    if (const auto frame = rig.next_frame(kFrameWait_s)) detector.add(*frame);
    for (const auto& sample : rig.take_corners()) detector.add(sample);
    if (detector.at_rest()) return {true, waited_s};
    if (waited_s > session.rest_timeout_s) return {false, waited_s};
    progress(0, fmt::format("waiting for the fabric to hang still ({:.0f} s)", waited_s));
  }
}

trial::Trial description(const SessionPlan& session, const TrialPlan& plan, const RigOptics& optics,
                         const RigClient& rig, bool at_rest) {
  trial::Trial trial;
  trial.name = plan.name;
  trial.experiment = plan.kind;
  trial.fabric = session.fabric;
  trial.starts_at_rest = at_rest;
  trial.gravity_m_s2 = session.gravity_m_s2;
  trial.camera = optics.camera;
  trial.projector = optics.projector;
  trial.pattern = trial::StripePattern{"horizontal", session.stripes.period_px, session.stripes.duty,
                                       session.stripes.first_bright_row_px};
  trial.frame_rate_hz = session.frame_rate_hz;
  trial.exposure_s = session.exposure_s;
  trial.mocap_rate_hz = rig.tracker_rate_hz();
  trial.mocap_noise_m = session.grid.tracker_noise_m;
  trial.noise_grey_levels = session.grey_noise_levels;
  return trial;
}

// The motion of a trial: begins once the lead-in is over, and says when it has ended.
class Motion {
 public:
  virtual ~Motion() = default;
  virtual void begin() = 0;
  virtual bool ended(double since_start_s) = 0;
};

class NoMotion : public Motion {
 public:
  void begin() override {}
  bool ended(double) override { return true; }
};

class WavedByHand : public Motion {
 public:
  WavedByHand(RigClient& rig, const TrialPlan& plan) : rig_(rig), plan_(plan) {}
  void begin() override {
    auto message = prompt("wave_right_corner",
                          fmt::format("wave the right corner by {:.0f} mm, {:.1f} times a second, for {:.0f} s",
                                      1e3 * plan_.amplitude_m, plan_.frequency_hz, duration_s()));
    message.amplitude_m = plan_.amplitude_m;
    message.frequency_hz = plan_.frequency_hz;
    message.duration_s = duration_s();
    rig_.ask(message);
  }
  bool ended(double since_start_s) override {
    rig_.remind();
    return since_start_s > plan_.duration_s - plan_.tail_s;
  }

 private:
  double duration_s() const { return plan_.duration_s - plan_.lead_in_s - plan_.tail_s; }
  RigClient& rig_;
  const TrialPlan& plan_;
};

class MovedByArm : public Motion {
 public:
  MovedByArm(RigClient& rig, const TrialPlan& plan, const Eigen::Isometry3d& world_from_base)
      : lease_(rig, fmt::format("trial {}, armed by whoever started this session", plan.name)) {
    const auto state = rig.arm_state();
    arm::Sinusoid sinusoid;
    sinusoid.direction = world_from_base.linear().transpose() * plan.direction;
    sinusoid.amplitude_m = plan.amplitude_m;
    sinusoid.frequency_hz = plan.frequency_hz;
    sinusoid.duration_s = plan.duration_s - plan.lead_in_s - plan.tail_s;
    sinusoid.ramp_s = plan.ramp_s;
    lease_.prepare(arm::make_sinusoid(Eigen::Vector3d(state->tool_commanded_m), sinusoid));
  }
  void begin() override { lease_.follow(); }
  bool ended(double) override { return !lease_.moving(); }

 private:
  ArmLease lease_;
};

std::unique_ptr<Motion> prepare_motion(RigClient& rig, const TrialPlan& plan,
                                       const std::optional<Eigen::Isometry3d>& world_from_base) {
  if (plan.kind == trial::Experiment::waving) return std::make_unique<WavedByHand>(rig, plan);
  if (plan.kind == trial::Experiment::robot) return std::make_unique<MovedByArm>(rig, plan, *world_from_base);
  return std::make_unique<NoMotion>();
}

// Everything that is stamped within [origin, end] goes to the recorder, in the trial's own time.
class Recording {
 public:
  Recording(RigClient& rig, capture::Recorder& recorder, const std::optional<Eigen::Isometry3d>& world_from_base,
            double origin_s, const std::string& trial, int attempt)
      : rig_(rig), recorder_(recorder), trial_(trial), attempt_(attempt), with_arm_(world_from_base),
        world_from_base_(world_from_base.value_or(Eigen::Isometry3d::Identity())), origin_s_(origin_s),
        lost_before_(rig.frames_lost()) {}

  void take(double end_s) {
    require_no_stop(rig_);
    if (const auto frame = rig_.next_frame(kFrameWait_s)) {
      newest_frame_s_ = frame->mid_exposure_s;
      if (within(frame->mid_exposure_s, end_s)) {
        if (frames_ == 0) first_number_ = frame->number;
        recorder_.add_frame(static_cast<int>(frame->number - first_number_), frame->mid_exposure_s - origin_s_,
                            frame->pixels.data(), rig_.width_px(), rig_.height_px());
        ++frames_;
      }
    }
    for (const auto& sample : rig_.take_corners()) take_corners(sample, end_s);
    for (const auto& state : rig_.take_arm_states())
      if (with_arm_) take_arm(state, end_s);
    if (rig::host_now_s() - told_s_ > kStatus_s) tell();
  }
  // What nobody may lose from now on.
  void tell() {
    told_s_ = rig::host_now_s();
    const capture::Recorded recorded = recorder_.recorded();
    selvedge_rig::session_status_t status{};
    status.step = "recording";
    status.trial = trial_;
    status.frames_written = static_cast<int64_t>(recorded.frames.written);
    status.frames_durable = static_cast<int64_t>(recorded.frames.durable);
    status.frames_lost = frames_lost();
    status.samples_written = static_cast<int64_t>(recorded.corners.written);
    status.samples_durable = static_cast<int64_t>(recorded.corners.durable);
    status.done = -1;
    status.message = fmt::format("attempt {}", attempt_);
    rig_.publish_status(status);
  }
  bool whole(double end_s) const { return newest_frame_s_ > end_s && newest_sample_s_ > end_s; }

  size_t frames() const { return frames_; }
  size_t samples() const { return samples_; }
  int64_t frames_lost() const { return rig_.frames_lost() - lost_before_; }
  double occluded_share() const {
    return samples_ == 0 ? 1 : static_cast<double>(occluded_) / static_cast<double>(samples_);
  }

 private:
  bool within(double host_s, double end_s) const { return host_s >= origin_s_ && host_s <= end_s; }

  void take_corners(const selvedge_rig::corner_sample_t& sample, double end_s) {
    const double host_s = 1e-6 * static_cast<double>(sample.utime);
    newest_sample_s_ = host_s;
    // Strictly rising: a re-estimated clock may step back by less than a sample.
    if (!within(host_s, end_s) || host_s <= last_written_s_) return;
    last_written_s_ = host_s;
    const auto left = marker(sample, "left"), right = marker(sample, "right");
    const Eigen::Vector3d hidden = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
    recorder_.add_corners(host_s - origin_s_, left.value_or(hidden), right.value_or(hidden));
    ++samples_;
    if (!left || !right) ++occluded_;
  }

  void take_arm(const selvedge_rig::arm_status_t& state, double end_s) {
    const double host_s = 1e-6 * static_cast<double>(state.utime);
    if (!within(host_s, end_s) || host_s <= last_arm_s_) return;
    last_arm_s_ = host_s;
    recorder_.add_robot(host_s - origin_s_, world_from_base_ * Eigen::Vector3d(state.tool_commanded_m),
                        world_from_base_ * Eigen::Vector3d(state.tool_m));
  }

  RigClient& rig_;
  capture::Recorder& recorder_;
  const std::string trial_;
  const int attempt_;
  const bool with_arm_;
  const Eigen::Isometry3d world_from_base_;
  const double origin_s_;
  const int64_t lost_before_;
  int64_t first_number_ = 0;
  double newest_frame_s_ = 0, newest_sample_s_ = 0, last_written_s_ = 0, last_arm_s_ = 0, told_s_ = 0;
  size_t frames_ = 0, samples_ = 0, occluded_ = 0;
};

// Lead-in, motion, tail. Returns when everything up to the end has been handed to the recorder.
void record(Recording& recording, Motion& motion, const TrialPlan& plan, double origin_s,
            const report::ProgressCallback& progress) {
  double end_s = std::numeric_limits<double>::infinity();
  bool begun = false;
  while (true) {
    recording.take(end_s);
    const double since_s = rig::host_now_s() - origin_s;
    if (!begun && since_s >= plan.lead_in_s) {
      motion.begin();
      begun = true;
    }
    const bool ended = begun && motion.ended(since_s);
    if (ended && !std::isfinite(end_s) && since_s >= plan.duration_s - plan.tail_s)
      end_s = origin_s + std::max(plan.duration_s, since_s + plan.tail_s);
    if (recording.whole(end_s)) return;
    if (since_s > plan.duration_s + kPatience_s)
      throw AttemptFailed(std::isfinite(end_s) ? "frames or tracker samples stopped coming" : "the motion did not end");
    progress(std::min(1.0, since_s / plan.duration_s), fmt::format("{} frames", recording.frames()));
  }
}

void require_usable(const Recording& recording, const SessionPlan& session, const TrialPlan& plan) {
  const double expected = session.frame_rate_hz * plan.duration_s;
  if (static_cast<double>(recording.frames()) < kFewestFrames * expected)
    throw AttemptFailed(fmt::format("{} frames arrived, expected {:.0f}", recording.frames(), expected));
  if (recording.occluded_share() > kMostOccluded)
    throw AttemptFailed(
        fmt::format("a corner was hidden in {:.0f} % of the samples", 100 * recording.occluded_share()));
}

// "clocks": offset_s is the host's clock less the device's at the trial's origin; the tracker counts frames.
nlohmann::json clocks_json(const RigClient& rig, double origin_s) {
  nlohmann::json clocks = nlohmann::json::object();
  for (const auto& [device, message] : rig.clocks()) {
    const rig::ClockMap map = rig::from_message(message);
    const double device_s = static_cast<double>(map.reference_ticks) / map.ticks_per_s +
                            (origin_s - map.reference_host_s) / (1 + 1e-6 * map.drift_ppm);
    clocks[device] = {{"offset_s", files::finite_or_null(origin_s - device_s)},
                      {"drift_ppm", files::finite_or_null(map.drift_ppm)},
                      {"uncertainty_s", files::finite_or_null(map.uncertainty_s)},
                      {"jumps", map.jumps}};
  }
  return {{"clocks", clocks}};
}

// One attempt. Throws AttemptFailed and ArmStopped where another may do better.
TrialRecord attempt_trial(RigClient& rig, const rig::Configuration& configuration, const SessionPlan& session,
                          const TrialPlan& plan, const RigOptics& optics, const std::filesystem::path& folder,
                          const report::ProgressCallback& progress, const std::function<void()>& at_rest, int attempt) {
  const bool robot = plan.kind == trial::Experiment::robot;
  rig.ask(robot
              ? prompt("robot_path", "put the right corner into the gripper, the left one on its post, and stand back")
              : prompt("hang_still", "hang the fabric by both corners and let it come to rest"));
  rig.show(session.stripes);
  wait_for_rest(rig, session, progress);
  // A fabric that somebody steadies is at rest as long as the hand is there; what counts is the rest after it.
  rig.ask(prompt("stand_back", "let go of the fabric and stand back"));
  const Rest rest = wait_for_rest(rig, session, progress);
  if (!rest.reached)
    spdlog::warn("{}: the fabric still moves after {:.0f} s; the trial starts as it is", plan.name, rest.waited_s);
  if (at_rest) {
    at_rest();
    rig.show(session.stripes);
  }
  std::optional<Eigen::Isometry3d> world_from_base;
  if (robot) world_from_base = arm::read_configuration(configuration.section("arm")).world_from_base;
  const std::unique_ptr<Motion> motion = prepare_motion(rig, plan, world_from_base);

  rig.forget_samples();
  rig.skip_to_newest_frame();
  const double origin_s = rig::host_now_s() + kStartDelay_s;
  capture::Recorder recorder(description(session, plan, optics, rig, rest.reached), folder / plan.name);
  Recording recording(rig, recorder, world_from_base, origin_s, plan.name, attempt);
  try {
    record(recording, *motion, plan, origin_s, progress);
    require_usable(recording, session, plan);
  } catch (const std::runtime_error& error) {
    recorder.finish(error.what(), clocks_json(rig, origin_s));
    throw;
  }
  const trial::State state = recorder.finish("", clocks_json(rig, origin_s));
  recording.tell();
  if (state != trial::State::complete) throw DeviceFailed(fmt::format("{}: {}", plan.name, recorder.failure()));
  return {folder / plan.name,         recording.frames(), recording.samples(), recording.frames_lost(),
          recording.occluded_share(), rest.waited_s,      rest.reached,        1};
}

}  // namespace

void set_trial_aside(const std::filesystem::path& folder, const std::string& name, int attempt) {
  if (!std::filesystem::exists(folder / name)) return;
  std::filesystem::path aside;
  for (int k = attempt; aside.empty() || std::filesystem::exists(aside); ++k)
    aside = folder / fmt::format("{}-spoiled-{}", name, k);
  std::filesystem::rename(folder / name, aside);
  files::sync_folder(folder);
}

TrialRecord run_trial(RigClient& rig, const rig::Configuration& configuration, const SessionPlan& session,
                      const TrialPlan& plan, const RigOptics& optics, const std::filesystem::path& folder,
                      const report::ProgressCallback& progress, const std::function<void()>& at_rest) {
  int spoiled = 0;
  const auto count_spoiled = [&](const std::string& why) {
    if (++spoiled == plan.attempts) throw DeviceFailed(fmt::format("{}: {} ({} attempts)", plan.name, why, spoiled));
  };
  for (int attempt = 1;; ++attempt) {
    wait_for_reset(rig, progress);
    try {
      TrialRecord record = attempt_trial(rig, configuration, session, plan, optics, folder, progress, at_rest, attempt);
      record.attempts = attempt;
      return record;
    } catch (const AttemptFailed& error) {
      spdlog::warn("{}, attempt {}: {}", plan.name, attempt, error.what());
      count_spoiled(error.what());
    } catch (const ArmStopped& error) {
      // A stop that holds is a person's to lift, and no fault of the trial's; any other is tried again as it is.
      spdlog::warn("{}, attempt {}: {}", plan.name, attempt, error.what());
      if (!stop_holds(rig)) count_spoiled(error.what());
    }
    set_trial_aside(folder, plan.name, attempt);
  }
}

}  // namespace selvedge::session
