#include "diagnose/fabric_map.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace selvedge::diagnose {

std::string fabric_map(const ResidualMap& map) {
  constexpr double kWidth = 360, kMargin = 24;
  const double scale = kWidth / map.width_m, height = scale * map.height_m;
  double most = 1e-9;
  for (const double mm : map.at_mm) most = std::max(most, mm);
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.0f}\" height=\"{1:.0f}\" viewBox=\"0 0 {0:.0f} {1:.0f}\" "
      "font-family=\"sans-serif\" "
      "font-size=\"11\"><rect x=\"{2:.0f}\" y=\"{2:.0f}\" width=\"{3:.1f}\" height=\"{4:.1f}\" fill=\"#fff\" "
      "stroke=\"#444\"/>"
      "<line x1=\"{2:.0f}\" y1=\"{2:.0f}\" x2=\"{5:.1f}\" y2=\"{2:.0f}\" stroke=\"#000\" stroke-width=\"4\"/>",
      kWidth + 2 * kMargin, height + 2 * kMargin, kMargin, kWidth, height, kMargin + kWidth);
  const double largest = 0.42 * kWidth / std::max(2.0, std::sqrt(static_cast<double>(map.uv.size())));
  for (size_t i = 0; i < map.uv.size(); ++i) {
    const double share = map.at_mm[i] / most, x = kMargin + scale * map.uv[i].x(), y = kMargin + scale * map.uv[i].y();
    const int shade = static_cast<int>(std::lround(230 - 190 * share));
    svg += fmt::format(
        "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:.1f}\" fill=\"rgb({},{},{})\"/><text x=\"{:.1f}\" y=\"{:.1f}\" "
        "text-anchor=\"middle\" fill=\"{}\">{:.2f}</text>",
        x, y, largest * std::sqrt(share), 255 - (230 - shade) / 4, shade, shade, x, y + 4,
        share > 0.5 ? "#fff" : "#000", map.at_mm[i]);
  }
  return svg + "</svg>";
}

}  // namespace selvedge::diagnose
