#include "cloth/implicit_euler.h"

#include <cmath>

#include <Eigen/SparseCholesky>

#include "cloth/energy.h"
#include "cloth/filtered_step.h"
#include "cloth/held_motion.h"
#include "cloth/kernel/force_field.h"
#include "cloth/stiffness.h"

namespace selvedge::cloth {

namespace {

using Sparse = StiffnessMatrix;

// Columns and rows of held numbers are replaced by the identity, their known change moved to the right side.
void prescribe(const std::vector<char>& is_held, const Eigen::VectorXd& change, Sparse& matrix,
               Eigen::VectorXd& right) {
  Eigen::VectorXd known = Eigen::VectorXd::Zero(right.size());
  for (Eigen::Index i = 0; i < right.size(); ++i)
    if (is_held[static_cast<size_t>(i)]) known(i) = change(i);
  right -= matrix * known;
  hold_still(is_held, matrix);
  for (Eigen::Index i = 0; i < right.size(); ++i)
    if (is_held[static_cast<size_t>(i)]) right(i) = change(i);
}

}  // namespace

void run_implicit_euler(const Sheet& sheet, const Experiment& experiment, double step_s, Trajectory& trajectory) {
  const Material& m = experiment.material;
  const HeldMotion held(sheet, experiment);
  kernel::ForceField field(sheet.data, m, surroundings_of(experiment), held.vertices());
  const Eigen::VectorXd mass = vertex_masses(sheet, m);
  const std::vector<char> is_held = held.is_held();
  const FilteredStep contact(sheet, experiment, held.vertices());
  Eigen::SimplicialLLT<Sparse> solver;
  bool analysed = false;

  Eigen::Matrix3Xd x = trajectory.start, v = Eigen::Matrix3Xd::Zero(3, x.cols()), acceleration(3, x.cols()), target = x,
                   before = x;
  double t = experiment.start_s;
  for (const double sample : experiment.sample_s) {
    const int steps = std::max(1, static_cast<int>(std::ceil((sample - t) / step_s - 1e-9)));
    const double h = (sample - t) / steps;
    for (int k = 0; k < steps && h > 0; ++k) {
      field.accelerations(x.data(), v.data(), h, acceleration.data());
      Eigen::VectorXd right = (h * acceleration * mass.asDiagonal()).reshaped();
      right -= h * h * (stiffness_matrix(sheet, m, mass, x, {1, 0}, false) * v.reshaped());
      Sparse matrix = stiffness_matrix(sheet, m, mass, x, {h * h, h}, true);
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
