// One run of `./selvedge prove rig`: a simulated camera and two simulated motion-capture systems on the real wire, the
// daemons that drive them, and how far what the daemons say of time is from what was set.
//
//   camera       GigE Vision, clock off by clock_offset_s and drifting
//   optitrack    NatNet, clock off likewise
//   vicon        DataStream, which has no clock; it states a latency that is delay_s short, so that its samples come
//   out
//                delay_s late
// Four discs move rigidly before the camera; the trackers follow them. The delay is what calib/time_offset.h finds from
// the discs in the frames and the Vicon samples.
#pragma once

namespace selvedge::cli {

struct ClockRunOptions {
  double settle_s = 6;  // before anything counts
  double watch_s = 10;  // that the moving discs are watched
  double clock_offset_s = 5;
  double clock_drift_ppm = 50;  // positive: the device's clock is fast
  double delay_s = 0.0137;
  unsigned seed = 1;
};

struct Found {
  double error_s = 0;
  double sd_s = 0;  // as the daemons state it
  bool covered() const { return error_s <= 2 * sd_s && error_s >= -2 * sd_s; }
};

struct ClockRun {
  Found camera, optitrack, vicon;  // at the run's last moment
  Found camera_by_arrivals;        // the same frames, had the camera's clock not been readable
  Found delay;
  double camera_drift_error_ppm = 0;
};

// Throws std::runtime_error where a device delivers nothing.
ClockRun run_clocks(const ClockRunOptions& options);

}  // namespace selvedge::cli
