#include "diagnose/study.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "model/trial_error.h"

namespace selvedge::diagnose {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// What the fine grid adds to each residual at these parameters, mm; zero where it diverged or went another way, from
// its own equilibrium and from that of the coarse one, which was matched to the recording. The fine grid then starts
// from the equilibria that it found: on it, relaxing takes as long as moving.
std::vector<VectorXd> mesh_change(Study& study, const std::vector<model::Parameter>& parameters, const VectorXd& x) {
  const model::Simulation &coarse = *study.simulation, &fine = *study.fine;
  const model::Residuals coarse_r = coarse.evaluate(study.state, parameters, x).front();
  std::vector<VectorXd> change;
  for (size_t i = 0; i < coarse_r.mm.size(); ++i) change.push_back(VectorXd::Zero(coarse.time_s(i).size()));
  // Of these trials; those that went another way.
  const auto change_of = [&](const model::Residuals& fine_r, const std::vector<size_t>& trials) {
    std::vector<size_t> parted;
    for (const size_t i : trials) {
      VectorXd d = VectorXd::Zero(change[i].size());
      if (coarse_r.mm[i].size() == d.size() && fine_r.mm[i].size() == d.size()) d = fine_r.mm[i] - coarse_r.mm[i];
      // Residuals already hold the correction that was set before.
      if (!study.state.grid_correction_mm.empty()) d += study.state.grid_correction_mm[i];
      for (double& value : d)
        if (!std::isfinite(value)) value = 0;
      if (is_mesh_correction(coarse, study.protocol, i, d, coarse_r.mm[i])) change[i] = d;
      else parted.push_back(i);
    }
    return parted;
  };
  const model::Residuals fine_r = fine.evaluate(study.fine_state, parameters, x).front();
  if (fine_r.finite) fine.take_branches(study.fine_state, fine_r.start);
  std::vector<size_t> all(change.size());
  std::iota(all.begin(), all.end(), 0);
  const std::vector<size_t> parted = change_of(fine_r, all);
  if (parted.empty()) return change;
  fine.take_branches(study.fine_state, coarse, study.state, parted);
  const model::Residuals again = fine.evaluate(study.fine_state, parameters, x, parted).front();
  ++study.evaluations;
  if (again.finite) fine.take_branches(study.fine_state, again.start);
  change_of(again, parted);
  return change;
}

}  // namespace

std::vector<model::Parameter> base_of(const Study& study) {
  return {study.parameters.begin(), study.parameters.begin() + static_cast<std::ptrdiff_t>(study.base_count)};
}

void linearise(Study& study) {
  const double step = study.protocol.base_difference;
  const auto n = static_cast<Index>(study.base_count);
  MatrixXd sets(study.base.size(), 2 * n + 1);
  for (Index k = 0; k < sets.cols(); ++k) sets.col(k) = study.base;
  for (Index k = 0; k < n; ++k) {
    sets(k, 2 * k + 1) += step;
    sets(k, 2 * k + 2) -= step;
  }
  const MatrixXd r = residuals_at(study, sets);
  study.evaluations += static_cast<int>(sets.cols());
  study.residual = r.col(0);
  MatrixXd jacobian(r.rows(), n);
  for (Index k = 0; k < n; ++k) {
    jacobian.col(k) = (r.col(2 * k + 1) - r.col(2 * k + 2)) / (2 * step);
    if (!jacobian.col(k).allFinite()) jacobian.col(k).setZero();
  }
  study.jacobian = std::move(jacobian);
}

VectorXd with_isotropic_shear(const Study& study, VectorXd x) {
  const auto stretch = static_cast<Index>(place_of(study.parameters, "stretch")),
             shear = static_cast<Index>(place_of(study.parameters, "shear"));
  const double isotropic = model::to_coordinate(
      study.parameters[static_cast<size_t>(shear)],
      study.protocol.isotropic_shear * model::to_value(study.parameters[static_cast<size_t>(stretch)], x(stretch)));
  if (std::abs(isotropic - x(shear)) >= study.protocol.isotropic_within) x(shear) = isotropic;
  return x;
}

estimate::LeastSquaresOptions search_options(int max_iterations, double least_decrease) {
  estimate::LeastSquaresOptions o;
  o.max_iterations = max_iterations;
  o.steps_between = 1;
  o.only_coordinates = true;
  o.least_decrease = least_decrease;
  // Small differences meet edges where a motion folds another way; from 0.03 one base fit in four ended far from the
  // bottom.
  o.difference = 0.1;
  return o;
}

bool is_mesh_correction(const model::Simulation& simulation, const Protocol& protocol, size_t trial,
                        const VectorXd& change_mm, const VectorXd& left_mm) {
  const model::ObservedTrial& observed = simulation.trials()[trial];
  const VectorXd time_s = simulation.time_s(trial);
  return model::rms_mm(observed, change_mm, time_s) <
         std::max(protocol.largest_grid_mm, model::rms_mm(observed, left_mm, time_s));
}

MatrixXd residuals_at(const Study& study, const MatrixXd& coordinates, const std::vector<size_t>& trials) {
  return study.rows->whitened(study.simulation->evaluate(study.state, study.parameters, coordinates, trials));
}

void correct_mesh(Study& study) {
  study.mesh_change = mesh_change(study, base_of(study), study.base.head(static_cast<Index>(study.base_count)));
  study.state.grid_correction_mm = study.mesh_change;
  study.evaluations += 2;
}

void run_free(Study& study) {
  const std::vector<model::Parameter> base = base_of(study);
  const VectorXd x = study.base.head(static_cast<Index>(study.base_count));
  study.nudged = false;
  for (model::State* state : {&study.state, &study.fine_state})
    state->nudging_per_s.assign(study.simulation->trials().size(), 0);
  study.simulation->rematch(study.state, base, x);
  study.fine->take_branches(study.fine_state, *study.simulation, study.state);
  study.state.grid_correction_mm.clear();
  study.mesh_change = mesh_change(study, base, x);
  study.state.grid_correction_mm = study.mesh_change;
  study.residual = residuals_at(study, study.base).col(0);
  study.evaluations += 3;
}

}  // namespace selvedge::diagnose
