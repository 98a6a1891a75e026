#include "hardware_sim/simulated_rig.h"

#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "hardware_sim/bank/named_extra.h"
#include "hardware_sim/world/world.h"
#include "rig/arm/model.h"
#include "rig/bus.h"
#include "rig/channels.h"
#include "rig/clock.h"
#include <selvedge_rig/operator_prompt_t.hpp>

namespace selvedge::hardware_sim {

namespace {

void read_devices(rig::Section s, SimulatedRigConfiguration& rig) {
  rig.camera.address = s.text("camera_address", rig.camera.address);
  rig.camera.rate_hz = s.number("camera_rate_hz", rig.camera.rate_hz, 1, 500, "Hz");
  rig.camera.clock_offset_s = s.number("camera_clock_offset_s", 5, -1e6, 1e6, "s");
  rig.camera.clock_drift_ppm = s.number("camera_clock_drift_ppm", 30, -500, 500, "ppm");
  rig.tracker.port = int(s.integer("tracker_port", 801, 0, 65535));
  rig.tracker.rate_hz = s.number("tracker_rate_hz", rig.tracker.rate_hz, 10, 1000, "Hz");
  rig.tracker.noise_m = s.number("tracker_noise_m", rig.tracker.noise_m, 0, 0.1, "m");
  rig.tracker.latency_s = s.number("tracker_latency_s", rig.tracker.latency_s, 0, 1, "s");
  if (s.has("tracker_stated_latency_s"))
    rig.tracker.stated_latency_s = s.number("tracker_stated_latency_s", std::nullopt, 0, 1, "s");
  rig.tracker.occlusions_per_s = s.number("tracker_occlusions_per_s", rig.tracker.occlusions_per_s, 0, 100, "1/s");
  rig.projector_socket = s.text("projector_socket", rig.projector_socket.string());
  rig.flash_table = s.text("flash_table", "");
  rig.arm_model = s.text("arm_model", "");
  rig.arm.port = int(s.integer("arm_port", 30004, 0, 65535));
  rig.arm.script_port = int(s.integer("arm_script_port", rig.arm.script_port, 1, 65535));
  s.finish();
}

Prompt prompt_of(const selvedge_rig::operator_prompt_t& message) {
  return {message.step,         message.index,        message.amplitude_m,
          message.frequency_hz, message.separation_m, message.duration_s};
}

}  // namespace

SimulatedRigConfiguration read_simulated_rig(const std::filesystem::path& path) {
  const auto file = rig::Configuration::load(path, world_sections());
  SimulatedRigConfiguration rig;
  rig.world = read_world(file);
  for (Swatch& swatch : rig.world.swatches) {
    if (swatch.effect.empty()) continue;
    const Extra extra =
        named_extra(swatch.effect, swatch.strength, path.string() + " [swatches." + swatch.name + "] effect");
    swatch.extra = extra.extra;
    swatch.step_share = extra.step_share;
  }
  rig.bus = file.bus();
  read_devices(file.section("devices"), rig);
  rig.camera.width_px = rig.world.camera.width_px;
  rig.camera.height_px = rig.world.camera.height_px;
  rig.camera.seed = rig.tracker.seed = rig.arm.seed = rig.world.seed;
  return rig;
}

// Corners are stamped late by what the tracker keeps to itself: frames then show the fabric before its corners were
// there, by the model's account.
nlohmann::json truth_json(const SimulatedRigConfiguration& c) {
  nlohmann::json truth = truth_json(c.world);
  const double kept_s = c.tracker.stated_latency_s < 0 ? 0 : c.tracker.latency_s - c.tracker.stated_latency_s;
  if (kept_s != 0) truth["hidden"].push_back({{"effect", "camera_delay"}, {"size", {{"delay", -kept_s}}}});
  return truth;
}

// The devices look at the world from their own threads, so it is made first and goes last.
struct SimulatedRig::Devices {
  explicit Devices(const SimulatedRigConfiguration& c)
      : world(c.world, rig::host_now_s()),
        projector(c.projector_socket, projector_options(c), [this](const TriggerEdge& edge) { on_trigger(edge); }),
        bus(c.bus) {
    world.set_pattern_source([this](double t) { return projector.pattern_at(t); });
    if (!c.arm_model.empty()) {
      arm.emplace(c.arm, arm::ArmModel::read(c.arm_model));
      world.set_tool_source([this](double t) { return std::optional(arm->tool_at(t)); });
    }
    tracker.emplace(c.tracker, [this](double t) {
      std::vector<NamedPoint> points;
      for (SeenMarker& marker : world.markers_at(t)) points.push_back({marker.subject, marker.name, marker.position_m});
      return points;
    });
    camera.emplace(c.camera, [this](double t, uint8_t* pixels) { return world.image_at(t, pixels); });
    camera_ready = true;
    bus.subscribe<selvedge_rig::operator_prompt_t>(
        rig::kOperatorPrompt, [this](const selvedge_rig::operator_prompt_t& message) { on_prompt(message); });
    bus.start();
  }
  ~Devices() {
    camera_ready = false;
    world.set_tool_source({});
  }

  static Dlpc350Options projector_options(const SimulatedRigConfiguration& c) {
    Dlpc350Options options;
    if (!c.flash_table.empty()) options.flash = projector::read_flash_table(c.flash_table);
    return options;
  }
  void on_trigger(const TriggerEdge& edge) {
    if (edge.rising && camera_ready) camera->trigger_edge(edge.host_time_s);
  }
  // A prompt is repeated on the bus until it is answered; the person obeys it once.
  void on_prompt(const selvedge_rig::operator_prompt_t& message) {
    if (message.prompt_id == last_prompt) return;
    last_prompt = message.prompt_id;
    world.on_prompt(prompt_of(message), rig::host_now_s());
  }

  World world;
  std::atomic<bool> camera_ready{false};
  Dlpc350Server projector;
  std::optional<RtdeController> arm;
  std::optional<DatastreamServer> tracker;
  std::optional<sim::GigeCamera> camera;
  int64_t last_prompt = -1;
  rig::Bus bus;
};

SimulatedRig::SimulatedRig(const SimulatedRigConfiguration& configuration)
    : devices_(std::make_unique<Devices>(configuration)) {
  description_ = fmt::format(
      "camera     GigE Vision on {}\ntracker    DataStream on 127.0.0.1:{}\nprojector  DLPC350 reports on {}\narm      "
      "  {}",
      configuration.camera.address, devices_->tracker->port(), configuration.projector_socket.string(),
      devices_->arm ? fmt::format("RTDE on 127.0.0.1:{}", devices_->arm->port()) : "none");
}

SimulatedRig::~SimulatedRig() = default;
sim::GigeCamera& SimulatedRig::camera() { return *devices_->camera; }
DatastreamServer& SimulatedRig::tracker() { return *devices_->tracker; }
Dlpc350Server& SimulatedRig::projector() { return devices_->projector; }
RtdeController* SimulatedRig::arm() { return devices_->arm ? &*devices_->arm : nullptr; }

}  // namespace selvedge::hardware_sim
