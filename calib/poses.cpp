#include "calib/poses.h"

#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include "files/bad_input.h"
#include "files/csv_table.h"
#include "files/whole_file.h"

namespace selvedge::calib {

namespace {

using nlohmann::json;

constexpr const char* kHeader = "pose,marker,x,y,z,camera_u,camera_v,projector_u,projector_v";
constexpr double kAbsent = std::numeric_limits<double>::quiet_NaN();

const json& member(const json& object, const std::string& key, const std::string& where) {
  if (!object.is_object()) refuse(where, "expected an object, found {}", object.type_name());
  const auto found = object.find(key);
  if (found == object.end()) refuse(where, "key \"{}\" is missing", key);
  return *found;
}

double finite_number(const json& value, const std::string& where) {
  if (!value.is_number()) refuse(where, "expected a number, found {}", value.dump());
  const double number = value.get<double>();
  if (!std::isfinite(number)) refuse(where, "expected a finite number, found {}", number);
  return number;
}

ImageSize size_from_json(const json& value, const std::string& where) {
  const auto pixels = [&](const char* key) {
    const json& number = member(value, key, where);
    if (!number.is_number_integer() || number.get<long long>() < 2 || number.get<long long>() > 100000)
      refuse(where + "." + key, "expected a whole number of pixels from 2 to 100000, found {}", number.dump());
    return number.get<int>();
  };
  return {pixels("width_px"), pixels("height_px")};
}

Eigen::Vector3d point_from_json(const json& value, const std::string& where) {
  if (!value.is_array() || value.size() != 3) refuse(where, "expected three numbers, found {}", value.dump());
  return {finite_number(value[0], where), finite_number(value[1], where), finite_number(value[2], where)};
}

Poses header_from_json(const json& value, const std::string& where) {
  const json& format = member(value, "format", where);
  if (format != "poses/1") refuse(where, "expected format \"poses/1\", found {}", format.dump());
  Poses poses;
  poses.camera = size_from_json(member(value, "camera", where), where + ": camera");
  poses.projector = size_from_json(member(value, "projector", where), where + ": projector");
  poses.tracker_noise_m = finite_number(member(value, "tracker_noise_m", where), where + ": tracker_noise_m");
  if (poses.tracker_noise_m < 0 || poses.tracker_noise_m > 1)
    refuse(where + ": tracker_noise_m", "expected a standard deviation in m from 0 to 1, found {}",
           poses.tracker_noise_m);
  const json& volume = member(value, "fabric_volume_m", where);
  const std::string volume_key = where + ": fabric_volume_m";
  if (!volume.is_array() || volume.size() != 2)
    refuse(volume_key, "expected [[x, y, z] low, [x, y, z] high], found {}", volume.dump());
  poses.volume_low = point_from_json(volume[0], volume_key + "[0]");
  poses.volume_high = point_from_json(volume[1], volume_key + "[1]");
  for (int axis = 0; axis < 3; ++axis)
    if (poses.volume_low[axis] > poses.volume_high[axis])
      refuse(volume_key, "expected low before high, found {} before {} on axis {}", poses.volume_low[axis],
             poses.volume_high[axis], "xyz"[axis]);
  return poses;
}

// Two numbers of a pixel: both finite, or both absent.
std::optional<Eigen::Vector2d> pixel_or_nothing(double u, double v, const char* device, const std::string& where) {
  if (std::isnan(u) && std::isnan(v)) return std::nullopt;
  if (std::isnan(u) || std::isnan(v))
    refuse(where, "expected {0}_u and {0}_v both present or both empty, found one alone", device);
  return Eigen::Vector2d(u, v);
}

void add_row(Poses& poses, std::set<std::pair<int, int>>& seen, const std::array<double, 9>& value,
             const std::string& where) {
  for (const double number : {value[0], value[1]})
    if (number != std::floor(number) || std::abs(number) > std::numeric_limits<int>::max())
      refuse(where, "found {}, expected the whole numbers of a pose and a marker", number);
  Correspondence row;
  row.pose = static_cast<int>(value[0]);
  row.marker = static_cast<int>(value[1]);
  row.position = Eigen::Vector3d(value[2], value[3], value[4]);
  row.camera = pixel_or_nothing(value[5], value[6], "camera", where);
  row.projector = pixel_or_nothing(value[7], value[8], "projector", where);
  if (!seen.emplace(row.pose, row.marker).second)
    refuse(where, "marker {} of pose {} stands here for the second time, expected once", row.marker, row.pose);
  poses.rows.push_back(row);
}

void read_rows(Poses& poses, const std::filesystem::path& path) {
  const files::CsvTable table = files::read_csv(path, {{"pose"},
                                                       {"marker"},
                                                       {"x"},
                                                       {"y"},
                                                       {"z"},
                                                       {"camera_u", true},
                                                       {"camera_v", true},
                                                       {"projector_u", true},
                                                       {"projector_v", true}});
  if (table.rows() == 0) refuse(path.string(), "expected at least one row below the header, found none");
  std::set<std::pair<int, int>> seen;
  for (size_t i = 0; i < table.rows(); ++i) {
    std::array<double, 9> value{};
    for (size_t column = 0; column < value.size(); ++column) value[column] = table(i, column);
    add_row(poses, seen, value, table.where(i));
  }
}

}  // namespace

json header_to_json(const Poses& poses) {
  const auto size = [](const ImageSize& s) { return json{{"width_px", s.width_px}, {"height_px", s.height_px}}; };
  const auto point = [](const Eigen::Vector3d& p) { return json{p.x(), p.y(), p.z()}; };
  return {{"format", "poses/1"},
          {"camera", size(poses.camera)},
          {"projector", size(poses.projector)},
          {"tracker_noise_m", poses.tracker_noise_m},
          {"fabric_volume_m", {point(poses.volume_low), point(poses.volume_high)}}};
}

Poses read_poses_header(const std::filesystem::path& path) {
  return header_from_json(files::read_json(path), path.string());
}

Poses read_poses(const std::filesystem::path& folder) {
  Poses poses = read_poses_header(folder / "poses.json");
  read_rows(poses, folder / "correspondences.csv");
  return poses;
}

void write_poses(const Poses& poses, const std::filesystem::path& folder) {
  std::string text = std::string(kHeader) + "\n";
  for (const Correspondence& row : poses.rows) {
    const auto pixel = [](const std::optional<Eigen::Vector2d>& p) {
      return p ? fmt::format("{},{}", p->x(), p->y()) : std::string(",");
    };
    text += fmt::format("{},{},{},{},{},{},{}\n", row.pose, row.marker, row.position.x(), row.position.y(),
                        row.position.z(), pixel(row.camera), pixel(row.projector));
  }
  std::filesystem::create_directories(folder);
  files::write_whole(folder / "correspondences.csv", text);
  files::write_json(folder / "poses.json", header_to_json(poses));
}

json to_json(const Poses& poses) {
  json value = header_to_json(poses);
  json rows = json::array();
  const auto number = [](const std::optional<Eigen::Vector2d>& p, int axis) {
    return p ? json((*p)[axis]) : json(nullptr);
  };
  for (const Correspondence& row : poses.rows)
    rows.push_back({row.pose, row.marker, row.position.x(), row.position.y(), row.position.z(), number(row.camera, 0),
                    number(row.camera, 1), number(row.projector, 0), number(row.projector, 1)});
  value["correspondences"] = std::move(rows);
  return value;
}

Poses poses_from_json(const json& value, const std::string& where) {
  Poses poses = header_from_json(value, where);
  const json& rows = member(value, "correspondences", where);
  if (!rows.is_array()) refuse(where + ": correspondences", "expected rows, found {}", rows.type_name());
  std::set<std::pair<int, int>> seen;
  for (size_t i = 0; i < rows.size(); ++i) {
    const std::string row_key = fmt::format("{}: correspondences[{}]", where, i);
    if (!rows[i].is_array() || rows[i].size() != 9) refuse(row_key, "expected nine columns");
    std::array<double, 9> number{};
    for (size_t column = 0; column < 9; ++column)
      number[column] = column >= 5 && rows[i][column].is_null() ? kAbsent : finite_number(rows[i][column], row_key);
    add_row(poses, seen, number, row_key);
  }
  return poses;
}

}  // namespace selvedge::calib
