#include "cloth/sheet.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <stdexcept>

#include <Eigen/Dense>
#include <Eigen/Sparse>

namespace selvedge::cloth {

namespace {

kernel::Triangle make_triangle(const geometry::TriangleMesh& mesh, const std::array<int, 3>& corners) {
  kernel::Triangle t{};
  Eigen::Matrix2d sides;
  const auto at = [&](int k) { return mesh.rest_uv[static_cast<size_t>(corners[static_cast<size_t>(k)])]; };
  sides << at(1) - at(0), at(2) - at(0);
  const double twice_area = std::abs(sides.determinant());
  if (!(twice_area > 0)) throw std::invalid_argument("make_sheet: a triangle has no area");
  const Eigen::Matrix2d inverse = sides.inverse();  // rows: gradients of the shape functions of corners 1, 2
  for (int k = 0; k < 3; ++k) t.vertex[k] = corners[static_cast<size_t>(k)];
  for (int k = 1; k < 3; ++k) {
    t.gradient_u[k] = inverse(k - 1, 0);
    t.gradient_v[k] = inverse(k - 1, 1);
  }
  t.gradient_u[0] = -t.gradient_u[1] - t.gradient_u[2];
  t.gradient_v[0] = -t.gradient_v[1] - t.gradient_v[2];
  t.area = twice_area / 2;
  return t;
}

// Second derivatives at `centre` from the neighbours within `radius`: weighted least squares for the five
// coefficients of a quadratic through the centre. Empty where they do not determine it well.
Eigen::Matrix<double, 3, Eigen::Dynamic> fit_quadratic(const std::vector<Eigen::Vector2d>& uv, int centre,
                                                       const std::vector<int>& neighbours, double spacing) {
  const auto count = static_cast<Eigen::Index>(neighbours.size());
  if (count < 7) return {};
  Eigen::MatrixXd design(count, 5);
  Eigen::VectorXd weight(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const Eigen::Vector2d d =
        (uv[static_cast<size_t>(neighbours[static_cast<size_t>(k)])] - uv[static_cast<size_t>(centre)]) / spacing;
    weight(k) = std::exp(-0.5 * d.squaredNorm());
    design.row(k) << d.x(), d.y(), 0.5 * d.x() * d.x(), d.x() * d.y(), 0.5 * d.y() * d.y();
    design.row(k) *= weight(k);
  }
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(design, Eigen::ComputeThinU | Eigen::ComputeThinV);
  if (svd.singularValues()(4) < 0.05 * svd.singularValues()(0)) return {};
  const Eigen::MatrixXd inverse = svd.solve(Eigen::MatrixXd(weight.asDiagonal()));  // 5 × count
  return inverse.bottomRows<3>() / (spacing * spacing);
}

void add_stencil(kernel::BendStencils& bend, const std::vector<Eigen::Vector2d>& uv, int centre, double spacing) {
  for (double reach = 1.6; reach < 4.5; reach += 0.3) {
    std::vector<int> neighbours;
    for (size_t j = 0; j < uv.size(); ++j)
      if (static_cast<int>(j) != centre && (uv[j] - uv[static_cast<size_t>(centre)]).norm() < reach * spacing)
        neighbours.push_back(static_cast<int>(j));
    const auto rows = fit_quadratic(uv, centre, neighbours, spacing);
    if (rows.cols() == 0) continue;
    for (size_t k = 0; k < neighbours.size(); ++k) {
      bend.index.push_back(neighbours[k]);
      bend.uu.push_back(rows(0, static_cast<Eigen::Index>(k)));
      bend.uv.push_back(rows(1, static_cast<Eigen::Index>(k)));
      bend.vv.push_back(rows(2, static_cast<Eigen::Index>(k)));
    }
    bend.index.push_back(centre);
    bend.uu.push_back(-rows.row(0).sum());
    bend.uv.push_back(-rows.row(1).sum());
    bend.vv.push_back(-rows.row(2).sum());
    bend.start.push_back(static_cast<int>(bend.index.size()));
    return;
  }
  throw std::invalid_argument("make_sheet: too few vertices for second derivatives");
}

kernel::BendMatrix make_bend_matrix(const kernel::SheetData& s) {
  using Sparse = Eigen::SparseMatrix<double, Eigen::RowMajor>;
  const auto second_derivative = [&](const std::vector<double>& weights, double factor) {
    std::vector<Eigen::Triplet<double>> entries;
    for (int i = 0; i < s.vertex_count; ++i)
      for (int k = s.bend.start[static_cast<size_t>(i)]; k < s.bend.start[static_cast<size_t>(i) + 1]; ++k)
        entries.emplace_back(i, s.bend.index[static_cast<size_t>(k)],
                             std::sqrt(factor * s.vertex_area[static_cast<size_t>(i)]) * weights[static_cast<size_t>(k)]);
    Sparse d(s.vertex_count, s.vertex_count);
    d.setFromTriplets(entries.begin(), entries.end());
    return d;
  };
  const Sparse uu = second_derivative(s.bend.uu, 1), uv = second_derivative(s.bend.uv, 2), vv = second_derivative(s.bend.vv, 1);
  Sparse q = Sparse(uu.transpose()) * uu + Sparse(uv.transpose()) * uv + Sparse(vv.transpose()) * vv;
  q.prune([scale = q.coeffs().abs().maxCoeff()](int, int, double value) { return std::abs(value) > 1e-13 * scale; });
  q.makeCompressed();
  kernel::BendMatrix matrix;
  matrix.start.assign(q.outerIndexPtr(), q.outerIndexPtr() + q.rows() + 1);
  matrix.index.assign(q.innerIndexPtr(), q.innerIndexPtr() + q.nonZeros());
  matrix.value.assign(q.valuePtr(), q.valuePtr() + q.nonZeros());
  return matrix;
}

// Largest eigenvalue of M⁻¹K by power iteration; apply: y = K x for vectors of `size` numbers.
double largest_eigenvalue(size_t size, const std::vector<double>& inverse_mass, size_t per_vertex,
                          const std::function<void(const Eigen::VectorXd&, Eigen::VectorXd&)>& apply) {
  Eigen::VectorXd x(static_cast<Eigen::Index>(size)), y(static_cast<Eigen::Index>(size));
  for (size_t i = 0; i < size; ++i)  // a rough start that holds every mode
    x(static_cast<Eigen::Index>(i)) = std::sin(12.9898 * static_cast<double>(i + 1)) + (i % 2 ? 0.5 : -0.5);
  double value = 0;
  for (int k = 0; k < 40; ++k) {
    x.normalize();
    apply(x, y);
    for (size_t i = 0; i < size; ++i) y(static_cast<Eigen::Index>(i)) *= inverse_mass[i / per_vertex];
    value = y.norm();
    x = y;
  }
  return 1.05 * value;  // forty iterations come within a few percent from below
}

double membrane_eigenvalue(const kernel::SheetData& s, const std::vector<double>& inverse_mass, double ku, double kv,
                           double c, double shear) {
  return largest_eigenvalue(2 * inverse_mass.size(), inverse_mass, 2, [&](const auto& x, auto& y) {
    y.setZero();
    for (const kernel::Triangle& t : s.triangles) {
      double eu = 0, ev = 0, g = 0;
      for (int a = 0; a < 3; ++a) {
        const double dx = x(2 * t.vertex[a]), dy = x(2 * t.vertex[a] + 1);
        eu += t.gradient_u[a] * dx;
        ev += t.gradient_v[a] * dy;
        g += t.gradient_v[a] * dx + t.gradient_u[a] * dy;
      }
      const double su = t.area * (ku * eu + c * ev), sv = t.area * (kv * ev + c * eu), tau = t.area * shear * g;
      for (int a = 0; a < 3; ++a) {
        y(2 * t.vertex[a]) += t.gradient_u[a] * su + t.gradient_v[a] * tau;
        y(2 * t.vertex[a] + 1) += t.gradient_v[a] * sv + t.gradient_u[a] * tau;
      }
    }
  });
}

double bend_eigenvalue(const kernel::SheetData& s, const std::vector<double>& inverse_mass) {
  return largest_eigenvalue(inverse_mass.size(), inverse_mass, 1, [&](const auto& x, auto& y) {
    y.setZero();
    for (size_t i = 0; i < inverse_mass.size(); ++i) {
      double uu = 0, uv = 0, vv = 0;
      for (int k = s.bend.start[i]; k < s.bend.start[i + 1]; ++k) {
        const auto j = static_cast<size_t>(k);
        const double value = x(s.bend.index[j]);
        uu += s.bend.uu[j] * value;
        uv += s.bend.uv[j] * value;
        vv += s.bend.vv[j] * value;
      }
      for (int k = s.bend.start[i]; k < s.bend.start[i + 1]; ++k) {
        const auto j = static_cast<size_t>(k);
        y(s.bend.index[j]) += s.vertex_area[i] * (s.bend.uu[j] * uu + 2 * s.bend.uv[j] * uv + s.bend.vv[j] * vv);
      }
    }
  });
}

// Leapfrog with lagged damping: ½ω²h² + ½λh·… stays stable for h below this; ω² stiffness, λ damping rate.
double step_for(double omega2, double lambda) {
  const double omega = std::sqrt(omega2), ratio = lambda / (2 * omega);
  return 2 / omega * (std::sqrt(1 + ratio * ratio) - ratio);
}

}  // namespace

Sheet make_sheet(const geometry::TriangleMesh& mesh) {
  Sheet sheet;
  sheet.mesh = mesh;
  kernel::SheetData& s = sheet.data;
  s.vertex_count = static_cast<int>(mesh.rest_uv.size());
  s.width_m = mesh.width_m;
  s.height_m = mesh.height_m;
  s.vertex_area.assign(mesh.rest_uv.size(), 0);
  for (const auto& corners : mesh.triangles) {
    s.triangles.push_back(make_triangle(mesh, corners));
    for (const int v : corners) s.vertex_area[static_cast<size_t>(v)] += s.triangles.back().area / 3;
  }
  for (const Eigen::Vector2d& uv : mesh.rest_uv) {
    s.vertex_u.push_back(uv.x());
    s.vertex_v.push_back(uv.y());
    s.rim_distance.push_back(
        std::max(0.0, std::min({uv.x(), mesh.width_m - uv.x(), uv.y(), mesh.height_m - uv.y()})));
  }
  const double area = std::accumulate(s.vertex_area.begin(), s.vertex_area.end(), 0.0);
  const double spacing = std::sqrt(2 * area / static_cast<double>(mesh.triangles.size()));
  s.bend.start.push_back(0);
  for (int i = 0; i < s.vertex_count; ++i) add_stencil(s.bend, mesh.rest_uv, i, spacing);
  s.bend_matrix = make_bend_matrix(s);
  return sheet;
}

double stable_step_s(const Sheet& sheet, const Material& m) {
  const kernel::SheetData& s = sheet.data;
  std::vector<double> inverse_mass;
  for (const double area : s.vertex_area) inverse_mass.push_back(1 / (m.density * area));
  const double ku = m.stretch * std::exp(m.stretch_anisotropy), kv = m.stretch * std::exp(-m.stretch_anisotropy);
  // Stiffening, friction and creep add to the tangent: strains stay below a tenth, and slopes add up.
  const double extra = (1 + 0.2 * std::max(0.0, m.stretch_stiffening)) * (1 + m.creep);
  const double friction = m.stretch_friction / m.stretch_friction_strain;
  const double stiff = membrane_eigenvalue(s, inverse_mass, ku * extra + friction, kv * extra + friction,
                                           m.coupling * std::sqrt(ku * kv), m.shear * extra + friction);
  const double damped = membrane_eigenvalue(s, inverse_mass, m.stretch_damping, m.stretch_damping, 0, m.shear_damping);
  const double bend_unit = bend_eigenvalue(s, inverse_mass);
  const double bend = m.bend * std::exp(std::abs(m.bend_anisotropy)) * (1 + m.hem_stiffness) *
                          (1 + 1e3 * std::max(0.0, m.bend_stiffening)) +
                      m.bend_friction / m.bend_friction_curvature;
  return 0.85 * std::min(step_for(stiff, damped), step_for(bend_unit * bend, bend_unit * m.bend_damping));
}

}  // namespace selvedge::cloth
