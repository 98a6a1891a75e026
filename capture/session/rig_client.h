// What a capture session sees of the rig: the newest state of every device, frames from the ring, and orders out.
//
// All times are host seconds (CLOCK_MONOTONIC, rig/clock.h). Every wait has a limit; when it runs out the
// error names the device, what was waited for and what the device said last.
// The devices are the sections camera, tracker, projector and (where there is one) arm of the configuration.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <selvedge_rig/arm_status_t.hpp>
#include <selvedge_rig/clock_map_t.hpp>
#include <selvedge_rig/corner_sample_t.hpp>
#include <selvedge_rig/device_status_t.hpp>
#include <selvedge_rig/operator_answer_t.hpp>
#include <selvedge_rig/operator_prompt_t.hpp>
#include <selvedge_rig/projector_status_t.hpp>
#include <selvedge_rig/session_status_t.hpp>

#include "rig/bus.h"
#include "rig/camera/frame_ring.h"
#include "rig/configuration.h"
#include "rig/projector/pattern.h"

namespace selvedge::session {

// A device kept the session waiting for too long, or refused what it was asked.
class DeviceFailed : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct Frame {
  int64_t number = 0;  // of the camera; a step above 1 is a lost frame
  double mid_exposure_s = 0;
  double exposure_s = 0;
  double uncertainty_s = 0;     // of mid_exposure_s, one standard deviation
  std::vector<uint8_t> pixels;  // row major, width_px · height_px of the client
};

class RigClient {
 public:
  explicit RigClient(const rig::Configuration& configuration);
  ~RigClient();

  bool has_arm() const { return has_arm_; }
  // Where the arm's daemon takes its control (rig/arm/control_link.h); "" without an arm.
  const std::filesystem::path& arm_socket() const { return arm_socket_; }
  rig::Bus& bus() { return *bus_; }

  // Until every device delivers and the camera's clock is known. waiting: told what is still missing.
  void wait_until_running(double timeout_s, const std::function<void(const std::string&)>& waiting);

  // Whole frames in order, those with an unknown time left out. none after timeout_s.
  std::optional<Frame> next_frame(double timeout_s);
  // Forgets the frames that wait in the ring.
  void skip_to_newest_frame();
  // The first frame whose exposure began at or after host_s.
  Frame first_frame_after(double host_s, double timeout_s);
  int width_px() const { return width_px_; }
  int height_px() const { return height_px_; }
  // Frames that this client was too slow for, plus steps in the camera's numbers.
  int64_t frames_lost() const { return frames_lost_; }

  // Tracker samples and arm states in order of arrival, each handed out once; what came before the last
  // call of forget_samples() is dropped. At most the newest 20 s are kept.
  void forget_samples();
  std::vector<selvedge_rig::corner_sample_t> take_corners();
  std::vector<selvedge_rig::arm_status_t> take_arm_states();
  std::optional<selvedge_rig::arm_status_t> arm_state() const;
  // The newest clock maps, by device: camera and tracker, as far as they are known.
  std::map<std::string, selvedge_rig::clock_map_t> clocks() const;
  // The newest sample that was taken after host_s.
  selvedge_rig::corner_sample_t corners_after(double host_s, double timeout_s);
  double tracker_rate_hz() const;

  // Shows a pattern and returns since when it shows.
  double show(const projector::Pattern& pattern, double timeout_s = 20);
  int projector_width_px() const;
  int projector_height_px() const;

  // prompt.utime and prompt_id are filled in. Returns the prompt_id.
  int64_t ask(selvedge_rig::operator_prompt_t prompt);
  // What a person answered to that prompt since it was asked, once; "" where nobody did.
  std::string take_answer(int64_t prompt_id);
  // Sends the last prompt again, with its number, where that is due: a datagram may get lost.
  void remind();
  void publish_status(selvedge_rig::session_status_t status);

  // The newest that a device said about itself, for errors.
  std::string last_words(const std::string& device) const;
  // Waits on the bus until ready() holds; ready is called with the client's state locked, so it must not
  // call the client. Throws DeviceFailed "DEVICE: no WHAT within N s; it says …".
  void wait(const std::string& device, const std::string& what, double timeout_s, const std::function<bool()>& ready);

 private:
  void subscribe();
  void open_ring(double until_s);
  bool running(const std::string& device, std::string& missing) const;  // this and the next: mutex_ held
  std::string words(const std::string& device) const;

  rig::BusConfiguration bus_configuration_;
  bool has_arm_ = false;
  std::filesystem::path arm_socket_;

  mutable std::mutex mutex_;  // guards all down to ring_
  std::condition_variable news_;
  std::map<std::string, selvedge_rig::device_status_t> status_;
  std::optional<selvedge_rig::clock_map_t> camera_clock_, tracker_clock_;
  std::optional<selvedge_rig::corner_sample_t> corners_;
  std::optional<selvedge_rig::arm_status_t> arm_;
  std::optional<selvedge_rig::projector_status_t> pattern_;
  std::optional<selvedge_rig::operator_answer_t> answer_;
  std::deque<selvedge_rig::corner_sample_t> corner_queue_;
  std::deque<selvedge_rig::arm_status_t> arm_queue_;

  std::unique_ptr<camera::FrameRingReader> ring_;
  camera::RingFrame ring_frame_;
  int width_px_ = 0, height_px_ = 0;
  int64_t last_number_ = 0, frames_lost_ = 0;
  int64_t command_id_ = 0;
  selvedge_rig::operator_prompt_t prompt_{};
  int64_t asked_us_ = 0, reminded_us_ = 0;
  std::unique_ptr<rig::Bus> bus_;  // last: its thread fills the rest
};

// Position of a marker by name; none where it is hidden or missing.
std::optional<Eigen::Vector3d> marker(const selvedge_rig::corner_sample_t& sample, const std::string& name);

}  // namespace selvedge::session
