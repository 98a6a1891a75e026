// The console's link to a real rig, or a simulated one: listens on the bus, reads the newest frame from the ring, and
// on a person's word arms, stops, records a trial, or answers a prompt.
//
// The rig may come and go, and with it the configuration's port: a session that is started again writes rig.toml anew.
// The file is looked at every second.
#pragma once

#include <filesystem>
#include <memory>

#include <nlohmann/json.hpp>

#include "console/rig_link.h"

namespace selvedge::console {

struct BusRigOptions {
  std::filesystem::path configuration;  // rig.toml; need not be there yet
  std::filesystem::path calibration;    // calibration.json: recording needs it, the view shows it
  std::filesystem::path recordings;     // folder for trials that are recorded here
  double preview_rate_hz = 5;
};

class BusRigLink : public RigLink {
 public:
  explicit BusRigLink(const BusRigOptions& options);
  ~BusRigLink() override;

  nlohmann::json state() override;
  std::optional<Preview> preview(int64_t newer_than) override;
  void watched() override;
  void arm(const std::string& who) override;
  void disarm() override;
  void stop(const std::string& why) override;
  void reset(const std::string& who) override;
  void record(const nlohmann::json& trial) override;
  void stop_recording() override;
  void answer(int64_t prompt_id, const std::string& text) override;
  bool armed_here() const override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace selvedge::console
