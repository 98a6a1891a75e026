// A USB3 Vision camera on an emulated USB bus (hardware_sim/usb_bus): control channel (GenCP over a pair of bulk
// endpoints, bootstrap registers, manifest with the GenICam description) and stream channel (leader, payload cut as the
// host asked for, trailer). The process must run under umockdev-wrapper; its children see the camera too.
//
// It exposes as genicam_camera/sensor.h says. Frames that the host does not fetch in time wait in a small memory; what
// does not fit there is lost, its id with it. A frame is Mono8; ids have 64 bits and start at 0.
// Faults are injected on request: lost and spoiled frames, a stalled stream, silence, a pulled cable.
//
// Source: USB3 Vision 1.0 and GenCP 1.0 as Aravis 0.8 speaks them.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "hardware_sim/genicam_camera/sensor.h"

namespace selvedge::sim {

struct Usb3CameraOptions {
  int usb_number = 3;  // on the bus; one a camera
  int width_px = 640;
  int height_px = 480;
  double rate_hz = 30;         // running free; a client may set it
  double exposure_s = 0.002;   // a client may set it
  double readout_s = 0.001;    // between exposure and transfer
  double clock_offset_s = 0;   // device minus host at start
  double clock_drift_ppm = 0;  // positive: the device clock is fast
  double link_bytes_per_s = 400e6;
  int memory_frames = 4;  // that wait for the host
  double temperature_degc = 43.5;
  std::string serial = "SIM-0003";
};

struct Usb3CameraCounts {
  int64_t frames = 0;            // exposed
  int64_t missed_exposures = 0;  // due or triggered while the camera was busy
  int64_t frames_lost = 0;       // no room in the camera, nobody listening, or by injection
  int64_t commands = 0;
  int64_t commands_refused = 0;  // malformed, forbidden or out of range
};

class Usb3Camera {
 public:
  // Throws std::runtime_error outside umockdev-wrapper.
  Usb3Camera(const Usb3CameraOptions& options, ImageSource image_at);
  ~Usb3Camera();
  Usb3Camera(const Usb3Camera&) = delete;
  Usb3Camera& operator=(const Usb3Camera&) = delete;

  std::string name() const;  // as Aravis lists and opens it: maker-GUID-serial

  // A rising edge on Line0 at host_s (CLOCK_MONOTONIC).
  void trigger_edge(double host_s);

  void lose_next(int frames);
  void spoil_next(int frames);   // they end early, as on an overrun of the camera's memory
  void halt_stream();            // its endpoint stalls until a client clears it
  void hang(bool hangs = true);  // takes commands and answers none; sends no frame
  void unplug();
  void replug();

  bool streaming() const;
  Usb3CameraCounts counts() const;
  int64_t device_ticks(double host_s) const;  // nanoseconds of the device clock

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace selvedge::sim
