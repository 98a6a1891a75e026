#include "station/exchange/hdf5_export.h"

#include <array>
#include <stdexcept>
#include <vector>

#include "files/part_file.h"
#include "station/exchange/hdf5_handle.h"

namespace selvedge::station {

namespace {

namespace fs = std::filesystem;

template <class Number>
hid_t type_of();
template <>
hid_t type_of<double>() {
  return H5T_NATIVE_DOUBLE;
}
template <>
hid_t type_of<int>() {
  return H5T_NATIVE_INT;
}

void text_attribute(hid_t object, const char* name, const std::string& text) {
  const Handle type(H5Tcopy(H5T_C_S1), H5Tclose, name);
  require(H5Tset_size(type, text.size() + 1), name);
  require(H5Tset_cset(type, H5T_CSET_UTF8), name);
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose, name);
  const Handle attribute(H5Acreate2(object, name, type, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose, name);
  require(H5Awrite(attribute, type, text.c_str()), name);
}

template <class Number>
void number_attribute(hid_t object, const char* name, Number value) {
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose, name);
  const Handle attribute(H5Acreate2(object, name, type_of<Number>(), space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose, name);
  require(H5Awrite(attribute, type_of<Number>(), &value), name);
}

// A dataset of any shape, row major, with its unit.
template <class Number>
void dataset(hid_t group, const char* name, const std::vector<hsize_t>& shape, const Number* values,
             const std::string& unit) {
  const Handle space(H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr), H5Sclose, name);
  const Handle set(H5Dcreate2(group, name, type_of<Number>(), space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Dclose,
                   name);
  require(H5Dwrite(set, type_of<Number>(), H5S_ALL, H5S_ALL, H5P_DEFAULT, values), name);
  text_attribute(set, "unit", unit);
}

void times(hid_t group, const std::vector<double>& time_s) {
  dataset(group, "time", {time_s.size()}, time_s.data(), "s");
}

// 3×N, column major, is N×3 row major.
void points(hid_t group, const char* name, const Eigen::Matrix3Xd& positions) {
  dataset(group, name, {static_cast<hsize_t>(positions.cols()), 3}, positions.data(), "m");
}

Handle make_group(hid_t file, const char* name) {
  return {H5Gcreate2(file, name, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose, name};
}

void write_optics(hid_t file, const char* name, const geometry::Projection& p) {
  const Handle group = make_group(file, name);
  const Eigen::Matrix<double, 3, 4, Eigen::RowMajor> matrix = p.matrix;
  dataset(group, "projection", {3, 4}, matrix.data(), "px, from metres");
  dataset(group, "distortion", {p.distortion.size()}, p.distortion.data(), "1");
  number_attribute(group, "width_px", p.width_px);
  number_attribute(group, "height_px", p.height_px);
}

void write_frames(hid_t file, const trial::Trial& trial) {
  const Handle group = make_group(file, "frames");
  const size_t count = trial.frames->time_s.size();
  times(group, trial.frames->time_s);
  dataset(group, "number", {count}, trial.frames->number.data(), "1");
  number_attribute(group, "frame_rate_hz", trial.frame_rate_hz);
  number_attribute(group, "exposure_s", trial.exposure_s);
  if (!trial.camera || count == 0) return;
  const std::array<hsize_t, 3> shape = {count, static_cast<hsize_t>(trial.camera->height_px),
                                        static_cast<hsize_t>(trial.camera->width_px)},
                               one = {1, shape[1], shape[2]};
  const Handle space(H5Screate_simple(3, shape.data(), nullptr), H5Sclose, "image");
  const Handle layout(H5Pcreate(H5P_DATASET_CREATE), H5Pclose, "image");
  require(H5Pset_chunk(layout, 3, one.data()), "image");
  require(H5Pset_deflate(layout, 1), "image");
  const Handle set(H5Dcreate2(group, "image", H5T_NATIVE_UINT8, space, H5P_DEFAULT, layout, H5P_DEFAULT), H5Dclose,
                   "image");
  text_attribute(set, "unit", "grey level");
  const Handle memory(H5Screate_simple(3, one.data(), nullptr), H5Sclose, "image");
  for (size_t i = 0; i < count; ++i) {
    const trial::GreyImage image = trial::read_frame(trial, i);
    const std::array<hsize_t, 3> from = {i, 0, 0};
    require(H5Sselect_hyperslab(space, H5S_SELECT_SET, from.data(), nullptr, one.data(), nullptr), "image");
    require(H5Dwrite(set, H5T_NATIVE_UINT8, memory, space, H5P_DEFAULT, image.data()), "image");
  }
}

void write_markers(hid_t file, const trial::Markers& markers) {
  const Handle group = make_group(file, "markers");
  times(group, markers.time_s);
  dataset(group, "marker", {markers.marker.size()}, markers.marker.data(), "1");
  std::vector<double> uv;
  for (const Eigen::Vector2d& p : markers.uv) uv.insert(uv.end(), {p.x(), p.y()});
  dataset(group, "uv", {markers.uv.size(), 2}, uv.data(), "m");
  points(group, "position", markers.position);
}

void write_surface(hid_t file, const trial::Surface& surface) {
  const Handle group = make_group(file, "surface");
  times(group, surface.time_s);
  points(group, "position", surface.position);
  if (surface.seen_from_m) dataset(group, "seen_from", {3}, surface.seen_from_m->data(), "m");
}

void write_all(hid_t file, const trial::Trial& trial) {
  text_attribute(file, "format", "selvedge-trial/1");
  text_attribute(file, "name", trial.name);
  text_attribute(file, "experiment", trial::to_text(trial.experiment));
  text_attribute(file, "state", trial::to_text(trial.state));
  text_attribute(file, "held", trial::to_text(trial.held));
  number_attribute(file, "starts_at_rest", static_cast<int>(trial.starts_at_rest));
  number_attribute(file, "mocap_rate_hz", trial.mocap_rate_hz);
  if (trial.mocap_noise_m) number_attribute(file, "mocap_noise_m", *trial.mocap_noise_m);
  if (trial.noise_grey_levels) number_attribute(file, "noise_grey_levels", *trial.noise_grey_levels);
  dataset(file, "gravity", {3}, trial.gravity_m_s2.data(), "m/s^2");
  {
    const Handle group = make_group(file, "fabric");
    text_attribute(group, "name", trial.fabric.name);
    number_attribute(group, "width_m", trial.fabric.width_m);
    number_attribute(group, "height_m", trial.fabric.height_m);
    number_attribute(group, "mass_kg", trial.fabric.mass_kg);
    number_attribute(group, "mass_known", static_cast<int>(trial.fabric.mass_known));
  }
  {
    const Handle group = make_group(file, "corners");
    times(group, trial.corners.time_s);
    points(group, "left", trial.corners.left);
    points(group, "right", trial.corners.right);
  }
  if (trial.camera) write_optics(file, "camera", *trial.camera);
  if (trial.projector) write_optics(file, "projector", *trial.projector);
  if (trial.pattern) {
    const Handle group = make_group(file, "pattern");
    text_attribute(group, "orientation", trial.pattern->orientation);
    number_attribute(group, "period_px", trial.pattern->period_px);
    number_attribute(group, "duty", trial.pattern->duty);
    number_attribute(group, "first_bright_row_px", trial.pattern->first_bright_row_px);
  }
  if (trial.frames) write_frames(file, trial);
  if (trial.markers) write_markers(file, *trial.markers);
  if (trial.surface) write_surface(file, *trial.surface);
  if (trial.robot) {
    const Handle group = make_group(file, "robot");
    times(group, trial.robot->time_s);
    points(group, "commanded", trial.robot->commanded);
    points(group, "measured", trial.robot->measured);
  }
}

}  // namespace

void export_hdf5(const trial::Trial& trial, const fs::path& path) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // failures are thrown, not printed
  files::write_in_part(path, [&](const fs::path& part) {
    const Handle file(H5Fcreate(part.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), H5Fclose,
                      "making " + part.string());
    write_all(file, trial);
    require(H5Fflush(file, H5F_SCOPE_GLOBAL), "writing " + part.string());
  });
}

}  // namespace selvedge::station
