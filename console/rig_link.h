// What the console's server needs of a rig: what it shows, and the few things that a person may do. Tests give another.
//
// Every call may come from any of the server's threads.
#pragma once

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>

#include <nlohmann/json_fwd.hpp>

namespace selvedge::console {

// A live picture with what is drawn on it.
struct Preview {
  int64_t utime = 0;   // us, host clock, mid-exposure
  int64_t number = 0;  // of the camera
  std::string png;
  std::string overlay;  // JSON: width, height, outline, tiles (preview.h)
};

class RigLink {
 public:
  virtual ~RigLink() = default;

  // {"devices", "corners", "arm", "session", "prompt", "recording", …}; what is not known is left out.
  virtual nlohmann::json state() = 0;
  // Newer than the given frame number; none where there is none yet.
  virtual std::optional<Preview> preview(int64_t newer_than) = 0;
  // Says that somebody looks; without it for a second no picture is made.
  virtual void watched() = 0;

  // Each throws BadInput or std::runtime_error with a sentence for the page.
  virtual void arm(const std::string& who) = 0;  // arms and holds
  virtual void disarm() = 0;                     // what was armed here
  // Stops the arm, whoever armed it, and what is recorded here. Returns once the arm has said that it stopped.
  virtual void stop(const std::string& why) = 0;
  // A person's word that lifts the stop that state() shows.
  virtual void reset(const std::string& who) = 0;
  virtual void record(const nlohmann::json& trial) = 0;
  virtual void stop_recording() = 0;
  virtual void answer(int64_t prompt_id, const std::string& text) = 0;
  // Whether an arm moves or may move because somebody said so here.
  virtual bool armed_here() const = 0;
};

}  // namespace selvedge::console
