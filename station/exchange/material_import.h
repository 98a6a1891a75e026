// Measurements of material tests as they come from instruments, cameras and other labs, as trials.
//
// cantilever: a midline as CSV (along_m, down_m, or along_mm, down_mm), a table of bending lengths as CSV
//   (bending_length_mm; angle_deg, overhang_mm where they are there), or a photograph from the side (JPEG, PNG).
// tensile: CSV with the columns force, and stretch_along, strain_along_percent or extension_mm; pull, time_s and
//   stretch_across or strain_across_percent where they are there; or HDF5 as of knits pulled under a camera (groups
//   with `forces` and `traj`, points × 2 × frames in px, beside clampSize and fabricSize in px).
// Columns have other names where `columns` says so.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "capture/trial/trial.h"
#include "station/exchange/pulls_hdf5.h"

namespace selvedge::station {

struct MaterialImport {
  std::filesystem::path file;
  std::string name;                        // of the trial; empty: the file's
  std::string fabric;                      // its name
  std::optional<double> areal_mass;        // kg/m²
  double width_m = 0.025, height_m = 0.2;  // of the strip
  std::optional<double> angle_deg;         // of its length from the warp
  // cantilever
  std::optional<double> overhang_m, bending_length_m;
  double mm_per_px = 0;
  std::optional<Eigen::Vector2d> edge_px;
  // tensile
  std::string force_unit = "N";
  double gauge_m = 0.1;
  PullsHdf5Options hdf5;
  std::map<std::string, std::string> columns;  // ours to theirs
};

// Trials of a strip over an edge; a table of bending lengths gives one a row. picture: of what was found in a
// photograph, PNG; else empty. Throws BadInput naming file and column, or the option that is missing.
struct ImportedStrips {
  std::vector<trial::Trial> trials;
  std::string picture;
};
ImportedStrips import_cantilever(const MaterialImport& from);

// One trial with all pulls of the file. Throws as above.
trial::Trial import_tensile(const MaterialImport& from);

// Writes FOLDER/NAME for each, and names them in FOLDER/campaign.json, which is made where there is none. Returns their
// folders. Throws BadInput where one is there already, or the campaign is of another fabric; nothing half-written is
// left.
std::vector<std::filesystem::path> add_to_campaign(const std::vector<trial::Trial>& trials,
                                                   const std::filesystem::path& folder);

// Millimetres a pixel of two points and what lies between them: "x1,y1,x2,y2=MM". Throws BadInput.
double mm_per_px_of(const std::string& scale);

}  // namespace selvedge::station
