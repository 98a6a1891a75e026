// Recordings of others as a trial: a small mapping file says which columns and pictures are what.
//
//   [trial]
//   name = "their-drape"        kind = "waving"           # static, waving, robot
//   starts_at_rest = true       gravity_m_s2 = [0, 0, -9.81]
//   [fabric]
//   name = "denim"              width_m = 0.3    height_m = 0.3    mass_kg = 0.02    mass_known = true
//   [corners]                   # the held corners: columns of a CSV, or two of the markers
//   file = "corners.csv"        time = "t"    left = ["lx", "ly", "lz"]    right = ["rx", "ry", "rz"]
//   left_marker = 0             right_marker = 4
//   [markers]                   # long form: a row a marker and time
//   file = "dots.csv"           time = "t"    marker = "id"    position = ["x", "y", "z"]    flat = ["u", "v"]
//   noise_m = 3e-4
//   [images]                    # pictures of a folder, in order of their names (9 before 10), turned to 8-bit grey
//   folder = "pictures"         rate_hz = 30    start_s = 0.0
//   [camera] / [projector]      # as docs/formats.md: width_px, height_px, projection (12 numbers, row by row),
//                               # distortion (5)
//   [pattern]                   # orientation, period_px, duty, first_bright_row_px
//   [units]                     # of the CSV files, and what turns their axes into right-handed, z up
//   length_m = 0.001            time_s = 0.001    axes = ["x", "-z", "y"]
// Of a C3D file, whose unit and rate are its own, markers and corners go by its labels:
//   [markers]
//   c3d = "take.c3d"            labels = ["dot1", "dot2"]    flat_m = [0.03, 0.03, 0.09, 0.03]    # u, v of each
//   [corners]
//   left_label = "L"            right_label = "R"
// Of files of points (PLY, PCD, NPY), one a frame in order of their names, or an NPY of frames × points × 3. A marker
// is the same point of the fabric in all of them; its number is its place in the file:
//   [markers]
//   frames = "scans"            rate_hz = 30               # or times = "times.csv", time = "t"
//   grid = [25, 25]             # nodes along the width and down, row by row from the held edge; or flat_m as above
//   points = [0, 24, 312]       # those that are markers; all by default
// Of such files whose points are others in every frame, as depth cameras and scanners have them:
//   [surface]
//   frames = "scans"            rate_hz = 30               # or times = "times.csv", time = "t"
//   seen_from_m = [0, -1.2, 0.9]                           # where the instrument stood, in the tracker's frame
// Paths are relative to the mapping file. A trial has markers, a surface or images, or several of them.
#pragma once

#include <filesystem>
#include <vector>

#include "capture/trial/trial.h"

namespace selvedge::station {

struct Recording {
  trial::Trial trial;
  std::vector<trial::GreyImage> images;  // one for each of trial.frames
};

// What a mapping and the files that it names say. Throws BadInput naming file and key.
Recording read_recording(const std::filesystem::path& mapping);

// Writes FOLDER/NAME as a trial of the exchange format and returns its folder. Throws BadInput naming file and key, and
// where the folder is there already; nothing half-written is left.
std::filesystem::path import_recording(const std::filesystem::path& mapping, const std::filesystem::path& folder);

}  // namespace selvedge::station
