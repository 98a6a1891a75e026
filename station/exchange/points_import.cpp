#include "station/exchange/points_import.h"

#include <algorithm>
#include <numeric>

#include "files/bad_input.h"
#include "files/csv_table.h"
#include "station/exchange/points_file.h"

namespace selvedge::station {

namespace {

namespace fs = std::filesystem;
using Eigen::Index;
using Eigen::Matrix3Xd;
using files::Section;

bool is_digit(char c) { return c >= '0' && c <= '9'; }

// Runs of digits by their value, all else by its characters.
bool comes_before(const std::string& a, const std::string& b) {
  size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (!is_digit(a[i]) || !is_digit(b[j])) {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i, ++j;
      continue;
    }
    while (i < a.size() && a[i] == '0') ++i;
    while (j < b.size() && b[j] == '0') ++j;
    size_t m = i, n = j;
    while (m < a.size() && is_digit(a[m])) ++m;
    while (n < b.size() && is_digit(b[n])) ++n;
    if (m - i != n - j) return m - i < n - j;
    if (const int order = a.compare(i, m - i, b, j, n - j); order != 0) return order < 0;
    i = m, j = n;
  }
  if (a.size() - i != b.size() - j) return a.size() - i < b.size() - j;
  return a < b;
}

// alike: of as many points each.
std::vector<Matrix3Xd> read_frames(const fs::path& source, const std::string& key, bool alike) {
  std::vector<Matrix3Xd> frames;
  const bool is_folder = fs::is_directory(source);
  for (const fs::path& file : is_folder ? files_in_order(source) : std::vector<fs::path>{source}) {
    for (Matrix3Xd& points : read_points(file)) {
      if (alike && !frames.empty() && points.cols() != frames[0].cols())
        refuse(file.string(),
               "found {} points, expected {} as in the first frame: a marker is the same point of the fabric in all "
               "frames; clouds whose points are others each time belong in a section [surface]",
               points.cols(), frames[0].cols());
      frames.push_back(std::move(points));
    }
  }
  if (frames.empty()) refuse(key, "found no file in {}", source.string());
  if (alike && frames[0].cols() == 0) refuse(source.string(), "found no points");
  return frames;
}

std::vector<double> read_times(Section& keys, const fs::path& base, const Units& units, size_t frames) {
  std::vector<double> times;
  if (!keys.has("times")) {
    const double rate_hz = keys.number("rate_hz", std::nullopt, 0.1, 1e5, "Hz");
    for (size_t i = 0; i < frames; ++i) times.push_back(static_cast<double>(i) / rate_hz);
    return times;
  }
  const fs::path file = base / keys.text("times", std::nullopt);
  const files::CsvTable table = files::read_csv(file, {{keys.text("time", std::nullopt)}});
  files::require_times_ascend(table, 0);
  if (table.rows() != frames)
    refuse(file.string(), "found {} times, expected one of each of {} frames", table.rows(), frames);
  for (size_t row = 0; row < frames; ++row) times.push_back(units.time_s * table(row, 0));
  return times;
}

// Which points are markers, all where none are named.
std::vector<Index> read_points_wanted(Section& keys, Index count) {
  std::vector<Index> wanted;
  if (!keys.has("points")) {
    wanted.resize(static_cast<size_t>(count));
    std::iota(wanted.begin(), wanted.end(), 0);
    return wanted;
  }
  for (const double point : keys.numbers("points", std::nullopt, 0, 0, static_cast<double>(count) - 1, "(its place)")) {
    wanted.push_back(static_cast<Index>(point));
    if (static_cast<double>(wanted.back()) != point)
      refuse(keys.where() + " points", "found {}, expected whole numbers", point);
  }
  if (wanted.empty()) refuse(keys.where() + " points", "found none, expected at least one");
  return wanted;
}

// Of each wanted point: named, or the nodes of a grid over the whole swatch, row by row from the held edge.
std::vector<Eigen::Vector2d> read_flat(Section& keys, const std::vector<Index>& wanted, Index count,
                                       const trial::Fabric& fabric) {
  std::vector<Eigen::Vector2d> flat;
  if (!keys.has("grid")) {
    const std::vector<double> uv = keys.numbers("flat_m", std::nullopt, 2 * wanted.size(), -10, 10, "m");
    for (size_t i = 0; i < wanted.size(); ++i) flat.emplace_back(uv[2 * i], uv[2 * i + 1]);
    return flat;
  }
  const std::vector<double> grid = keys.numbers("grid", std::nullopt, 2, 2, 1e5, "nodes");
  const auto columns = static_cast<Index>(grid[0]), rows = static_cast<Index>(grid[1]);
  if (columns * rows != count)
    refuse(keys.where() + " grid", "found {} × {} nodes, expected as many as the {} points of a frame", columns, rows,
           count);
  for (const Index point : wanted)
    flat.emplace_back(fabric.width_m * static_cast<double>(point % columns) / static_cast<double>(columns - 1),
                      fabric.height_m * static_cast<double>(point / columns) / static_cast<double>(rows - 1));
  return flat;
}

Matrix3Xd side_by_side(const std::vector<Eigen::Vector3d>& points) {
  return Eigen::Map<const Matrix3Xd>(points.front().data(), 3, static_cast<Index>(points.size()));
}

}  // namespace

