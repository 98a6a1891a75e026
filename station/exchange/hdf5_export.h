// A trial as one HDF5 file, for h5py and MATLAB: every column a dataset with its unit as attribute "unit".
//
//   /                      attributes format "selvedge-trial/1", name, experiment, state, held, starts_at_rest
//   /fabric                attributes name, width_m, height_m, mass_kg, mass_known
//   /gravity               3, m/s^2
//   /corners/time          N, s;  /corners/left, /corners/right   N×3, m (NaN where hidden)
//   /frames/time           F, s;  /frames/number  F;  /frames/image  F×height×width, grey level (deflated, a chunk a
//   frame) /camera, /projector    projection 3×4, px; distortion 5 (OpenCV's k1 k2 p1 p2 k3); attributes width_px,
//   height_px /pattern               attributes orientation, period_px, duty, first_bright_row_px /markers/time,
//   marker, uv, position   /surface/time, position, seen_from   /robot/time, commanded, measured   where the trial has
//   them
// Attributes with a unit in their name are in it. Source: HDF5 1.10; layout as docs/sessions.md.
#pragma once

#include <filesystem>

#include "capture/trial/trial.h"

namespace selvedge::station {

// Whole file or nothing. Throws BadInput where an image is damaged, std::runtime_error where the disk refuses.
void export_hdf5(const trial::Trial& trial, const std::filesystem::path& file);

}  // namespace selvedge::station
