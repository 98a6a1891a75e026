// Recorded and simulated pictures, one over the other: a figure of a report in which the reader flips between the two,
// lays one over the other, sees their difference and comes nearer. It runs within the report's one file, offline; in
// print and without scripts the two lie side by side.
#pragma once

#include <string>
#include <vector>

namespace selvedge::report {

struct PicturePair {
  std::string name;
  std::string recorded, simulated;  // bytes of PNG files of one size
};

// HTML of the figure.
std::string flipped_pictures(const std::vector<PicturePair>& pairs);

}  // namespace selvedge::report
