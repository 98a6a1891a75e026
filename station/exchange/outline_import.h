// Outlines of Cusick drapes from above as trials: photographs (JPEG, PNG) or a CSV of a lab's own.
//
// A folder of pictures is one fabric: the last number of a file's name is the capture, what stands before it the
// sample, each a trial (sample-2-capture-3.jpg: capture 3 of sample-2). The fabric is darker or lighter than its
// background; its outline is where grey crosses half way. The scale is given, or found from the support's rim: where
// fabric falls steeply, the largest circle inside an outline is the support. A CSV has capture, x_m, y_m (or x_mm,
// y_mm) about the support's centre.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "capture/trial/trial.h"

namespace selvedge::station {

struct OutlineImport {
  std::filesystem::path source;
  std::string fabric;                          // its name
  std::optional<double> areal_mass;            // kg/m²
  double disc_m = 0.30, support_m = 0.18;      // diameters
  double mm_per_px = 0;                        // 0: from the support
  std::map<std::string, std::string> columns;  // of a CSV: ours to theirs
  std::optional<Eigen::Vector2d> centre_px;    // of the support; by default the pictures' middle
};

struct ImportedOutlines {
  std::vector<trial::Trial> trials;
  std::string scale;                                          // a sentence: what it is and where it comes from
  double mm_per_px = 0;                                       // of pictures
  std::vector<std::pair<std::string, std::string>> pictures;  // trial, PNG: outlines and support over its first picture
};

// Throws BadInput naming the file, or the option that is missing: a picture that shows no disc, a scale that the
// outlines do not tell.
ImportedOutlines import_cusick(const OutlineImport& from);

}  // namespace selvedge::station
