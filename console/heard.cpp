#include "console/heard.h"

#include <selvedge_rig/projector_command_t.hpp>

#include "files/json_number.h"
#include "rig/arm/daemon.h"
#include "rig/channels.h"
#include "rig/clock.h"

namespace selvedge::console {

namespace {

using nlohmann::json;
using selvedge_rig::arm_status_t;
using selvedge_rig::device_status_t;

constexpr double kSilent_s = 3;       // a device that has not spoken for so long is silent
constexpr double kPromptLasts_s = 3;  // a prompt that is not repeated for so long is over

double age_s(int64_t utime) { return rig::host_now_s() - 1e-6 * static_cast<double>(utime); }

const char* device_state(const device_status_t& status) {
  if (age_s(status.utime) > kSilent_s) return "silent";
  switch (status.state) {
    case device_status_t::STARTING: return "starting";
    case device_status_t::RUNNING: return "running";
    case device_status_t::DEGRADED: return "degraded";
    case device_status_t::LOST: return "lost";
    default: return "stopped";
  }
}

const char* mode_text(int8_t mode) {
  switch (mode) {
    case arm_status_t::MODE_IDLE: return "holds still";
    case arm_status_t::MODE_MOVING: return "moves";
    case arm_status_t::MODE_STOPPED: return "stopped";
    default: return "off";
  }
}

json point(const Eigen::Vector3d& p) {
  return {files::finite_or_null(p.x()), files::finite_or_null(p.y()), files::finite_or_null(p.z())};
}

json session_json(const selvedge_rig::session_status_t& s) {
  return {{"step", s.step},
          {"trial", s.trial},
          {"frames", s.frames_written},
          {"frames_durable", s.frames_durable},
          {"lost", s.frames_lost},
          {"samples", s.samples_written},
          {"done", s.done},
          {"message", s.message},
          {"age_s", age_s(s.utime)}};
}

}  // namespace

template <class Message>
void Heard::keep(const std::string& channel, std::optional<Message>& newest) {
  bus_.subscribe<Message>(channel, [this, &newest](const Message& message) {
    const std::lock_guard lock(mutex_);
    newest = message;
  });
}

Heard::Heard(const rig::Configuration& configuration) : bus_(configuration.bus()) {
  if (configuration.has("arm")) {
    const arm::ArmConfiguration arm = arm::read_configuration(configuration.section("arm"));
    world_from_base_ = arm.world_from_base;
    model_ = arm::ArmModel::read(arm.model);
  }
  for (const char* device : {"camera", "tracker", "projector", "arm"})
    if (configuration.has(device)) keep(rig::channel(device, rig::kStatus), devices_[device]);
  keep(rig::channel("tracker", rig::kCorners), corners_);
  keep(rig::channel("arm", rig::kArm), arm_);
  keep(rig::channel("projector", rig::kPattern), pattern_);
  keep(rig::kOperatorPrompt, prompt_);
  bus_.subscribe<selvedge_rig::session_status_t>(rig::kSessionStatus,
                                                 [this](const selvedge_rig::session_status_t& message) {
    const std::lock_guard lock(mutex_);
    (message.step == "recording" ? recording_ : session_) = message;
  });
  bus_.start();
}

bool Heard::stripes_show() const {
  const std::lock_guard lock(mutex_);
  return pattern_ && pattern_->kind == selvedge_rig::projector_command_t::KIND_STRIPES;
}

bool Heard::disarmed_since(int64_t utime) const {
  const std::lock_guard lock(mutex_);
  return arm_ && arm_->utime > utime && !arm_->armed;
}

json Heard::arm_json(const arm_status_t& arm) const {
  json out = {{"mode", mode_text(arm.mode)},
              {"armed", static_cast<bool>(arm.armed)},
              {"latched", static_cast<bool>(arm.latched)},
              {"stop_number", arm.stop_number},
              {"stop", arm.stop_text},
              {"age_s", age_s(arm.utime)},
              {"error_rad", arm.tracking_error_rad},
              {"trajectory_s", arm.trajectory_s},
              {"tool", point(world_from_base_ * Eigen::Vector3d(arm.tool_m))},
              {"links", json::array()}};
  if (model_ && static_cast<int>(arm.q_rad.size()) == model_->joints())
    for (const Eigen::Vector3d& p :
         model_->link_points(Eigen::Map<const Eigen::VectorXd>(arm.q_rad.data(), arm.joints)))
      out["links"].push_back(point(world_from_base_ * p));
  return out;
}

json Heard::state() const {
  const std::lock_guard lock(mutex_);
  json out = {{"devices", json::array()}};
  for (const auto& [name, status] : devices_) {
    json device = {{"name", name}, {"state", "silent"}};
    if (status)
      device = {{"name", name},
                {"state", device_state(*status)},
                {"rate_hz", files::finite_or_null(status->rate_hz)},
                {"delivered", status->delivered},
                {"drops", status->drops},
                {"refused", status->refused},
                {"message", status->message},
                {"age_s", age_s(status->utime)}};
    if (status && status->has_temperature) device["temperature_degc"] = status->temperature_degc;
    out["devices"].push_back(device);
  }
  if (corners_) {
    json markers = json::array();
    for (size_t i = 0; i < corners_->name.size(); ++i) {
      const Eigen::Vector3d p(corners_->x_m[i], corners_->y_m[i], corners_->z_m[i]);
      if (!corners_->occluded[i] && p.allFinite()) markers.push_back({{"name", corners_->name[i]}, {"at", point(p)}});
    }
    out["markers"] = {{"rate_hz", corners_->rate_hz}, {"age_s", age_s(corners_->utime)}, {"seen", markers}};
  }
  if (arm_) out["arm"] = arm_json(*arm_);
  if (pattern_) {
    static const char* const kinds[] = {"off", "solid", "stripes", "Gray code"};
    out["pattern"] = {{"kind", pattern_->kind >= 0 && pattern_->kind < 4 ? kinds[pattern_->kind] : "unknown"},
                      {"period_px", pattern_->period_px}};
  }
  if (session_ && age_s(session_->utime) < 60) out["session"] = session_json(*session_);
  if (recording_ && age_s(recording_->utime) < 10) out["recording"] = session_json(*recording_);
  if (prompt_ && age_s(prompt_->utime) < kPromptLasts_s)
    out["prompt"] = {
        {"id", prompt_->prompt_id}, {"step", prompt_->step}, {"text", prompt_->text}, {"age_s", age_s(prompt_->utime)}};
  return out;
}

}  // namespace selvedge::console
