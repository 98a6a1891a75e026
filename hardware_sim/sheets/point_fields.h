// What a sheet on two lines of points (point_line.h) is at its points, and the forces on nodes that pulls there make.
//
// Fields at points: three planes a row of points along u, each point down v beside the last: [point u][axis][point v].
// Fields at nodes: [node v][axis][node u]. In float.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "hardware_sim/sheets/point_line.h"

namespace selvedge::hardware_sim {

// out_p = Σ weight(p, k) in_(first(p) + k), rows of n numbers.
void combine(const LineRows& rows, const float* in, float* out, int n);
// Its transpose, added: in_(first(p) + k) += weight(p, k) out_p.
void hand_back(const LineRows& rows, const float* out, float* in, int n);

// Slopes of the nodes' place along u and v, second derivatives of another field of nodes, at points.
struct PointFields {
  std::vector<float> a, b, uu, vv, uv;
  std::vector<float> kink_u, kink_u_bend;  // [kink u][axis][point v]
  std::vector<float> kink_v, kink_v_bend;  // [point u][axis][kink v]
};

// How stretched a thread is, from y = |∂x/∂u|²: √y − 1 (Biot) or ½ ln y (Hencky). Shear, from the angle between
// threads: its sine with the first, its tangent with the second.
enum class StrainMeasure { biot, hencky };

// One strain at all points: now, and its stress, N/m.
struct PointStrain {
  std::vector<float> strain, stress;
};

class PointGrid {
 public:
  PointGrid() = default;
  PointGrid(PointLine along_u, PointLine down_v);

  const PointLine& u() const { return u_; }
  const PointLine& v() const { return v_; }
  int columns() const { return u_.nodes(); }
  int rows() const { return v_.nodes(); }
  size_t points() const { return static_cast<size_t>(u_.points()) * static_cast<size_t>(v_.points()); }
  const std::vector<float>& weight() const { return weight_; }  // m², of each point

  // place, bent: of nodes; slopes are of the first, second derivatives and kinks of the other.
  void look(const std::vector<float>& place, const std::vector<float>& bent, PointFields& out);
  // Forces on nodes of pulls at points, each already times the point's weight. force is overwritten.
  void gather(const PointFields& pulls, std::vector<float>& force);
  PointFields make_fields() const;

  // Of slopes a, b to strains.
  void strain(StrainMeasure measure, const PointFields& at, PointStrain& along, PointStrain& down,
              PointStrain& shear) const;
  // Stresses to pulls on a and b, times weights.
  void pull(StrainMeasure measure, const PointFields& at, const PointStrain& along, const PointStrain& down,
            const PointStrain& shear, PointFields& pulls) const;
  // Second derivatives and kinks to their own pulls, times weights: those of |x_uu|² + |x_vv|² + 2 |x_uv|² over two.
  void bend(const PointFields& at, PointFields& pulls) const;

 private:
  void to_columns(const std::vector<float>& down, int rows, std::vector<float>& out) const;
  void to_rows(const std::vector<float>& columns, int rows, std::vector<float>& out) const;

  PointLine u_, v_;
  std::vector<float> weight_, weight_u_, weight_v_, penalty_u_, penalty_v_;
  std::array<std::vector<float>, 7> down_, turned_;
};

}  // namespace selvedge::hardware_sim
