// A garment as a tailor has it: flat panels, seams, and what holds it on the body.
//
// A panel is a patch with four edges in its plane (m): top and bottom from left to right, left and right from
// top to bottom. Its inside is the Coons patch of its edges (S. A. Coons, Surfaces for computer-aided design of
// space forms, 1967), meshed as a grid. Panels are listed as they go around the body, each sewn to the next; the
// first row of all of them lies at the top.
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "cloth/material.h"

namespace selvedge::garment {

using Line = std::vector<Eigen::Vector2d>;  // at least two points, m

struct Panel {
  std::string name;
  Line top, bottom, left, right;
};

enum class Edge { top, bottom, left, right };

struct PanelEdge {
  int panel = 0;
  Edge edge = Edge::top;
};

struct Seam {
  PanelEdge first, second;
  bool reversed = false;  // the end of one meets the start of the other
  double ease = 0;        // share by which the second is longer, worked in evenly; found when the file is read
};

struct Pattern {
  cloth::Material fabric;
  double spacing_m = 0.01;  // between vertices, about
  std::vector<Panel> panels;
  std::vector<Seam> seams;
  std::vector<PanelEdge> held;  // edges that move with the joint
  std::string held_by;          // joint's name
  double held_above_m = 0;      // height of the held edge over the joint at the start
  double friction = 0.3, body_friction = 0.3;
  std::string where;  // file, for errors
};

// Point at a share of the line's length, 0 to 1.
Eigen::Vector2d point_at(const Line& line, double share);
double length_of(const Line& line);

const Line& line_of(const Panel& panel, Edge edge);

// A sector of a ring: edges top and bottom of these lengths, sides of that length; a rectangle where they are
// equal.
Panel make_gore(const std::string& name, double top_m, double bottom_m, double length_m);

// A skirt of gores sewn side to side and held by its top.
Pattern make_gored_skirt(int gores, double waist_m, double hem_m, double length_m, double spacing_m);

// A "garment/1" file (docs/garment.md). Throws BadInput for unknown keys, panels or edges that are not there, and
// edges too unequal to be sewn. spacing_m > 0 overrides the file's.
Pattern read_pattern(const std::filesystem::path& path, double spacing_m = 0);

}  // namespace selvedge::garment
