// A camera of the rig: what every back-end does, and how one is chosen.
//
// Frames are 8-bit grey. A frame's ticks are the start of its exposure on the device's own clock; the daemon maps
// them to the host's. Back-ends: one file each in backends/, named after the configuration key.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>

#include "rig/configuration.h"

namespace selvedge::camera {

enum class CameraTrigger { off, software, hardware };  // off: runs free at rate_hz; hardware: rising edge on Line0

// [camera] of the rig's configuration.
struct CameraConfiguration {
  std::string backend = "aravis";  // or "v4l2"
  std::string address;  // of the device: IPv4 address for GigE Vision, Aravis's name for USB3 Vision, node for V4L2
  double rate_hz = 60;  // running free
  double exposure_s = 0.002;
  CameraTrigger trigger = CameraTrigger::off;
  int packet_size_bytes = 1500;       // GigE Vision: with IP and UDP header; 9000 where the network carries it
  int buffers = 32;                   // frames that may wait in the back-end
  double minimum_delay_s = 0;         // of arrival behind the end of exposure: read-out and transfer
  double minimum_delay_sd_s = 0.002;  // how well that is known; matters where the device's clock cannot be read
  bool ptp = false;                   // the device's clock follows the network's master (IEEE 1588)
  int ring_frames = 64;               // frames in the shared-memory ring
  double preview_rate_hz = 5;         // 0: none
  int preview_width_px = 160;
  double lost_after_s = 2;  // without an answer (or a frame when running free) the device counts as lost
};

// Throws BadInput naming the key; refuses unknown ones.
CameraConfiguration read_configuration(rig::Section keys);

struct CameraInformation {
  std::string description;  // maker, model, serial number
  int width_px = 0, height_px = 0;
  double ticks_per_s = 1e9;  // of the device's clock
  double stamp_sd_s = 0;     // of the frames' ticks as the start of exposure, where the device stamps something else
};

struct CameraFrame {
  int64_t number = 0;               // of the device, widened to 64 bits: a step above 1 is a lost frame
  int64_t ticks = 0;                // start of exposure, device clock
  int64_t arrival_us = 0;           // host clock, when it was whole
  bool whole = false;               // false: pixels are missing
  const uint8_t* pixels = nullptr;  // width_px·height_px, valid during the callback only
};

struct ClockReading {
  int64_t ticks = 0;
  int64_t before_us = 0, after_us = 0;  // host clock around the reading
};

// Thrown when the device stops answering; the daemon opens it anew.
class CameraLost : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class Camera {
 public:
  virtual ~Camera() = default;

  virtual const CameraInformation& information() const = 0;
  virtual void set_exposure(double exposure_s) = 0;
  virtual void set_rate(double rate_hz) = 0;
  virtual void set_trigger(CameraTrigger trigger) = 0;  // only while stopped
  virtual void start() = 0;
  virtual void stop() = 0;

  // Waits up to timeout_s for a frame and hands it to `use`. False: none came. Throws CameraLost.
  virtual bool next_frame(double timeout_s, const std::function<void(const CameraFrame&)>& use) = 0;

  // These may be called while another thread waits in next_frame. Throw CameraLost.
  virtual void software_trigger() = 0;
  virtual bool read_clock(ClockReading& reading) = 0;           // false: this device has no clock to read
  virtual bool read_temperature(double& temperature_degc) = 0;  // false: no sensor
};

// Opens the device and applies the configuration. Throws CameraLost where it does not answer, BadInput where
// the configuration asks for what it cannot do.
std::unique_ptr<Camera> open_camera(const CameraConfiguration& configuration);

// One in each back-end's file.
std::unique_ptr<Camera> open_aravis_camera(const CameraConfiguration& configuration);
std::unique_ptr<Camera> open_v4l2_camera(const CameraConfiguration& configuration);

}  // namespace selvedge::camera
