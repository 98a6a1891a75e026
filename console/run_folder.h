// What a run has on disk, for the console: its trials with what their checks found, frames recorded and simulated,
// fits, diagnoses, the journal of its session, and its reports. Reads only; every name is sought below the run's folder
// and nowhere else.
#pragma once

#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace selvedge::console {

class RunFolder {
 public:
  explicit RunFolder(std::filesystem::path folder) : folder_(std::move(folder)) {}

  const std::filesystem::path& folder() const { return folder_; }

  // One a trial, in order of path: {"path", "fabric", "name", "kind", "state", "frames", "gaps", "duration_s",
  // "simulated", "kept_aside"}.
  nlohmann::json trials() const;
  // Times and tracks of one trial, "simulated" with vertices where its fit left them. Throws BadInput.
  nlohmann::json trial(const std::string& path) const;
  // PNG bytes of a frame; of the same moment as the fit's parameters simulate it. Throw BadInput.
  std::string frame(const std::string& path, size_t index) const;
  std::string simulated_frame(const std::string& path, size_t index) const;
  // Vertices of the simulated motion: little-endian floats as on disk.
  std::string motion(const std::string& path) const;

  // {"steps": […], "fits": […], "diagnoses": […], "reports": […], "calibration"}.
  nlohmann::json session() const;
  // A file that a report may be made of: html, json, csv, png, svg or toml.
  std::optional<std::filesystem::path> shown_file(const std::string& path) const;

 private:
  std::filesystem::path trial_folder(const std::string& path) const;

  const std::filesystem::path folder_;
  mutable std::mutex rendering_;  // one GL context at a time
};

}  // namespace selvedge::console
