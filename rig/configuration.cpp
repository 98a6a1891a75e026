#include "rig/configuration.h"

namespace selvedge::rig {

const std::vector<std::string>& Configuration::rig_sections() {
  static const std::vector<std::string> sections = {"bus",     "camera",   "tracker", "arm",        "projector",
                                                    "session", "recorder", "fabric",  "calibration"};
  return sections;
}

Configuration Configuration::load(const std::filesystem::path& path, const std::vector<std::string>& sections) {
  return Configuration(files::TomlFile::load(path, sections));
}

Configuration Configuration::parse(const std::string& text, const std::string& name,
                                   const std::vector<std::string>& sections) {
  return Configuration(files::TomlFile::parse(text, name, sections));
}

BusConfiguration Configuration::bus() const {
  Section keys = section("bus");
  BusConfiguration result;
  result.port = static_cast<int>(keys.integer("port", result.port, 1024, 65535));
  result.receive_buffer_bytes =
      static_cast<int>(keys.integer("receive_buffer_bytes", result.receive_buffer_bytes, 65536, 1 << 30, "bytes"));
  result.log_file = keys.text("log_file", result.log_file);
  result.key_file = keys.text("key_file", result.key_file);
  keys.finish();
  return result;
}

}  // namespace selvedge::rig
