#include "cloth/energy.h"

#include <cmath>
#include <vector>

#include "cloth/kernel/vertex_parts.h"
#include "cloth/stiffening.h"

namespace selvedge::cloth {

namespace {

struct Columns {
  Eigen::Vector3d u = Eigen::Vector3d::Zero(), v = Eigen::Vector3d::Zero();
};

Columns columns_of(const kernel::Triangle& t, const Eigen::Matrix3Xd& y) {
  Columns c;
  for (int a = 0; a < 3; ++a) {
    c.u += t.gradient_u[a] * y.col(t.vertex[a]);
    c.v += t.gradient_v[a] * y.col(t.vertex[a]);
  }
  return c;
}

struct Seconds {
  Eigen::Vector3d uu = Eigen::Vector3d::Zero(), uv = Eigen::Vector3d::Zero(), vv = Eigen::Vector3d::Zero();
};

Seconds seconds_of(const kernel::BendStencils& b, size_t vertex, const Eigen::Matrix3Xd& y) {
  Seconds d;
  for (int k = b.start[vertex]; k < b.start[vertex + 1]; ++k) {
    const auto at = static_cast<size_t>(k);
    d.uu += b.uu[at] * y.col(b.index[at]);
    d.uv += b.uv[at] * y.col(b.index[at]);
    d.vv += b.vv[at] * y.col(b.index[at]);
  }
  return d;
}

// What arcs add to the u, shear and v strains of a triangle. shape: of all vertices.
Eigen::Vector3d longer_by(const kernel::SheetData& s, size_t triangle, const std::vector<Seconds>& shape) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  if (s.arcs.empty()) return sum;
  const kernel::ArcWeights<double>& a = s.arcs[triangle];
  for (const int corner : s.triangles[triangle].vertex) {
    const Seconds& d = shape[static_cast<size_t>(corner)];
    const double product[] = {d.uu.dot(d.uu), d.uu.dot(d.uv), d.uu.dot(d.vv),
                              d.uv.dot(d.uv), d.uv.dot(d.vv), d.vv.dot(d.vv)};
    for (size_t k = 0; k < 6; ++k) sum += product[k] / 3 * Eigen::Vector3d(a.u[k], a.shear[k], a.v[k]);
  }
  return sum;
}

}  // namespace

Eigen::VectorXd vertex_masses(const Sheet& sheet, const Material& material) {
  const std::vector<double> mass = kernel::vertex_masses(sheet.data, material);
  return Eigen::Map<const Eigen::VectorXd>(mass.data(), static_cast<Eigen::Index>(mass.size()));
}

Energy energy_of(const Sheet& sheet, const Material& m, const Eigen::Vector3d& gravity_m_s2,
                 const Eigen::Matrix3Xd& position, const Eigen::Matrix3Xd& velocity) {
  const kernel::SheetData& s = sheet.data;
  Energy e;
  const Eigen::VectorXd mass = vertex_masses(sheet, m);
  e.kinetic = 0.5 * velocity.colwise().squaredNorm() * mass;
  e.gravity = -gravity_m_s2.dot(position * mass);
  const double ku = m.stretch * std::exp(m.stretch_anisotropy), kv = m.stretch * std::exp(-m.stretch_anisotropy);
  std::vector<Seconds> shape;
  for (size_t i = 0; i < s.vertex_area.size(); ++i) shape.push_back(seconds_of(s.bend, i, position));
  for (size_t i = 0; i < s.triangles.size(); ++i) {
    const kernel::Triangle& t = s.triangles[i];
    const Columns w = columns_of(t, position);
    const Eigen::Vector3d longer = longer_by(s, i, shape);
    const double strain_u = w.u.norm() - 1 + longer(0), strain_v = w.v.norm() - 1 + longer(2),
                 skew = w.u.dot(w.v) + longer(1);
    e.stretch += t.membrane_area * (ku * stretch_energy(m.stretch_stiffening, strain_u) +
                                    kv * stretch_energy(m.stretch_stiffening, strain_v) +
                                    m.coupling * std::sqrt(ku * kv) * strain_u * strain_v);
    e.shear += t.membrane_area * 0.5 * m.shear * skew * skew;
  }
  for (size_t i = 0; i < s.vertex_area.size(); ++i) {
    const Seconds& d = shape[i];
    const double squared = d.uu.squaredNorm() + 2 * d.uv.squaredNorm() + d.vv.squaredNorm();
    const double b = m.bend_anisotropy;
    const double weighted =
        std::exp(b) * d.uu.squaredNorm() + 2 * d.uv.squaredNorm() + std::exp(-b) * d.vv.squaredNorm();
    e.bend += s.vertex_area[i] * m.bend * kernel::bend_factor(s, m, i) *
              (0.5 * weighted + 0.25 * m.bend_stiffening * squared * squared);
  }
  return e;
}

double damping_potential(const Sheet& sheet, const Material& m, const Eigen::Matrix3Xd& position,
                         const Eigen::Matrix3Xd& velocity) {
  const kernel::SheetData& s = sheet.data;
  double sum = 0;
  for (const kernel::Triangle& t : s.triangles) {
    const Columns w = columns_of(t, position), rate = columns_of(t, velocity);
    const double rate_u = w.u.dot(rate.u) / w.u.norm(), rate_v = w.v.dot(rate.v) / w.v.norm();
    const double skew_rate = w.u.dot(rate.v) + w.v.dot(rate.u);
    sum += 0.5 * t.membrane_area *
           (m.stretch_damping * (rate_u * rate_u + rate_v * rate_v) + m.shear_damping * skew_rate * skew_rate);
  }
  for (size_t i = 0; i < s.vertex_area.size(); ++i) {
    const Seconds d = seconds_of(s.bend, i, velocity);
    sum += 0.5 * s.vertex_area[i] * m.bend_damping * (d.uu.squaredNorm() + 2 * d.uv.squaredNorm() + d.vv.squaredNorm());
  }
  return sum;
}

}  // namespace selvedge::cloth
