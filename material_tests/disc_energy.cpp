#include "material_tests/disc_energy.h"

#include <algorithm>
#include <cmath>

#include "cloth/stiffening.h"

namespace selvedge::material_tests {

namespace {

using cloth::Material;
using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kLeastBending = 0.05;
constexpr int kSpokesInBlock = 3;

struct Shape {
  Vector3d u = Vector3d::Zero(), v = u, uu = u, uv = u, vv = u;
};

std::array<Index, 16> reached(const DiscSheet& sheet, const DiscPoint& p) {
  std::array<Index, 16> index{};
  for (int k = 0; k < 16; ++k) index[static_cast<size_t>(k)] = sheet.index(p.first_spoke + k / 4, p.first_ring + k % 4);
  return index;
}

Shape shape_at(const DiscPoint& p, const std::array<Index, 16>& index, const Matrix3Xd& x) {
  Shape s;
  for (size_t k = 0; k < 16; ++k) {
    const Vector3d c = x.col(index[k]);
    s.u += p.u[k] * c;
    s.v += p.v[k] * c;
    s.uu += p.uu[k] * c;
    s.uv += p.uv[k] * c;
    s.vv += p.vv[k] * c;
  }
  return s;
}

struct Stretch {
  double energy, stress, stiffness;
};

Stretch stretched(double k, double stiffening, double strain) {
  return {k * cloth::stretch_energy(stiffening, strain), k * strain * cloth::stretch_factor(stiffening, strain),
          k * cloth::stretch_slope(stiffening, strain)};
}

// Softening of bending: G, its slope and the slope's slope by s.
struct Softening {
  double g, slope, change;
};

Softening softened(double gamma, double s) {
  const double floor_at = gamma < 0 ? (kLeastBending - 1) / gamma : INFINITY;
  if (s < floor_at) return {s + 0.5 * gamma * s * s, 1 + gamma * s, gamma};
  return {floor_at + 0.5 * gamma * floor_at * floor_at + kLeastBending * (s - floor_at), kLeastBending, 0};
}

// Density, and its first and second derivatives by (x_u, x_v), (x_uu, x_uv, x_vv).
struct Density {
  double energy = 0;
  Vector3d by_u = Vector3d::Zero(), by_v = by_u, by_uu = by_u, by_uv = by_u, by_vv = by_u;
  Matrix3d u_u = Matrix3d::Zero(), u_v = u_u, v_v = u_u;
  double uu = 0, uv = 0, vv = 0;  // times 1, of the second derivatives with themselves
  double softening = 0;           // times g gᵀ, g = κ_uu δuu + 2 κ_uv δuv + κ_vv δvv
};

void add_membrane(const Material& m, const Shape& s, bool convex, Density& d) {
  const double ku = m.stretch * std::exp(m.stretch_anisotropy), kv = m.stretch * std::exp(-m.stretch_anisotropy),
               c = m.coupling * std::sqrt(ku * kv);
  const double lu = s.u.norm(), lv = s.v.norm(), eu = lu - 1, ev = lv - 1, skew = s.u.dot(s.v);
  const Vector3d nu = s.u / lu, nv = s.v / lv;
  const Stretch along = stretched(ku, m.stretch_stiffening, eu), across = stretched(kv, m.stretch_stiffening, ev);
  d.energy += along.energy + across.energy + c * eu * ev + 0.5 * m.shear * skew * skew;
  const double su = along.stress + c * ev, sv = across.stress + c * eu;
  d.by_u = su * nu + m.shear * skew * s.v;
  d.by_v = sv * nv + m.shear * skew * s.u;
  const double tu = convex ? std::max(0.0, su) : su, tv = convex ? std::max(0.0, sv) : sv;
  const Matrix3d one = Matrix3d::Identity(), uu = nu * nu.transpose(), vv = nv * nv.transpose();
  d.u_u = along.stiffness * uu + tu / lu * (one - uu) + m.shear * s.v * s.v.transpose();
  d.v_v = across.stiffness * vv + tv / lv * (one - vv) + m.shear * s.u * s.u.transpose();
  d.u_v = c * nu * nv.transpose() + m.shear * s.v * s.u.transpose();
  if (!convex) d.u_v += m.shear * skew * one;
}

void add_bending(const Material& m, const Shape& s, bool convex, Density& d) {
  const double warp = std::exp(m.bend_anisotropy), weft = std::exp(-m.bend_anisotropy);
  const double uu = s.uu.squaredNorm(), uv = 2 * s.uv.squaredNorm(), vv = s.vv.squaredNorm(), sum = uu + uv + vv;
  const Softening g = softened(m.bend_stiffening, sum);
  d.energy += 0.5 * m.bend * (warp * uu + uv + weft * vv + g.g - sum);
  d.uu = m.bend * (warp + g.slope - 1);
  d.uv = 2 * m.bend * g.slope;
  d.vv = m.bend * (weft + g.slope - 1);
  d.by_uu = d.uu * s.uu;
  d.by_uv = d.uv * s.uv;
  d.by_vv = d.vv * s.vv;
  d.softening = convex ? std::max(0.0, 2 * m.bend * g.change) : 2 * m.bend * g.change;
  if (convex) {
    d.uu = std::max(0.0, d.uu);
    d.vv = std::max(0.0, d.vv);
  }
}

// Where numbers of the free control points stand in the ring of blocks.
struct Blocks {
  Index size;
  size_t count;
  // Null where the pair belongs to the other half.
  MatrixXd* of(RingMatrix& ring, Index row, Index column) const {
    const size_t r = static_cast<size_t>(row / size), c = static_cast<size_t>(column / size);
    if (r == c) return &ring.diagonal(r);
    return (c + 1) % count == r ? &ring.after(c) : nullptr;
  }
};

void add_point(const DiscPoint& p, const Shape& s, const Density& d, const std::array<Index, 16>& rows,
               const Blocks& blocks, VectorXd& slope, RingMatrix& curvature) {
  std::array<Vector3d, 16> soft;
  for (size_t k = 0; k < 16; ++k) soft[k] = p.uu[k] * s.uu + 2 * p.uv[k] * s.uv + p.vv[k] * s.vv;
  for (size_t k = 0; k < 16; ++k) {
    const Index row = rows[k];
    if (row < 0) continue;
    slope.segment<3>(row) +=
        p.weight * (p.u[k] * d.by_u + p.v[k] * d.by_v + p.uu[k] * d.by_uu + p.uv[k] * d.by_uv + p.vv[k] * d.by_vv);
    const Matrix3d by_u = p.weight * (p.u[k] * d.u_u + p.v[k] * d.u_v.transpose()),
                   by_v = p.weight * (p.u[k] * d.u_v + p.v[k] * d.v_v);
    const Vector3d pulled = p.weight * d.softening * soft[k];
    const double uu = p.weight * p.uu[k] * d.uu, uv = p.weight * p.uv[k] * d.uv, vv = p.weight * p.vv[k] * d.vv;
    for (size_t l = 0; l < 16; ++l) {
      if (rows[l] < 0) continue;
      MatrixXd* block = blocks.of(curvature, row, rows[l]);
      if (!block) continue;
      Matrix3d h = by_u * p.u[l] + by_v * p.v[l];
      if (d.softening != 0) h += pulled * soft[l].transpose();
      h.diagonal().array() += uu * p.uu[l] + uv * p.uv[l] + vv * p.vv[l];
      block->block<3, 3>(row % blocks.size, rows[l] % blocks.size) += h;
    }
  }
}

}  // namespace

Index DiscEnergy::place(Index point) const {
  const Index rings = sheet_.rings(), spoke = point / rings, ring = point % rings - kHeldRings;
  return ring < 0 ? -1 : 3 * (spoke * (rings - kHeldRings) + ring);
}

VectorXd DiscEnergy::masses() const {
  VectorXd mass(free());
  for (Index i = 0; i < sheet_.count(); ++i)
    if (place(i) >= 0) mass.segment<3>(place(i)).setConstant(m_.density * sheet_.areas()(i));
  return mass;
}

double DiscEnergy::value(const Matrix3Xd& control) const {
  double sum = kGravity_m_s2 * m_.density * control.row(2).dot(sheet_.areas());
  const auto add = [&](const std::vector<DiscPoint>& points, auto&& density) {
    for (const DiscPoint& p : points) {
      Density d;
      density(m_, shape_at(p, reached(sheet_, p), control), true, d);
      sum += p.weight * d.energy;
    }
  };
  add(sheet_.membrane_points(), add_membrane);
  add(sheet_.bending_points(), add_bending);
  return sum;
}

double DiscEnergy::derivatives(const Matrix3Xd& control, bool convex, VectorXd& slope, RingMatrix& curvature) const {
  slope = VectorXd::Zero(free());
  curvature.set_zero();
  double sum = kGravity_m_s2 * m_.density * control.row(2).dot(sheet_.areas());
  for (Index i = 0; i < sheet_.count(); ++i)
    if (place(i) >= 0) slope(place(i) + 2) += kGravity_m_s2 * m_.density * sheet_.areas()(i);
  const Blocks blocks{3 * kSpokesInBlock * Index(sheet_.rings() - kHeldRings),
                      static_cast<size_t>(sheet_.spokes() / kSpokesInBlock)};
  const auto add = [&](const std::vector<DiscPoint>& points, auto&& density) {
    for (const DiscPoint& p : points) {
      const std::array<Index, 16> index = reached(sheet_, p);
      const Shape s = shape_at(p, index, control);
      Density d;
      density(m_, s, convex, d);
      sum += p.weight * d.energy;
      std::array<Index, 16> rows;
      std::transform(index.begin(), index.end(), rows.begin(), [&](Index i) { return place(i); });
      add_point(p, s, d, rows, blocks, slope, curvature);
    }
  };
  add(sheet_.membrane_points(), add_membrane);
  add(sheet_.bending_points(), add_bending);
  return sum;
}

RingMatrix DiscEnergy::empty_curvature() const {
  return RingMatrix(sheet_.spokes() / kSpokesInBlock, 3 * kSpokesInBlock * (sheet_.rings() - kHeldRings));
}

}  // namespace selvedge::material_tests
