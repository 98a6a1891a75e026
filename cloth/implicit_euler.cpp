#include "cloth/implicit_euler.h"

#include <array>
#include <cmath>

#include <Eigen/Sparse>
#include <Eigen/SparseCholesky>

#include "cloth/energy.h"
#include "cloth/filtered_step.h"
#include "cloth/held_motion.h"
#include "cloth/kernel/force_field.h"

namespace selvedge::cloth {

namespace {

using Sparse = Eigen::SparseMatrix<double>;
using Triplets = std::vector<Eigen::Triplet<double>>;

void add_block(Triplets& to, int i, int j, const Eigen::Matrix3d& block) {
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) to.emplace_back(3 * i + r, 3 * j + c, block(r, c));
}

// Stiffness and damping times their factors, in one matrix: stiffness_share K + damping_share D.
struct Shares {
  double stiffness, damping;
};

void add_triangle(const kernel::Triangle& t, const Material& m, const Eigen::Matrix3Xd& x, const Shares& share, Triplets& to) {
  Eigen::Vector3d w_u = Eigen::Vector3d::Zero(), w_v = Eigen::Vector3d::Zero();
  for (int a = 0; a < 3; ++a) {
    w_u += t.gradient_u[a] * x.col(t.vertex[a]);
    w_v += t.gradient_v[a] * x.col(t.vertex[a]);
  }
  const auto along = [&](const Eigen::Vector3d& w, double stiffness) -> Eigen::Matrix3d {
    const double length = w.norm(), geometric = std::max(0.0, 1 - 1 / length);
    const Eigen::Matrix3d direction = w * w.transpose() / (length * length);
    return t.membrane_area * ((share.stiffness * stiffness + share.damping * m.stretch_damping) * direction +
                     share.stiffness * stiffness * geometric * (Eigen::Matrix3d::Identity() - direction));
  };
  const Eigen::Matrix3d u = along(w_u, m.stretch * std::exp(m.stretch_anisotropy)),
                        v = along(w_v, m.stretch * std::exp(-m.stretch_anisotropy));
  const double skew = t.membrane_area * (share.stiffness * m.shear + share.damping * m.shear_damping);
  std::array<Eigen::Vector3d, 3> slope;
  for (size_t a = 0; a < 3; ++a) slope[a] = t.gradient_u[a] * w_v + t.gradient_v[a] * w_u;
  for (size_t a = 0; a < 3; ++a)
    for (size_t b = 0; b < 3; ++b)
      add_block(to, t.vertex[a], t.vertex[b],
                t.gradient_u[a] * t.gradient_u[b] * u + t.gradient_v[a] * t.gradient_v[b] * v + skew * slope[a] * slope[b].transpose());
}

// M + stiffness_share K + damping_share D.
Sparse system_matrix(const Sheet& sheet, const Material& m, const Eigen::VectorXd& mass, const Eigen::Matrix3Xd& x,
                     const Shares& share, bool with_mass) {
  const kernel::SheetData& s = sheet.data;
  Triplets entries;
  entries.reserve(s.triangles.size() * 81 + s.bend_matrix.value.size() * 3);
  for (const kernel::Triangle& t : s.triangles) add_triangle(t, m, x, share, entries);
  const double bend = share.stiffness * m.bend + share.damping * m.bend_damping;
  for (int i = 0; i < s.vertex_count; ++i) {
    for (int a = 0; a < 3 && with_mass; ++a) entries.emplace_back(3 * i + a, 3 * i + a, mass(i));
    for (int k = s.bend_matrix.start[static_cast<size_t>(i)]; k < s.bend_matrix.start[static_cast<size_t>(i) + 1]; ++k)
      for (int a = 0; a < 3; ++a)
        entries.emplace_back(3 * i + a, 3 * s.bend_matrix.index[static_cast<size_t>(k)] + a,
                             bend * s.bend_matrix.value[static_cast<size_t>(k)]);
  }
  Sparse matrix(3 * s.vertex_count, 3 * s.vertex_count);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

// Columns and rows of held numbers are replaced by the identity, their known change moved to the right side.
void prescribe(const std::vector<char>& is_held, const Eigen::VectorXd& change, Sparse& matrix, Eigen::VectorXd& right) {
  Eigen::VectorXd known = Eigen::VectorXd::Zero(right.size());
  for (Eigen::Index i = 0; i < right.size(); ++i)
    if (is_held[static_cast<size_t>(i)]) known(i) = change(i);
  right -= matrix * known;
  for (int c = 0; c < matrix.outerSize(); ++c)
    for (Sparse::InnerIterator at(matrix, c); at; ++at)
      if (is_held[static_cast<size_t>(at.row())] || is_held[static_cast<size_t>(at.col())])
        at.valueRef() = at.row() == at.col() ? 1 : 0;
  for (Eigen::Index i = 0; i < right.size(); ++i)
    if (is_held[static_cast<size_t>(i)]) right(i) = change(i);
}

}  // namespace

void run_implicit_euler(const Sheet& sheet, const Experiment& experiment, double step_s, Trajectory& trajectory) {
  const Material& m = experiment.material;
  const HeldMotion held(sheet, experiment);
  kernel::ForceField field(sheet.data, m, surroundings_of(experiment), held.vertices());
  const Eigen::VectorXd mass = vertex_masses(sheet, m);
  const Eigen::Index size = 3 * sheet.data.vertex_count;
  std::vector<char> is_held(static_cast<size_t>(size), 0);
  for (const kernel::HeldVertex& h : held.vertices())
    for (int a = 0; a < 3; ++a) is_held[static_cast<size_t>(3 * h.vertex + a)] = 1;
  const FilteredStep contact(sheet, experiment, held.vertices());
  Eigen::SimplicialLLT<Sparse> solver;
  bool analysed = false;

  Eigen::Matrix3Xd x = trajectory.start, v = Eigen::Matrix3Xd::Zero(3, x.cols()), acceleration(3, x.cols()), target = x, before = x;
  double t = experiment.start_s;
  for (const double sample : experiment.sample_s) {
    const int steps = std::max(1, static_cast<int>(std::ceil((sample - t) / step_s - 1e-9)));
    const double h = (sample - t) / steps;
    for (int k = 0; k < steps && h > 0; ++k) {
      field.accelerations(x.data(), v.data(), h, acceleration.data());
      Eigen::VectorXd right = (h * acceleration * mass.asDiagonal()).reshaped();
      right -= h * h * (system_matrix(sheet, m, mass, x, {1, 0}, false) * v.reshaped());
      Sparse matrix = system_matrix(sheet, m, mass, x, {h * h, h}, true);
      held.place(t + h, target);
      const Eigen::VectorXd change = ((target - x) / h - v).reshaped();
      prescribe(is_held, change, matrix, right);
      if (!analysed) solver.analyzePattern(matrix);
      analysed = true;
      solver.factorize(matrix);
      const Eigen::VectorXd solution = solver.solve(right);
      if (solver.info() != Eigen::Success || !solution.allFinite()) {
        trajectory.finite = false;
        return;
      }
      v += solution.reshaped(3, x.cols());
      before = x;
      x += h * v;
      contact.apply(t, h, before.data(), x.data(), v.data());
      t += h;
    }
    t = sample;
    trajectory.samples.push_back(x);
  }
}

}  // namespace selvedge::cloth
