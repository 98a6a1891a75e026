// A small sound trial, and the ways to damage it that a reader must refuse. Serves the proof and the tests.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "capture/trial/trial.h"

namespace selvedge::cli {

struct ExampleTrial {
  trial::Trial trial;
  std::vector<trial::GreyImage> images;
};

// With every part that a trial can have, in numbers without end: hidden corners, odd doubles, noisy images.
ExampleTrial example_trial(unsigned seed);

struct Damage {
  std::string name;     // "corners.csv cut in the middle of a number"
  std::string culprit;  // what the refusal must name
  std::function<void(const std::filesystem::path& folder)> apply;
};

// Each is applied to a fresh copy of the example on disk.
const std::vector<Damage>& damages();

// Changes after which the trial must still be read.
const std::vector<Damage>& harmless_changes();

// The refusal of read_campaign and of every frame's decoding; empty where all of it is read.
std::string refusal_of(const std::filesystem::path& folder);

// A folder of its own below the system's temporary one, gone with the object.
class ScratchFolder {
 public:
  ScratchFolder();
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace selvedge::cli
