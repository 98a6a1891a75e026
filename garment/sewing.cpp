#include "garment/sewing.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>

#include <Eigen/Geometry>

#include "cloth/bend_matrix.h"
#include "cloth/bordered_sheet.h"
#include "files/bad_input.h"
#include "garment/panel_mesh.h"

namespace selvedge::garment {

namespace {

constexpr double kBorder = 4.5;  // spacings beyond a seam that stencils may reach

// The panels' own vertices, one after the other, and the garment's vertex that each is.
struct Sewn {
  std::vector<PanelMesh> panels;
  std::vector<int> first;   // of each panel, among all panels' vertices
  std::vector<int> vertex;  // the garment's
  int vertex_count = 0;

  int operator()(size_t panel, int local) const { return vertex[static_cast<size_t>(first[panel] + local)]; }
};

std::vector<int> seam_vertices(const Sewn& sewn, const PanelEdge& edge, bool reversed) {
  std::vector<int> out = sewn.panels[static_cast<size_t>(edge.panel)].along(edge.edge);
  if (reversed) std::reverse(out.begin(), out.end());
  return out;
}

Sewn join_vertices(const Pattern& pattern) {
  Sewn sewn;
  sewn.panels = mesh_panels(pattern);
  int count = 0;
  for (const PanelMesh& panel : sewn.panels) {
    sewn.first.push_back(count);
    count += panel.columns * panel.rows;
  }
  std::vector<int> parent(static_cast<size_t>(count));
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int v) {
    while (parent[static_cast<size_t>(v)] != v) v = parent[static_cast<size_t>(v)];
    return v;
  };
  for (const Seam& seam : pattern.seams) {
    const std::vector<int> a = seam_vertices(sewn, seam.first, false),
                           b = seam_vertices(sewn, seam.second, seam.reversed);
    for (size_t i = 0; i < a.size(); ++i) {
      const int one = root(sewn.first[static_cast<size_t>(seam.first.panel)] + a[i]),
                two = root(sewn.first[static_cast<size_t>(seam.second.panel)] + b[i]);
      parent[static_cast<size_t>(std::max(one, two))] = std::min(one, two);
    }
  }
  sewn.vertex.resize(static_cast<size_t>(count));
  for (int v = 0; v < count; ++v)
    sewn.vertex[static_cast<size_t>(v)] =
        root(v) == v ? sewn.vertex_count++ : sewn.vertex[static_cast<size_t>(root(v))];
  return sewn;
}

// Each edge, in one direction, belongs to one triangle.
void check_seams(const Pattern& pattern, const Sewn& sewn) {
  std::map<std::array<int, 2>, int> seen;
  for (size_t p = 0; p < sewn.panels.size(); ++p)
    for (const auto& t : sewn.panels[p].mesh.triangles)
      for (size_t k = 0; k < 3; ++k) {
        const int from = sewn(p, t[k]), to = sewn(p, t[(k + 1) % 3]);
        const auto [other, is_new] = seen.emplace(std::array<int, 2>{from, to}, static_cast<int>(p));
        if (from == to || !is_new)
          refuse(pattern.where + ": seams",
                 "found panels {} and {} sewn inside out or an edge sewn twice, expected each edge once, and "
                 "\"reversed\" where ends meet starts",
                 in_quotes(pattern.panels[static_cast<size_t>(other->second)].name), in_quotes(pattern.panels[p].name));
      }
}

// A panel with what lies beyond its seams, laid flat beside it.
struct WithBorder {
  geometry::TriangleMesh mesh;
  std::vector<int> vertex;  // the garment's, of every point
};

void add_border(const Sewn& sewn, const PanelEdge& here, const PanelEdge& there, bool reversed, double reach_m,
                WithBorder& out) {
  const auto &own = sewn.panels[static_cast<size_t>(here.panel)].mesh.rest_uv,
             &other = sewn.panels[static_cast<size_t>(there.panel)].mesh.rest_uv;
  const std::vector<int> a = seam_vertices(sewn, here, false), b = seam_vertices(sewn, there, reversed);
  for (size_t q = 0; q < other.size(); ++q) {
    if (std::find(b.begin(), b.end(), static_cast<int>(q)) != b.end()) continue;
    double nearest = reach_m;
    size_t segment = b.size();
    for (size_t k = 0; k + 1 < b.size(); ++k) {
      const double distance =
          (other[q] - (other[static_cast<size_t>(b[k])] + other[static_cast<size_t>(b[k + 1])]) / 2).norm();
      if (distance < nearest) nearest = distance, segment = k;
    }
    if (segment == b.size()) continue;
    const Eigen::Vector2d &a0 = own[static_cast<size_t>(a[segment])], &a1 = own[static_cast<size_t>(a[segment + 1])];
    const Eigen::Vector2d &b0 = other[static_cast<size_t>(b[segment])],
                          &b1 = other[static_cast<size_t>(b[segment + 1])];
    const double angle = std::atan2((a1 - a0).y(), (a1 - a0).x()) - std::atan2((b1 - b0).y(), (b1 - b0).x());
    out.mesh.rest_uv.push_back((a0 + a1) / 2 + Eigen::Rotation2Dd(angle) * (other[q] - (b0 + b1) / 2));
    out.vertex.push_back(sewn(static_cast<size_t>(there.panel), static_cast<int>(q)));
  }
}

WithBorder with_border(const Pattern& pattern, const Sewn& sewn, size_t panel) {
  WithBorder out;
  out.mesh = sewn.panels[panel].mesh;
  for (size_t i = 0; i < out.mesh.rest_uv.size(); ++i) out.vertex.push_back(sewn(panel, static_cast<int>(i)));
  for (const Seam& seam : pattern.seams) {
    const double reach_m = kBorder * pattern.spacing_m;
    if (seam.first.panel == static_cast<int>(panel))
      add_border(sewn, seam.first, seam.second, seam.reversed, reach_m, out);
    if (seam.second.panel == static_cast<int>(panel))
      add_border(sewn, seam.second, seam.first, seam.reversed, reach_m, out);
  }
  return out;
}

// Stencil rows of a panel's vertices that no panel before it has given.
void take_stencils(const cloth::kernel::BendStencils& from, const WithBorder& panel, size_t own,
                   std::vector<bool>& given, std::vector<std::vector<std::array<double, 4>>>& rows) {
  for (size_t i = 0; i < own; ++i) {
    const auto v = static_cast<size_t>(panel.vertex[i]);
    if (given[v]) continue;
    given[v] = true;
    for (int k = from.start[i]; k < from.start[i + 1]; ++k) {
      const auto at = static_cast<size_t>(k);
      rows[v].push_back({static_cast<double>(panel.vertex[static_cast<size_t>(from.index[at])]), from.uu[at],
                         from.uv[at], from.vv[at]});
    }
  }
}

void fill_bending(const std::vector<std::vector<std::array<double, 4>>>& rows, cloth::kernel::SheetData& s) {
  s.bend.start = {0};
  for (const auto& row : rows) {
    for (const auto& [index, uu, uv, vv] : row) {
      s.bend.index.push_back(static_cast<int>(index));
      s.bend.uu.push_back(uu);
      s.bend.uv.push_back(uv);
      s.bend.vv.push_back(vv);
    }
    s.bend.start.push_back(static_cast<int>(s.bend.index.size()));
  }
  s.bend_matrix = cloth::make_bend_matrix(s);
}

cloth::Sheet make_sheet(const Pattern& pattern, const Sewn& sewn) {
  cloth::Sheet sheet;
  cloth::kernel::SheetData& s = sheet.data;
  const auto n = static_cast<size_t>(sewn.vertex_count);
  s.vertex_count = sewn.vertex_count;
  s.vertex_area.assign(n, 0);
  s.vertex_u.assign(n, 0);
  s.vertex_v.assign(n, 0);
  s.rim_distance.assign(n, 1);  // no hem: the base model of the fabric everywhere
  sheet.mesh.rest_uv.resize(n);
  std::vector<bool> given(n, false);
  std::vector<std::vector<std::array<double, 4>>> rows(n);
  double area = 0;
  for (size_t p = 0; p < sewn.panels.size(); ++p) {
    const WithBorder panel = with_border(pattern, sewn, p);
    const size_t own = sewn.panels[p].mesh.rest_uv.size();
    const cloth::kernel::SheetData data = cloth::make_bordered_sheet(panel.mesh, static_cast<int>(own)).data;
    for (size_t i = 0; i < own; ++i) {
      const auto v = static_cast<size_t>(panel.vertex[i]);
      s.vertex_area[v] += data.vertex_area[i];
      s.vertex_u[v] = data.vertex_u[i];
      s.vertex_v[v] = data.vertex_v[i];
      sheet.mesh.rest_uv[v] = panel.mesh.rest_uv[i];
    }
    for (cloth::kernel::Triangle t : data.triangles) {
      for (int& v : t.vertex) v = panel.vertex[static_cast<size_t>(v)];
      s.triangles.push_back(t);
      sheet.mesh.triangles.push_back({t.vertex[0], t.vertex[1], t.vertex[2]});
      area += t.membrane_area;
    }
    take_stencils(data.bend, panel, own, given, rows);
  }
  s.width_m = s.height_m = sheet.mesh.width_m = sheet.mesh.height_m = std::sqrt(area);
  fill_bending(rows, s);
  return sheet;
}

cloth::contact::Surface make_surface(const Sewn& sewn) {
  std::vector<std::array<int, 3>> triangles;
  std::vector<std::array<Eigen::Vector2d, 3>> flat;
  std::vector<int> panel;
  for (size_t p = 0; p < sewn.panels.size(); ++p)
    for (const auto& t : sewn.panels[p].mesh.triangles) {
      const auto& uv = sewn.panels[p].mesh.rest_uv;
      triangles.push_back({sewn(p, t[0]), sewn(p, t[1]), sewn(p, t[2])});
      flat.push_back({uv[static_cast<size_t>(t[0])], uv[static_cast<size_t>(t[1])], uv[static_cast<size_t>(t[2])]});
      panel.push_back(static_cast<int>(p));
    }
  return cloth::contact::make_surface(sewn.vertex_count, std::move(triangles), std::move(flat), std::move(panel));
}

Eigen::Matrix3Xd standing_shape(const Pattern& pattern, const Sewn& sewn) {
  const int rows = sewn.panels[0].rows;
  for (size_t p = 0; p < sewn.panels.size(); ++p)
    if (sewn.panels[p].rows != rows)
      refuse(pattern.where + ": seams",
             "found panel {} with {} rows of vertices beside {} in the first, expected panels sewn side to side",
             in_quotes(pattern.panels[p].name), sewn.panels[p].rows, rows);
  const PanelMesh& last = sewn.panels.back();
  const bool closed = sewn(sewn.panels.size() - 1, last.columns - 1) == sewn(0, 0);
  Eigen::Matrix3Xd x(3, sewn.vertex_count);
  double height = 0, radius_above = 0;
  for (int r = 0; r < rows; ++r) {
    double around = 0, down = 0;
    int columns = 0;
    const auto uv = [&](const PanelMesh& m, int row, int c) {
      return m.mesh.rest_uv[static_cast<size_t>(row * m.columns + c)];
    };
    for (const PanelMesh& m : sewn.panels)
      for (int c = 0; c < m.columns; ++c, ++columns) {
        if (c > 0) around += (uv(m, r, c) - uv(m, r, c - 1)).norm();
        if (r > 0) down += (uv(m, r, c) - uv(m, r - 1, c)).norm();
      }
    const double full = (closed ? 2 : 1.95) * std::numbers::pi, radius = around / full;
    if (r > 0) {
      const double step = down / columns, out = radius - radius_above;
      height -= std::sqrt(std::max(step * step - out * out, 0.01 * step * step));
    }
    radius_above = radius;
    double gone = 0;
    for (size_t p = 0; p < sewn.panels.size(); ++p)
      for (int c = 0; c < sewn.panels[p].columns; ++c) {
        if (c > 0) gone += (uv(sewn.panels[p], r, c) - uv(sewn.panels[p], r, c - 1)).norm();
        const double angle = gone / radius;
        const int v = sewn(p, r * sewn.panels[p].columns + c);
        if (closed && p + 1 == sewn.panels.size() && c + 1 == sewn.panels[p].columns) continue;  // the first again
        x.col(v) = Eigen::Vector3d(radius * std::cos(angle), radius * std::sin(angle), height);
      }
  }
  return x;
}

}  // namespace

Garment sew(const Pattern& pattern) {
  const Sewn sewn = join_vertices(pattern);
  check_seams(pattern, sewn);
  Garment g;
  g.sheet = make_sheet(pattern, sewn);
  g.surface = make_surface(sewn);
  for (const PanelEdge& edge : pattern.held)
    for (const int local : sewn.panels[static_cast<size_t>(edge.panel)].along(edge.edge))
      g.held.push_back(sewn(static_cast<size_t>(edge.panel), local));
  std::sort(g.held.begin(), g.held.end());
  g.held.erase(std::unique(g.held.begin(), g.held.end()), g.held.end());
  g.standing = standing_shape(pattern, sewn);
  return g;
}

}  // namespace selvedge::garment
