// A hypothesis: the base model, or the base model with one effect or two, every parameter refitted.
//
// Refitting starts from the base fit, by the solver of every fit (estimate/descent.h). Derivatives of the base come
// from the study, those of an effect from one change of finite size (friction and slip have none at zero); both are
// corrected by what each step that was tried really did, so that a refit costs a few simulations.
#pragma once

#include <string>
#include <vector>

#include "diagnose/study.h"

namespace selvedge::diagnose {

struct Hypothesis {
  std::vector<size_t> effects;       // into study.effects; empty: the base alone
  std::vector<Eigen::Index> active;  // coordinates that may move
  Eigen::VectorXd x;                 // coordinates of all parameters
  Eigen::VectorXd residual;          // whitened, simulated at x, with mesh_offset
  Eigen::VectorXd
      mesh_offset;           // whitened: what the fine mesh adds at x beyond what it adds at the base; empty: nothing
  Eigen::MatrixXd jacobian;  // whitened residual per active coordinate, near x
  double cost = 0;           // robust
  double screened_gain = 0;  // share of the base's residual that its columns explain beyond a refit of the base
};

std::string name_of(const Study& study, const Hypothesis& hypothesis);

Hypothesis base_hypothesis(const Study& study);

// Finite-size change of the residual per unit of each coordinate of these effects, from neutral, the base as in `from`;
// NaN columns where the simulation diverged, and of everything else.
Eigen::MatrixXd screen(Study& study, const Hypothesis& from, const std::vector<size_t>& effects);

// The base as in `from` with these effects; columns: from `screen`.
Hypothesis make_hypothesis(Study& study, const Hypothesis& from, const std::vector<size_t>& effects,
                           const Eigen::MatrixXd& columns);

// Refits all of them side by side, `rounds` simulated steps each, of which the best of some dampings is taken.
void refit(Study& study, std::vector<Hypothesis>& hypotheses, int rounds,
           const std::vector<double>& dampings = {1e-3, 0.3});

// Derivatives of each afresh at its x, by one-sided changes of its active coordinates: for those that came far from the
// base fit, where the base's derivatives and one finite change no longer tell the way.
void relinearise(Study& study, std::vector<Hypothesis>& hypotheses);

// Simulates each at x on the fine mesh and takes over what it adds there.
void refine_mesh(Study& study, std::vector<Hypothesis>& hypotheses);

// Residuals at coordinate sets, one hypothesis a column, with its mesh offset.
Eigen::MatrixXd residuals_of(const Study& study, const std::vector<Hypothesis>& hypotheses, const Eigen::MatrixXd& sets,
                             const std::vector<size_t>& trials = {});

// Gauss–Newton steps from h.x on the rows of some trials alone, with h.jacobian, one a damping: coordinates of all
// parameters, a column each, kept within their bounds.
Eigen::MatrixXd steps_from(const Study& study, const Hypothesis& h, const std::vector<size_t>& trials,
                           const std::vector<double>& dampings);

// c of the robust cost, for all hypotheses of a study.
double cauchy_constant(const Study& study);

}  // namespace selvedge::diagnose
