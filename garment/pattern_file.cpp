// read_pattern: the "garment/1" file.
#include <algorithm>
#include <cmath>

#include "cloth/material_parameters.h"
#include "files/bad_input.h"
#include "files/json_reader.h"
#include "garment/pattern.h"

namespace selvedge::garment {

namespace {

using files::JsonReader;

const std::vector<std::string> kEdges = {"top", "bottom", "left", "right"};

Line read_line(const JsonReader& json, const std::string& key) {
  const nlohmann::json& points = json.value(key);
  if (!points.is_array() || points.size() < 2)
    refuse(json.where(key), "found {}, expected at least two points [x, y] in m", files::shown(points));
  Line line;
  for (const nlohmann::json& point : points) {
    const std::vector<double> xy = files::finite_numbers(point, 2, json.where(key));
    line.emplace_back(xy[0], xy[1]);
  }
  if (!(length_of(line) > 0)) refuse(json.where(key), "found a line of no length, expected an edge");
  return line;
}

Panel read_panel(const JsonReader& json) {
  json.allow_only({"name", "gore", "top", "bottom", "left", "right"});
  const std::string name = json.text("name");
  if (json.has("gore")) {
    const JsonReader gore = json.child("gore");
    gore.allow_only({"top_m", "bottom_m", "length_m"});
    return make_gore(name, gore.positive("top_m"), gore.positive("bottom_m"), gore.positive("length_m"));
  }
  Panel p;
  p.name = name;
  p.top = read_line(json, "top");
  p.bottom = read_line(json, "bottom");
  p.left = json.has("left") ? read_line(json, "left") : Line{p.top.front(), p.bottom.front()};
  p.right = json.has("right") ? read_line(json, "right") : Line{p.top.back(), p.bottom.back()};
  for (const auto& [corner, one, two] : {std::tuple{"top left", p.top.front(), p.left.front()},
                                         {"top right", p.top.back(), p.right.front()},
                                         {"bottom left", p.bottom.front(), p.left.back()},
                                         {"bottom right", p.bottom.back(), p.right.back()}})
    if ((one - two).norm() > 1e-6)
      refuse(json.where("name"), "found edges of {} that do not meet at its {} corner, expected them to",
             in_quotes(name), corner);
  return p;
}

// "front.left".
PanelEdge read_edge(const Pattern& pattern, const std::string& text, const std::string& where) {
  const size_t dot = text.rfind('.');
  const std::string name = text.substr(0, dot), edge = dot == std::string::npos ? "" : text.substr(dot + 1);
  const auto side = std::find(kEdges.begin(), kEdges.end(), edge);
  for (size_t i = 0; i < pattern.panels.size(); ++i)
    if (pattern.panels[i].name == name && side != kEdges.end())
      return {static_cast<int>(i), static_cast<Edge>(side - kEdges.begin())};
  refuse(where, "found {}, expected PANEL.top, .bottom, .left or .right of a panel in this file", in_quotes(text));
}

// Parameters by name, of a fit or written out; what is not named keeps its default.
void read_fabric(const JsonReader& json, cloth::Material& m) {
  std::vector<std::pair<std::string, double*>> known = {{"density", &m.density}};
  for (const cloth::MaterialParameter& p : cloth::material_parameters()) known.emplace_back(p.name, &(m.*p.member));
  const JsonReader fabric = json.child("fabric");
  std::vector<std::string> names = {"fit"};
  for (const auto& [name, value] : known) names.push_back(name);
  fabric.allow_only(names);
  if (fabric.has("fit")) {
    const std::filesystem::path path = std::filesystem::path(json.path()).parent_path() / fabric.text("fit");
    const JsonReader parameters = JsonReader(path).child("parameters");
    for (const auto& [name, value] : known)
      if (parameters.has(name)) *value = parameters.child(name).number("value");
  }
  for (const auto& [name, value] : known)
    if (fabric.has(name)) *value = fabric.not_negative_or(name, *value);
  if (!(m.density > 0)) refuse(fabric.where("density"), "found {}, expected a number above 0, kg/m²", m.density);
}

Seam read_seam(const Pattern& pattern, const JsonReader& json) {
  json.allow_only({"sew", "reversed"});
  const std::vector<std::string> edges = json.texts("sew");
  if (edges.size() != 2) refuse(json.where("sew"), "found {} edges, expected two", edges.size());
  Seam seam{read_edge(pattern, edges[0], json.where("sew")), read_edge(pattern, edges[1], json.where("sew")),
            json.truth_or("reversed", false), 0};
  const double first = length_of(line_of(pattern.panels[static_cast<size_t>(seam.first.panel)], seam.first.edge));
  const double second = length_of(line_of(pattern.panels[static_cast<size_t>(seam.second.panel)], seam.second.edge));
  seam.ease = second / first - 1;
  if (std::abs(seam.ease) > 0.2)
    refuse(json.where("sew"), "found edges of {:.3f} and {:.3f} m, expected lengths within a fifth of each other",
           first, second);
  return seam;
}

// A spacing that is too fine, or an edge that is too long, would take all memory once it is meshed.
void require_meshable(const JsonReader& json, const Pattern& pattern) {
  constexpr double kMostVertices = 1e6;
  double vertices = 0;
  for (const Panel& p : pattern.panels)
    vertices += std::max(length_of(p.top), length_of(p.bottom)) / pattern.spacing_m *
                std::max(length_of(p.left), length_of(p.right)) / pattern.spacing_m;
  if (!(vertices <= kMostVertices))
    refuse(json.where("spacing_m"), "found a spacing of {} m, which takes {:.3g} vertices, expected at most {:.0g}",
           pattern.spacing_m, vertices, kMostVertices);
}

}  // namespace

Pattern read_pattern(const std::filesystem::path& path, double spacing_m) {
  const JsonReader json(path);
  json.allow_only({"format", "fabric", "spacing_m", "panels", "seams", "held", "held_by", "held_above_m", "friction",
                   "body_friction", "limbs", "motion"});
  json.choice("format", {"garment/1"});
  Pattern pattern;
  pattern.where = path.string();
  if (json.has("fabric")) read_fabric(json, pattern.fabric);
  pattern.spacing_m = spacing_m > 0 ? spacing_m : json.positive("spacing_m");
  for (const JsonReader& panel : json.children("panels")) pattern.panels.push_back(read_panel(panel));
  if (pattern.panels.empty()) refuse(json.where("panels"), "found none, expected at least one");
  require_meshable(json, pattern);
  for (const JsonReader& seam : json.children("seams")) pattern.seams.push_back(read_seam(pattern, seam));
  for (const std::string& edge : json.texts("held"))
    pattern.held.push_back(read_edge(pattern, edge, json.where("held")));
  if (pattern.held.empty()) refuse(json.where("held"), "found none, expected the edges that the body holds");
  pattern.held_by = json.text("held_by");
  pattern.held_above_m = json.number_or("held_above_m", 0);
  pattern.friction = json.not_negative_or("friction", pattern.friction);
  pattern.body_friction = json.not_negative_or("body_friction", pattern.body_friction);
  return pattern;
}

}  // namespace selvedge::garment
