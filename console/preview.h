// The live picture as the console shows it: half the frame's size, with the fabric's silhouette and how plainly the
// stripes stand on it.
//
// Stripe quality of a tile of 16 px within the silhouette: the grey levels between its dark and its bright stripes
// (10th and 90th percentile), and the share of its pixels that are white out. Edges are found from 20 grey levels on
// (observe/stripe_observation.h).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace selvedge::console {

struct StripeTile {
  int x = 0, y = 0;      // of its top left corner, px of the frame
  int contrast = 0;      // grey levels
  double saturated = 0;  // share
};

struct LivePicture {
  int width_px = 0, height_px = 0;        // of the frame
  std::string png;                        // at half the size
  std::vector<std::vector<int>> outline;  // closed curves: x, y, x, y …, px of the frame
  std::vector<StripeTile> tiles;          // wholly inside the silhouette; empty without stripes
  double inside_share = 0;                // of the frame
};

inline constexpr int kTile_px = 16;

LivePicture live_picture(const std::vector<uint8_t>& pixels, int width_px, int height_px, bool stripes);
std::string overlay_json(const LivePicture& picture);

}  // namespace selvedge::console
