#include "station/exchange/lcm_export.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <lcm/eventlog.h>
#include <selvedge_rig/arm_status_t.hpp>
#include <selvedge_rig/corner_sample_t.hpp>
#include <selvedge_rig/frame_stamp_t.hpp>
#include <selvedge_rig/projector_command_t.hpp>
#include <selvedge_rig/projector_status_t.hpp>
#include <selvedge_rig/session_status_t.hpp>

#include "capture/trial/trial.h"
#include "files/bad_input.h"
#include "files/part_file.h"
#include "files/whole_file.h"
#include "rig/arm/daemon.h"
#include "rig/channels.h"
#include "rig/configuration.h"

namespace selvedge::station {

namespace {

namespace fs = std::filesystem;

constexpr int64_t kBetweenTrials_us = 1'000'000;

int64_t microseconds(double time_s) { return std::llround(1e6 * time_s); }

struct Event {
  int64_t utime = 0;
  std::string channel;
  std::vector<uint8_t> bytes;
};

// The messages of one trial after the other, in order of their times.
class BusMessages {
 public:
  // Every message of the trial at its recorded time, set off by what went before.
  void add_trial(const trial::Trial& trial, const std::string& name);
  const std::vector<Event>& events() const { return events_; }

 private:
  template <class Message>
  void add(const std::string& channel, double time_s, Message message) {
    pending_.push_back({microseconds(time_s) + offset_us_, channel, {}});
    Event& event = pending_.back();
    message.utime = event.utime;
    message.sequence = 0;  // set once the order is known: the field lies at a fixed place of every message
    event.bytes.resize(static_cast<size_t>(message.getEncodedSize()));
    message.encode(event.bytes.data(), 0, static_cast<int>(event.bytes.size()));
  }
  void add_tracker(const trial::Trial& trial);
  void add_frames(const trial::Trial& trial);
  void add_arm(const trial::Trial& trial);
  void add_pattern(const trial::StripePattern& pattern, const trial::Trial& trial, double time_s);
  void add_status(const trial::Trial& trial, const std::string& name, double first_s, double last_s);
  void settle();