std::vector<fs::path> files_in_order(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.is_regular_file() && entry.path().filename().string()[0] != '.') files.push_back(entry.path());
  std::sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
    return comes_before(a.filename().string(), b.filename().string());
  });
  return files;
}

trial::Markers read_point_markers(Section keys, const fs::path& base, const Units& units, trial::Trial& trial) {
  const std::string key = keys.where() + " frames";
  const std::vector<Matrix3Xd> frames = read_frames(base / keys.text("frames", std::nullopt), key, true);
  const Index count = frames[0].cols();
  const std::vector<double> times = read_times(keys, base, units, frames.size());
  const std::vector<Index> wanted = read_points_wanted(keys, count);
  const std::vector<Eigen::Vector2d> flat = read_flat(keys, wanted, count, trial.fabric);
  trial.mocap_noise_m = keys.number("noise_m", 3e-4, 0, 0.1, "m");
  keys.finish();
  trial::Markers markers;
  std::vector<Eigen::Vector3d> positions;
  for (size_t frame = 0; frame < frames.size(); ++frame)
    for (size_t k = 0; k < wanted.size(); ++k) {
      const Eigen::Vector3d x = frames[frame].col(wanted[k]);
      if (!x.allFinite()) continue;
      markers.time_s.push_back(times[frame]);
      markers.marker.push_back(static_cast<int>(wanted[k]));
      markers.uv.push_back(flat[k]);
      positions.push_back(units.point(x.x(), x.y(), x.z()));
    }
  if (positions.empty()) refuse(key, "found no point that was seen");
  markers.position = side_by_side(positions);
  return markers;
}

trial::Surface read_surface(Section keys, const fs::path& base, const Units& units) {
  const std::string key = keys.where() + " frames";
  const std::vector<Matrix3Xd> frames = read_frames(base / keys.text("frames", std::nullopt), key, false);
  const std::vector<double> times = read_times(keys, base, units, frames.size());
  trial::Surface surface;
  if (keys.has("seen_from_m")) {
    const auto from = keys.numbers("seen_from_m", std::nullopt, 3, -1e3, 1e3, "m");
    surface.seen_from_m = Eigen::Vector3d(from[0], from[1], from[2]);
  }
  keys.finish();
  std::vector<Eigen::Vector3d> positions;
  for (size_t frame = 0; frame < frames.size(); ++frame)
    for (Index i = 0; i < frames[frame].cols(); ++i) {
      const Eigen::Vector3d x = frames[frame].col(i);
      if (!x.allFinite()) continue;
      surface.time_s.push_back(times[frame]);
      positions.push_back(units.point(x.x(), x.y(), x.z()));
    }
  if (positions.empty()) refuse(key, "found no point that was seen");
  surface.position = side_by_side(positions);
  return surface;
}

}  // namespace selvedge::station
