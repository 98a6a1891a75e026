#include "station/exchange/obj_sequence.h"

#include <algorithm>
#include <iterator>

#include <fmt/format.h>

#include "files/whole_file.h"

namespace selvedge::station {

size_t write_obj_sequence(const SimulatedMotion& motion, const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  Eigen::Vector2d size = Eigen::Vector2d::Constant(1e-12);
  for (const Eigen::Vector2d& uv : motion.uv_m) size = size.cwiseMax(uv);
  std::string flat, faces, times = "file,t_s\n";
  for (const Eigen::Vector2d& uv : motion.uv_m)
    fmt::format_to(std::back_inserter(flat), "vt {:.6f} {:.6f}\n", uv.x() / size.x(), 1 - uv.y() / size.y());
  for (const auto& t : motion.triangles)
    fmt::format_to(std::back_inserter(faces), "f {0}/{0} {1}/{1} {2}/{2}\n", t[0] + 1, t[1] + 1, t[2] + 1);
  for (size_t i = 0; i < motion.time_s.size(); ++i) {
    std::string text = "# m, z up\n";
    const Eigen::Matrix3Xf& x = motion.position[i];
    for (Eigen::Index k = 0; k < x.cols(); ++k)
      fmt::format_to(std::back_inserter(text), "v {:.6f} {:.6f} {:.6f}\n", x(0, k), x(1, k), x(2, k));
    const std::string name = fmt::format("frame_{:05}.obj", i + 1);
    files::write_whole(folder / name, text + flat + faces);
    times += fmt::format("{},{:.6f}\n", name, motion.time_s[i]);
  }
  files::write_whole(folder / "times.csv", times);
  return motion.time_s.size();
}

}  // namespace selvedge::station
