// A GigE Vision camera on a loopback address, as a client sees one on its network card: GVCP control on UDP
// port 3956 (bootstrap registers, GenICam description, control privilege, heartbeat, time-stamp latch, test
// packets), GVSP stream (leader, payload, trailer, paced at the link's rate) and packet resend.
//
// It exposes freely at its frame rate, on a software trigger, or on an edge of Line0. Pixels come from a
// callback that is told the middle of the exposure. The time stamp is the start of exposure on the camera's
// own clock: device_s = host_s + clock_offset_s + clock_drift_ppm·1e-6·(host_s − host_s at start).
// Under PTP (IEEE 1588; SFNC 2.3 names) it takes the clock of the network's master, where there is one.
// Faults are injected on request: lost packets, stalls, a pulled cable, clock steps.
//
// Source: GigE Vision 1.2 as Aravis 0.8 speaks it. A frame is Mono8; ids are 16-bit, never 0.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "hardware_sim/genicam_camera/sensor.h"

namespace selvedge::sim {

struct GigeCameraOptions {
  std::string address = "127.0.0.1";  // one loopback address a camera
  int width_px = 640;
  int height_px = 480;
  double rate_hz = 30;                        // running free; a client may set it
  double exposure_s = 0.002;                  // a client may set it
  double readout_s = 0.001;                   // between exposure and first packet
  double clock_offset_s = 0;                  // device minus host at start
  double clock_drift_ppm = 0;                 // positive: the device clock is fast
  bool has_ptp = true;                        // false: an older camera, without these features
  std::optional<double> ptp_master_offset_s;  // the master's clock minus the host's; without: no master on the network
  double ptp_settle_s = 0.5;                  // from being switched on until it follows the master
  double link_bits_per_s = 1e9;
  double temperature_degc = 41.5;
  std::string serial = "SIM-0001";
  unsigned seed = 1;  // of the faults
};

struct GigeCameraFaults {
  double stream_loss = 0;        // probability that a stream packet is lost, resent ones too
  double control_loss = 0;       // probability that a command is lost
  double stall_probability = 0;  // of a frame that waits stall_s before it is sent
  double stall_s = 0;
  bool unplugged = false;  // nothing goes in or out
};

struct GigeCameraCounts {
  int64_t frames = 0;            // exposed and sent
  int64_t missed_exposures = 0;  // due or triggered while the camera was busy
  int64_t packets = 0;           // of the stream, without resent ones
  int64_t packets_lost = 0;      // by injection
  int64_t packets_resent = 0;
  int64_t resends_refused = 0;  // asked for what is gone from memory
  int64_t commands = 0;
  int64_t commands_refused = 0;  // malformed, forbidden or out of range
};

class GigeCamera {
 public:
  using ImageSource = sim::ImageSource;

  // Throws BadInput where the address cannot be bound.
  GigeCamera(const GigeCameraOptions& options, ImageSource image_at);
  ~GigeCamera();
  GigeCamera(const GigeCamera&) = delete;
  GigeCamera& operator=(const GigeCamera&) = delete;

  // A rising edge on Line0 at host_s (CLOCK_MONOTONIC). Exposes where TriggerMode is On with source Line0.
  void trigger_edge(double host_s);

  void set_faults(const GigeCameraFaults& faults);
  void step_clock(double by_s);

  bool streaming() const;
  GigeCameraCounts counts() const;
  int64_t device_ticks(double host_s) const;  // nanoseconds of the device clock

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace selvedge::sim
