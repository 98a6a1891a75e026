#include "station/motion_file.h"

#include <bit>
#include <cstring>

#include <nlohmann/json.hpp>

#include "files/bad_input.h"
#include "files/whole_file.h"

namespace selvedge::station {

namespace fs = std::filesystem;
using nlohmann::json;
static_assert(std::endian::native == std::endian::little, "TRIAL.f32 is written as it lies in memory");

fs::path motion_path(const fs::path& folder, const std::string& trial) {
  return folder / "simulated" / (trial + ".json");
}

SimulatedMotion read_simulated_motion(const fs::path& folder, const std::string& trial) {
  const fs::path path = motion_path(folder, trial);
  const json header = files::read_json(path);
  const std::string bytes = files::read_whole(fs::path(path).replace_extension(".f32"));
  SimulatedMotion motion;
  try {
    for (const json& p : header.at("uv_m")) motion.uv_m.emplace_back(p.at(0).get<double>(), p.at(1).get<double>());
    const auto vertex = [&](const json& v) {
      const auto count = static_cast<long long>(motion.uv_m.size());
      if (!v.is_number_integer() || v.get<long long>() < 0 || v.get<long long>() >= count)
        refuse(path.string(), "triangle vertex {}, expected a whole number from 0 to {}", v.dump(), count - 1);
      return v.get<int>();
    };
    for (const json& t : header.at("triangles"))
      motion.triangles.push_back({vertex(t.at(0)), vertex(t.at(1)), vertex(t.at(2))});
    motion.time_s = header.at("time_s").get<std::vector<double>>();
  } catch (const json::exception& error) { refuse(path.string(), "{}", error.what()); }
  const auto vertices = static_cast<Eigen::Index>(motion.uv_m.size());
  const size_t one = sizeof(float) * 3 * motion.uv_m.size();
  if (bytes.size() != one * motion.time_s.size())
    refuse(path.string(), "its .f32 has {} bytes, expected {} for {} vertices at {} times", bytes.size(),
           one * motion.time_s.size(), vertices, motion.time_s.size());
  for (size_t i = 0; i < motion.time_s.size(); ++i) {
    Eigen::Matrix3Xf x(3, vertices);
    std::memcpy(x.data(), bytes.data() + i * one, one);
    motion.position.push_back(std::move(x));
  }
  return motion;
}

}  // namespace selvedge::station
