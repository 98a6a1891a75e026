// Sheets in motion: a figure of a report in which recorded points and simulated sheets move side by side in 3-D, turned
// by dragging, with a scrubber over time. It runs within the report's one file, offline.
#pragma once

#include <string>
#include <vector>

namespace selvedge::report {

using Points = std::vector<float>;  // x, y, z of each, m; NaN where one was not seen

// One way of simulating a recording.
struct SheetView {
  std::string name;
  std::vector<Points> sheet;     // one a time: across × across points, row by row down the sheet
  std::vector<Points> expected;  // one a time: where the model has what was seen; empty: not shown
};

// Arrows on a sheet for a while, fixed in the room.
struct Arrows {
  float from_s = 0, to_s = 0;
  Points mean, sd;  // one a place of MovingSheet::arrow_uv, in arrow_unit
};

struct MovingSheet {
  std::string name;
  int across = 0;
  std::vector<float> time_s;
  std::vector<Points> seen;      // one a time
  std::vector<SheetView> views;  // side by side
  std::vector<float> arrow_uv;   // u, v of each place, shares of width and height
  std::vector<Arrows> arrows;    // drawn on the last view
};

// HTML of the figure. Throws std::invalid_argument where a list has not one entry a time.
std::string moving_sheets(const std::vector<MovingSheet>& sheets, const std::string& arrow_name,
                          const std::string& arrow_unit);

}  // namespace selvedge::report
