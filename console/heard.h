// The newest that the bus says of everything that the console shows, as JSON.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>
#include <selvedge_rig/arm_status_t.hpp>
#include <selvedge_rig/corner_sample_t.hpp>
#include <selvedge_rig/device_status_t.hpp>
#include <selvedge_rig/operator_prompt_t.hpp>
#include <selvedge_rig/projector_status_t.hpp>
#include <selvedge_rig/session_status_t.hpp>

#include "rig/arm/model.h"
#include "rig/bus.h"
#include "rig/configuration.h"

namespace selvedge::console {

class Heard {
 public:
  explicit Heard(const rig::Configuration& configuration);

  // Keys as the page knows them; what was never heard is left out, ages in s.
  nlohmann::json state() const;
  bool stripes_show() const;
  // The arm has said since then (us, host clock) that it is not armed.
  bool disarmed_since(int64_t utime) const;
  rig::Bus& bus() { return bus_; }

 private:
  template <class Message>
  void keep(const std::string& channel, std::optional<Message>& newest);
  nlohmann::json arm_json(const selvedge_rig::arm_status_t& arm) const;

  std::optional<arm::ArmModel> model_;
  Eigen::Isometry3d world_from_base_ = Eigen::Isometry3d::Identity();
  mutable std::mutex mutex_;  // of the messages
  std::map<std::string, std::optional<selvedge_rig::device_status_t>> devices_;
  std::optional<selvedge_rig::corner_sample_t> corners_;
  std::optional<selvedge_rig::arm_status_t> arm_;
  std::optional<selvedge_rig::projector_status_t> pattern_;
  std::optional<selvedge_rig::session_status_t> session_, recording_;
  std::optional<selvedge_rig::operator_prompt_t> prompt_;
  rig::Bus bus_;  // last: its thread fills the rest
};

}  // namespace selvedge::console
