#include "station/exchange/points_file.h"

#include "files/bad_input.h"
#include "files/whole_file.h"

namespace selvedge::station {

std::vector<Eigen::Matrix3Xd> parse_points(std::string_view bytes, const std::string& kind, const std::string& where) {
  if (kind == ".ply") return parse_ply(bytes, where);
  if (kind == ".pcd") return parse_pcd(bytes, where);
  if (kind == ".npy") return parse_npy(bytes, where);
  refuse(where, "found a file of kind {}, expected .ply, .pcd or .npy", in_quotes(kind));
}

std::vector<Eigen::Matrix3Xd> read_points(const std::filesystem::path& path) {
  std::string kind = path.extension().string();
  for (char& c : kind)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return parse_points(files::read_whole(path), kind, path.string());
}

}  // namespace selvedge::station
