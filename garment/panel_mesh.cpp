#include "garment/panel_mesh.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace selvedge::garment {

namespace {

// Directions of a grid: 0 across (top, bottom), 1 down (left, right).
int direction_of(Edge edge) { return edge == Edge::top || edge == Edge::bottom ? 0 : 1; }

// Cells along both directions of each panel, equal along what is sewn: sets of (panel, direction) joined by seams.
std::vector<std::array<int, 2>> count_cells(const Pattern& pattern) {
  const size_t n = pattern.panels.size();
  std::vector<size_t> set(2 * n);
  std::iota(set.begin(), set.end(), 0);
  for (const Seam& seam : pattern.seams) {
    const size_t a =
        set[2 * static_cast<size_t>(seam.first.panel) + static_cast<size_t>(direction_of(seam.first.edge))];
    const size_t b =
        set[2 * static_cast<size_t>(seam.second.panel) + static_cast<size_t>(direction_of(seam.second.edge))];
    std::replace(set.begin(), set.end(), b, a);
  }
  std::vector<double> length(2 * n, 0), members(2 * n, 0);
  for (size_t i = 0; i < n; ++i) {
    const Panel& p = pattern.panels[i];
    length[set[2 * i]] += (length_of(p.top) + length_of(p.bottom)) / 2;
    length[set[2 * i + 1]] += (length_of(p.left) + length_of(p.right)) / 2;
    members[set[2 * i]] += 1;
    members[set[2 * i + 1]] += 1;
  }
  std::vector<std::array<int, 2>> cells(n);
  for (size_t i = 0; i < n; ++i)
    for (size_t d = 0; d < 2; ++d) {
      const size_t s = set[2 * i + d];
      cells[i][d] = std::max(3, static_cast<int>(std::lround(length[s] / members[s] / pattern.spacing_m)));
    }
  return cells;
}

Eigen::Vector2d coons(const Panel& p, double s, double t) {
  const Eigen::Vector2d across = (1 - t) * point_at(p.top, s) + t * point_at(p.bottom, s);
  const Eigen::Vector2d down = (1 - s) * point_at(p.left, t) + s * point_at(p.right, t);
  const Eigen::Vector2d corners =
      (1 - t) * ((1 - s) * p.top.front() + s * p.top.back()) + t * ((1 - s) * p.bottom.front() + s * p.bottom.back());
  return across + down - corners;
}

}  // namespace

std::vector<int> PanelMesh::along(Edge edge) const {
  std::vector<int> out;
  const bool across = direction_of(edge) == 0;
  const int count = across ? columns : rows;
  for (int i = 0; i < count; ++i) {
    const int row = across ? (edge == Edge::top ? 0 : rows - 1) : i,
              column = across ? i : (edge == Edge::left ? 0 : columns - 1);
    out.push_back(row * columns + column);
  }
  return out;
}

std::vector<PanelMesh> mesh_panels(const Pattern& pattern) {
  const std::vector<std::array<int, 2>> cells = count_cells(pattern);
  std::vector<PanelMesh> out;
  for (size_t i = 0; i < pattern.panels.size(); ++i) {
    PanelMesh m;
    m.columns = cells[i][0] + 1;
    m.rows = cells[i][1] + 1;
    // The grid's triangles over another shape.
    m.mesh =
        geometry::make_grid_mesh(cells[i][0] * pattern.spacing_m, cells[i][1] * pattern.spacing_m, m.columns, m.rows);
    for (int r = 0; r < m.rows; ++r)
      for (int c = 0; c < m.columns; ++c)
        m.mesh.rest_uv[static_cast<size_t>(r * m.columns + c)] =
            coons(pattern.panels[i], static_cast<double>(c) / (m.columns - 1), static_cast<double>(r) / (m.rows - 1));
    out.push_back(std::move(m));
  }
  return out;
}

}  // namespace selvedge::garment
