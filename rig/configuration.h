// The rig's one configuration file (TOML, files/toml_file.h): a section a device.
//
//   [bus]
//   port = 7667
//   [camera]
//   backend = "aravis"
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "files/toml_file.h"
#include "rig/bus.h"

namespace selvedge::rig {

using files::Section;

class Configuration {
 public:
  Configuration() = default;  // no section
  // Throws BadInput where the file is missing, is not TOML (with line and column), or has a section that is
  // none of bus, camera, tracker, arm, projector, session, recorder, fabric, calibration. `sections`: other
  // names instead, for other files of the same kind.
  static Configuration load(const std::filesystem::path& path,
                            const std::vector<std::string>& sections = rig_sections());
  static Configuration parse(const std::string& text, const std::string& name,
                             const std::vector<std::string>& sections = rig_sections());
  static const std::vector<std::string>& rig_sections();

  bool has(const std::string& section) const { return file_.has(section); }
  Section section(const std::string& name) const {
    return file_.section(name);
  }                              // empty where the file does not have it
  BusConfiguration bus() const;  // [bus] port, receive_buffer_bytes, log_file, key_file

 private:
  explicit Configuration(files::TomlFile file) : file_(std::move(file)) {}
  files::TomlFile file_;
};

}  // namespace selvedge::rig