  std::vector<Event> pending_, events_;
  std::map<std::string, int64_t> sequences_;
  int64_t offset_us_ = 0;
};

// 8 bytes of fingerprint, 8 of utime, then the sequence number, most significant byte first.
void set_sequence(std::vector<uint8_t>& bytes, int64_t sequence) {
  for (size_t i = 0; i < 8; ++i) bytes[16 + i] = static_cast<uint8_t>(static_cast<uint64_t>(sequence) >> (56 - 8 * i));
}

void append_marker(selvedge_rig::corner_sample_t& sample, const std::string& name, const Eigen::Vector3d& position_m) {
  sample.name.push_back(name);
  sample.x_m.push_back(position_m.x());
  sample.y_m.push_back(position_m.y());
  sample.z_m.push_back(position_m.z());
  sample.occluded.push_back(position_m.hasNaN());
  ++sample.count;
}

// Corners and dots of one instant are one frame of the motion capture.
void BusMessages::add_tracker(const trial::Trial& trial) {
  std::map<int64_t, std::pair<double, selvedge_rig::corner_sample_t>> samples;
  const auto sample_at = [&](double time_s) -> selvedge_rig::corner_sample_t& {
    auto& [recorded_s, sample] =
        samples.try_emplace(microseconds(time_s), time_s, selvedge_rig::corner_sample_t{}).first->second;
    return sample;
  };
  for (size_t i = 0; i < trial.corners.time_s.size(); ++i) {
    selvedge_rig::corner_sample_t& sample = sample_at(trial.corners.time_s[i]);
    append_marker(sample, "left", trial.corners.left.col(static_cast<Eigen::Index>(i)));
    append_marker(sample, "right", trial.corners.right.col(static_cast<Eigen::Index>(i)));
  }
  if (trial.markers)
    for (size_t i = 0; i < trial.markers->time_s.size(); ++i)
      append_marker(sample_at(trial.markers->time_s[i]), fmt::format("m{}", trial.markers->marker[i]),
                    trial.markers->position.col(static_cast<Eigen::Index>(i)));
  const double first_s = samples.empty() ? 0 : samples.begin()->second.first;
  int64_t last_number = -1;
  for (auto& [utime, entry] : samples) {
    auto& [time_s, sample] = entry;
    // The number that its rate gives the frame, so that a lost one is a step as it was on the bus.
    const int64_t counted = trial.mocap_rate_hz > 0 ? std::llround((time_s - first_s) * trial.mocap_rate_hz) : 0;
    last_number = sample.frame_number = std::max(counted, last_number + 1);
    sample.rate_hz = trial.mocap_rate_hz;
    sample.arrival_utime = utime + offset_us_;
    add(rig::channel("tracker", rig::kCorners), time_s, sample);
  }
}

void BusMessages::add_frames(const trial::Trial& trial) {
  const nlohmann::json about = files::read_json(trial.folder / "trial.json");
  const nlohmann::json uncertainty = about.value("/clocks/camera/uncertainty_s"_json_pointer, nlohmann::json());
  for (size_t i = 0; i < trial.frames->time_s.size(); ++i) {
    selvedge_rig::frame_stamp_t stamp{};
    stamp.frame_number = trial.frames->number[i];
    stamp.arrival_utime = microseconds(trial.frames->time_s[i]) + offset_us_;
    stamp.exposure_s = trial.exposure_s;
    stamp.uncertainty_s = uncertainty.is_number() ? uncertainty.get<double>() : std::numeric_limits<double>::infinity();
    stamp.whole = true;
    add(rig::channel("camera", rig::kStamp), trial.frames->time_s[i], stamp);
  }
}

Eigen::Isometry3d base_from_world(const trial::Trial& trial) {
  const fs::path rig = fs::weakly_canonical(trial.folder).parent_path() / "rig.toml";
  if (!fs::exists(rig)) return Eigen::Isometry3d::Identity();
  const auto configuration = rig::Configuration::load(rig);
  return configuration.has("arm") ? arm::read_configuration(configuration.section("arm")).world_from_base.inverse()
                                  : Eigen::Isometry3d::Identity();
}

void BusMessages::add_arm(const trial::Trial& trial) {
  const trial::Robot& robot = *trial.robot;
  const Eigen::Isometry3d to_base = base_from_world(trial);
  for (Eigen::Index i = 0; i < robot.measured.cols(); ++i) {
    selvedge_rig::arm_status_t state{};
    Eigen::Vector3d::Map(state.tool_m) = to_base * robot.measured.col(i);
    Eigen::Vector3d::Map(state.tool_commanded_m) = to_base * robot.commanded.col(i);
    state.tool_wxyz[0] = 1;
    const bool moves = i > 0 && robot.commanded.col(i) != robot.commanded.col(i - 1);
    state.mode = moves ? selvedge_rig::arm_status_t::MODE_MOVING : selvedge_rig::arm_status_t::MODE_IDLE;
    state.trajectory_s = -1;
    add(rig::channel("arm", rig::kArm), robot.time_s[static_cast<size_t>(i)], state);
  }
}

void BusMessages::add_pattern(const trial::StripePattern& pattern, const trial::Trial& trial, double time_s) {
  selvedge_rig::projector_status_t shown{};
  shown.kind = selvedge_rig::projector_command_t::KIND_STRIPES;
  shown.orientation = pattern.orientation == "horizontal" ? selvedge_rig::projector_command_t::ROWS
                                                          : selvedge_rig::projector_command_t::COLUMNS;
  shown.period_px = pattern.period_px;
  shown.duty = pattern.duty;
  shown.first_bright_px = pattern.first_bright_row_px;
  shown.width_px = trial.projector->width_px;
  shown.height_px = trial.projector->height_px;
  add(rig::channel("projector", rig::kPattern), time_s, shown);
}

void BusMessages::add_status(const trial::Trial& trial, const std::string& name, double first_s, double last_s) {
  selvedge_rig::session_status_t status{};
  status.step = "recording";
  status.trial = name;
  status.done = -1;
  add(rig::kSessionStatus, first_s, status);
  status.step = "done";
  status.frames_written = status.frames_durable = trial.frames ? static_cast<int64_t>(trial.frames->number.size()) : 0;
  status.samples_written = status.samples_durable = static_cast<int64_t>(trial.corners.time_s.size());
  status.message = trial::to_text(trial.state);
  add(rig::kSessionStatus, last_s, status);
}

void BusMessages::add_trial(const trial::Trial& trial, const std::string& name) {
  double first_s = std::numeric_limits<double>::infinity(), last_s = -first_s;
  const auto cover = [&](const std::vector<double>& time_s) {
    if (time_s.empty()) return;
    first_s = std::min(first_s, time_s.front());
    last_s = std::max(last_s, time_s.back());
  };
  cover(trial.corners.time_s);
  if (trial.frames) cover(trial.frames->time_s);
  if (trial.markers) cover(trial.markers->time_s);
  if (trial.robot) cover(trial.robot->time_s);
  if (last_s < first_s) return;      // cut before its first sample
  first_s = std::min(first_s, 0.0);  // the origin is part of it
  offset_us_ = (events_.empty() ? 0 : events_.back().utime + kBetweenTrials_us) - microseconds(first_s);
  if (trial.pattern && trial.projector) add_pattern(*trial.pattern, trial, first_s);
  add_status(trial, name, first_s, last_s);
  add_tracker(trial);
  if (trial.frames) add_frames(trial);
  if (trial.robot) add_arm(trial);
  settle();
}

void BusMessages::settle() {
  std::stable_sort(pending_.begin(), pending_.end(), [](const Event& a, const Event& b) { return a.utime < b.utime; });
  for (Event& event : pending_) {
    set_sequence(event.bytes, ++sequences_[event.channel]);
    events_.push_back(std::move(event));
  }
  pending_.clear();
}

// Named as folders below the source.
std::vector<std::pair<std::string, trial::Trial>> trials_of_source(const fs::path& source) {
  std::vector<std::pair<std::string, trial::Trial>> trials;
  std::vector<fs::path> campaigns;
  if (!fs::exists(source / "campaign.json") && !fs::exists(source / "trial.json") && fs::is_directory(source))
    for (const auto& entry : fs::directory_iterator(source))
      if (fs::exists(entry.path() / "campaign.json")) campaigns.push_back(entry.path());
  std::sort(campaigns.begin(), campaigns.end());
  const bool several = !campaigns.empty();
  if (!several) campaigns = {source};
  for (const fs::path& campaign : campaigns)
    for (trial::Trial& trial : trial::read_campaign(campaign).trials) {
      const std::string name = several ? campaign.filename().string() + "/" + trial.name : trial.name;
      trials.emplace_back(name, std::move(trial));
    }
  return trials;
}

void write_log(const std::vector<Event>& events, const fs::path& path) {
  lcm_eventlog_t* log = lcm_eventlog_create(path.c_str(), "w");
  if (log == nullptr) throw std::runtime_error("LCM: making " + path.string() + " failed");
  bool whole = true;
  for (const Event& event : events) {
    std::string channel = event.channel;
    std::vector<uint8_t> bytes = event.bytes;
    lcm_eventlog_event_t record{0,
                                event.utime,
                                static_cast<int32_t>(channel.size()),
                                static_cast<int32_t>(bytes.size()),
                                channel.data(),
                                bytes.data()};
    whole = whole && lcm_eventlog_write_event(log, &record) == 0;
  }
  whole = std::fflush(log->f) == 0 && whole;
  lcm_eventlog_destroy(log);
  if (!whole) throw std::runtime_error("LCM: writing " + path.string() + " failed");
}

}  // namespace

LcmExported export_lcm(const fs::path& source, const fs::path& path) {
  BusMessages messages;
  const auto trials = trials_of_source(source);
  for (const auto& [name, trial] : trials) messages.add_trial(trial, name);
  const std::vector<Event>& events = messages.events();
  if (events.empty()) refuse(source.string(), "found no recorded sample, expected a trial with some");
  files::write_in_part(path, [&](const fs::path& part) { write_log(events, part); });
  return {static_cast<int>(trials.size()), static_cast<int64_t>(events.size()),
          1e-6 * static_cast<double>(events.back().utime)};
}

}  // namespace selvedge::station
