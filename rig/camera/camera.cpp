#include "rig/camera/camera.h"

#include <map>

#include "files/bad_input.h"

namespace selvedge::camera {

namespace {

using Opener = std::unique_ptr<Camera> (*)(const CameraConfiguration&);

const std::map<std::string, Opener>& openers() {
  static const std::map<std::string, Opener> table = {{"aravis", open_aravis_camera}, {"v4l2", open_v4l2_camera}};
  return table;
}

}  // namespace

CameraConfiguration read_configuration(rig::Section keys) {
  std::vector<std::string> backends;
  for (const auto& [name, opener] : openers()) backends.push_back(name);
  CameraConfiguration result;
  result.backend = keys.choice("backend", result.backend, backends);
  result.address = keys.text("address", std::nullopt);
  result.rate_hz = keys.number("rate_hz", result.rate_hz, 0.1, 1000, "Hz");
  result.exposure_s = keys.number("exposure_s", result.exposure_s, 1e-6, 10, "s");
  const std::string trigger = keys.choice("trigger", "off", {"off", "software", "hardware"});
  result.trigger = trigger == "off"        ? CameraTrigger::off
                   : trigger == "software" ? CameraTrigger::software
                                           : CameraTrigger::hardware;
  result.packet_size_bytes =
      static_cast<int>(keys.integer("packet_size_bytes", result.packet_size_bytes, 576, 16384, "bytes"));
  result.buffers = static_cast<int>(keys.integer("buffers", result.buffers, 4, 1024, "frames"));
  result.minimum_delay_s = keys.number("minimum_delay_s", result.minimum_delay_s, 0, 1, "s");
  result.minimum_delay_sd_s = keys.number("minimum_delay_sd_s", result.minimum_delay_sd_s, 0, 1, "s");
  result.ptp = keys.flag("ptp", result.ptp);
  if (result.ptp && result.backend != "aravis")
    refuse(keys.where() + " ptp", "found true with backend \"{}\", expected \"aravis\"", result.backend);
  result.ring_frames = static_cast<int>(keys.integer("ring_frames", result.ring_frames, 4, 4096, "frames"));
  result.preview_rate_hz = keys.number("preview_rate_hz", result.preview_rate_hz, 0, 30, "Hz");
  result.preview_width_px = static_cast<int>(keys.integer("preview_width_px", result.preview_width_px, 16, 640, "px"));
  result.lost_after_s = keys.number("lost_after_s", result.lost_after_s, 0.5, 60, "s");
  keys.finish();
  if (result.trigger == CameraTrigger::off && result.exposure_s * result.rate_hz > 1)
    refuse(keys.where() + " exposure_s", "found {} s, expected at most the period of {} Hz", result.exposure_s,
           result.rate_hz);
  return result;
}

std::unique_ptr<Camera> open_camera(const CameraConfiguration& configuration) {
  return openers().at(configuration.backend)(configuration);
}

}  // namespace selvedge::camera
