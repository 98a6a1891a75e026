// A stripe projector: shows one pattern (pattern.h) at a time.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "rig/projector/pattern.h"

namespace selvedge::projector {

class Projector {
 public:
  virtual ~Projector() = default;
  // Returns once the pattern is on the mirrors. Throws BadInput where this projector cannot show it (what
  // shows is then unchanged), ProjectorFault where the device refuses or fails, wire::Disconnected where it is
  // gone.
  virtual void show(const Pattern& pattern) = 0;
  // Asks the device how it is. Throws as show() does.
  virtual void check() = 0;
  // Device and firmware, for the log.
  virtual std::string description() const = 0;
};

// The device answered, and the answer is no.
class ProjectorFault : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct ProjectorOptions {
  std::string transport = "usb";      // "usb", or "unix:PATH", a socket that carries the same reports
  std::filesystem::path flash_table;  // what the device's flash holds (flash_table.h); empty: built in
  double exposure_s = 1.0 / 60;       // of one showing of a flash pattern; TRIG_OUT_1 pulses once each
  double reply_timeout_s = 2;
};

// TI DLPC350, e.g. the LightCrafter 4500 (backends/dlpc350.cpp).
std::unique_ptr<Projector> open_dlpc350(const ProjectorOptions& options);

struct WindowOptions {
  std::string screen;  // X display as ":0"; empty: the environment's DISPLAY
  int monitor = 0;     // of that screen, counted from 0
  int width_px = 912;  // what the monitor is set to; anything else is refused
  int height_px = 1140;
  double gamma = 1;        // light = drive^gamma; 2.2 for most video projectors
  double settle_s = 0.05;  // waited after the refresh, for the projector's own electronics
  double reply_timeout_s = 2;
};

// Any projector that is a screen: a full-screen window (backends/window.cpp). Shows every pattern at any level; it has
// no trigger output.
std::unique_ptr<Projector> open_window(const WindowOptions& options);

}  // namespace selvedge::projector
