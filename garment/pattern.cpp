#include "garment/pattern.h"

#include <cmath>

namespace selvedge::garment {

namespace {

// Part of a circle about the origin, angles from straight down the plane's v axis.
Line arc(double radius_m, double half_angle) {
  Line line;
  constexpr int kPieces = 24;
  for (int i = 0; i <= kPieces; ++i) {
    const double angle = half_angle * (2.0 * i / kPieces - 1);
    line.emplace_back(radius_m * std::sin(angle), radius_m * std::cos(angle));
  }
  return line;
}

}  // namespace

double length_of(const Line& line) {
  double sum = 0;
  for (size_t i = 0; i + 1 < line.size(); ++i) sum += (line[i + 1] - line[i]).norm();
  return sum;
}

Eigen::Vector2d point_at(const Line& line, double share) {
  double left = share * length_of(line);
  for (size_t i = 0; i + 1 < line.size(); ++i) {
    const double piece = (line[i + 1] - line[i]).norm();
    if (left <= piece && piece > 0) return line[i] + left / piece * (line[i + 1] - line[i]);
    left -= piece;
  }
  return line.back();
}

const Line& line_of(const Panel& panel, Edge edge) {
  switch (edge) {
    case Edge::top: return panel.top;
    case Edge::bottom: return panel.bottom;
    case Edge::left: return panel.left;
    case Edge::right: break;
  }
  return panel.right;
}

Panel make_gore(const std::string& name, double top_m, double bottom_m, double length_m) {
  Panel p;
  p.name = name;
  const double angle = (bottom_m - top_m) / length_m;
  if (std::abs(angle) < 1e-6) {
    p.top = {{0, 0}, {top_m, 0}};
    p.bottom = {{0, length_m}, {top_m, length_m}};
  } else {
    p.top = arc(top_m / angle, angle / 2);
    p.bottom = arc(top_m / angle + length_m, angle / 2);
  }
  p.left = {p.top.front(), p.bottom.front()};
  p.right = {p.top.back(), p.bottom.back()};
  return p;
}

Pattern make_gored_skirt(int gores, double waist_m, double hem_m, double length_m, double spacing_m) {
  Pattern pattern;
  pattern.spacing_m = spacing_m;
  for (int i = 0; i < gores; ++i) {
    pattern.panels.push_back(make_gore("gore" + std::to_string(i + 1), waist_m / gores, hem_m / gores, length_m));
    pattern.seams.push_back({{i, Edge::right}, {(i + 1) % gores, Edge::left}, false, 0});
    pattern.held.push_back({i, Edge::top});
  }
  pattern.held_by = "Hips";
  pattern.where = "a skirt of gores";
  return pattern;
}

}  // namespace selvedge::garment
