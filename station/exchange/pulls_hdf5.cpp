#include "station/exchange/pulls_hdf5.h"

#include <algorithm>
#include <cmath>

#include "files/bad_input.h"
#include "station/exchange/hdf5_handle.h"

namespace selvedge::station {

namespace {

struct Numbers {
  std::vector<hsize_t> size;
  std::vector<double> values;
};

// What a file lacks is the user's to mend: BadInput, not the library's words.
Numbers read_numbers(hid_t parent, const std::string& name, size_t dimensions, const std::string& where) {
  if (H5Lexists(parent, name.c_str(), H5P_DEFAULT) <= 0) refuse(where, "found no dataset {}, expected it", name);
  const Handle set(H5Dopen2(parent, name.c_str(), H5P_DEFAULT), H5Dclose, name);
  const Handle space(H5Dget_space(set), H5Sclose, name);
  const int rank = H5Sget_simple_extent_ndims(space);
  if (rank < 0 || static_cast<size_t>(rank) != dimensions)
    refuse(where, "{}: found {} dimensions, expected {}", name, rank, dimensions);
  Numbers out;
  out.size.resize(dimensions);
  H5Sget_simple_extent_dims(space, out.size.data(), nullptr);
  hsize_t count = 1;
  for (const hsize_t n : out.size) count *= n;
  constexpr hsize_t kMost = 100'000'000;
  if (count == 0 || count > kMost) refuse(where, "{}: found {} numbers, expected 1 to {}", name, count, kMost);
  out.values.resize(count);
  if (H5Dread(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, out.values.data()) < 0)
    refuse(where, "{}: found no numbers, expected them", name);
  return out;
}

// Names of the groups in the file, in order of length and letters: video2 before video10.
std::vector<std::string> groups_of(hid_t file) {
  std::vector<std::string> names;
  const auto visit = [](hid_t, const char* name, const H5L_info_t*, void* to) -> herr_t {
    static_cast<std::vector<std::string>*>(to)->emplace_back(name);
    return 0;
  };
  H5Literate(file, H5_INDEX_NAME, H5_ITER_NATIVE, nullptr, visit, &names);
  std::erase_if(names, [&](const std::string& name) {
    H5O_info_t info;
    return H5Oget_info_by_name(file, name.c_str(), &info, H5P_DEFAULT) < 0 || info.type != H5O_TYPE_GROUP;
  });
  std::sort(names.begin(), names.end(),
            [](const std::string& a, const std::string& b) { return std::pair(a.size(), a) < std::pair(b.size(), b); });
  return names;
}

// Of two points at every frame, px.
std::vector<double> distances(const Numbers& traj, std::pair<int, int> points) {
  const hsize_t n = traj.size[2];
  const auto at = [&](int point, hsize_t axis, hsize_t frame) {
    return traj.values[(static_cast<hsize_t>(point) * 2 + axis) * n + frame];
  };
  std::vector<double> out(n);
  for (hsize_t f = 0; f < n; ++f)
    out[f] =
        std::hypot(at(points.first, 0, f) - at(points.second, 0, f), at(points.first, 1, f) - at(points.second, 1, f));
  return out;
}

trial::Pull read_pull(hid_t group, const PullsHdf5Options& options, const std::string& where, double& gauge_px) {
  const Numbers forces = read_numbers(group, "forces", 1, where), traj = read_numbers(group, "traj", 3, where);
  const hsize_t n = forces.size[0];
  const auto points = static_cast<hsize_t>(
      std::max({options.along.first, options.along.second, options.across.first, options.across.second}) + 1);
  if (traj.size[0] < points || traj.size[1] != 2 || traj.size[2] != n)
    refuse(where, "traj: found {}x{}x{}, expected {} points or more x 2 x {} as forces has", traj.size[0], traj.size[1],
           traj.size[2], points, n);
  Numbers frames{{n}, std::vector<double>(n)};
  for (hsize_t f = 0; f < n; ++f) frames.values[f] = static_cast<double>(f);
  if (H5Lexists(group, "frames", H5P_DEFAULT) > 0) frames = read_numbers(group, "frames", 1, where);
  if (frames.size[0] != n) refuse(where, "frames: found {} numbers, expected {} as forces has", frames.size[0], n);
  const std::vector<double> along = distances(traj, options.along), across = distances(traj, options.across);
  gauge_px = along.front();
  trial::Pull pull;
  for (hsize_t f = 0; f < n; ++f) {
    if (!std::isfinite(forces.values[f]) || !(along[f] > 0) || !std::isfinite(along[f])) continue;
    pull.time_s.push_back((frames.values[f] - frames.values[0]) / options.frame_rate_hz);
    pull.force.push_back(forces.values[f]);
    pull.stretch_along.push_back(along[f] / along.front());
    pull.stretch_across.push_back(across[f] > 0 ? across[f] / across.front() : std::nan(""));
  }
  return pull;
}

}  // namespace

PullsOfFile read_pulls_hdf5(const std::filesystem::path& path, const PullsHdf5Options& options) {
  const std::string where = path.string();
  if (!options.clamp_m) refuse("--clamp-mm", "found nothing, expected the clamp's width: the file's lengths are in px");
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  if (H5Fis_hdf5(where.c_str()) <= 0) refuse(where, "found no HDF5 file, expected one");
  const Handle file(H5Fopen(where.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose, where);
  const double clamp_px = read_numbers(file, "clampSize", 1, where).values.front(),
               fabric_px = read_numbers(file, "fabricSize", 1, where).values.front();
  if (!(clamp_px > 0 && fabric_px > 0))
    refuse(where, "found a clampSize of {} and a fabricSize of {} px, expected them above 0", clamp_px, fabric_px);
  const double m_per_px = *options.clamp_m / clamp_px;
  PullsOfFile out;
  out.width_m = fabric_px * m_per_px;
  for (const std::string& name : groups_of(file)) {
    const Handle group(H5Gopen2(file, name.c_str(), H5P_DEFAULT), H5Gclose, name);
    double gauge_px = 0;
    trial::Pull pull = read_pull(group, options, where + ": " + name, gauge_px);
    pull.number = static_cast<int>(out.pulls.size()) + 1;
    out.gauge_m += gauge_px * m_per_px;
    out.pulls.push_back(std::move(pull));
  }
  if (out.pulls.empty()) refuse(where, "found no group with a pull, expected one or more");
  out.gauge_m /= static_cast<double>(out.pulls.size());
  return out;
}

}  // namespace selvedge::station
