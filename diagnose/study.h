// The campaign under the base model, ready for questions: fitted parameters, what a finer grid adds, and how the
// residual changes with every parameter of the base and of every effect.
//
// All parameters, the base's and the effects', stand in one list; a hypothesis is the set of those that may leave
// their neutral value. Coordinates of effects are zero at neutral.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/trial/trial.h"
#include "diagnose/effects/effect.h"
#include "diagnose/protocol.h"
#include "estimate/rows.h"
#include "estimate/least_squares.h"
#include "geometry/projection.h"

namespace selvedge::diagnose {

// Descents of the base and of hypotheses.
estimate::LeastSquaresOptions search_options(int max_iterations, double least_decrease);

struct Hypothesis;

struct Study {
  std::string campaign;
  Protocol protocol;
  std::vector<Effect> effects;
  std::vector<model::Parameter> parameters;  // base, then every effect's
  size_t base_count = 0;
  std::vector<size_t> first_parameter;                       // of each effect
  std::vector<std::optional<geometry::Projection>> cameras;  // of each trial
  std::vector<std::vector<size_t>>
      groups;  // trials that are held out together: replicates, and all still ones that count
  std::shared_ptr<const model::Simulation> simulation;
  model::State state;
  std::shared_ptr<const model::Simulation> fine;  // the same trials on the fine grid
  model::State fine_state;
  std::unique_ptr<estimate::Rows> rows;
  Eigen::VectorXd base;      // coordinates of all parameters, effects neutral
  Eigen::VectorXd residual;  // whitened, at base
  Eigen::MatrixXd jacobian;  // whitened residual per base coordinate
  // The base fit with shear as in an isotropic sheet, where the fit has it otherwise, with what the fine grid adds
  // there and derivatives of its own: shear may have swallowed what an effect in the plane of the fabric does, where no
  // derivative finds the way back.
  std::shared_ptr<const Hypothesis> other_start;
  bool nudged = false;                     // simulations are nudged towards markers
  std::vector<std::string> nudged_harder;  // trials that leave the recorded folds all the same, or where the grids part
  std::vector<Eigen::VectorXd> mesh_change;  // mm, what the fine grid adds, one a trial
  int evaluations = 0;
};

// Coordinates x with shear as of an isotropic sheet of their stretch stiffness, where it lies further than 20 % from
// that.
Eigen::VectorXd with_isotropic_shear(const Study& study, Eigen::VectorXd x);

// Finds afresh what the fine grid adds at the base fit, and has the state add it.
void correct_mesh(Study& study);

// From now on simulations run free, and `residual` and what the fine grid adds are those of a free motion. Derivatives
// stay those of before.
void run_free(Study& study);

// Whether what a finer grid adds to a trial's residuals (mm) is a correction. A change that is larger than what the fit
// leaves (left_mm), and than any grid's error of a motion that both follow, says that one of them went another way.
bool is_mesh_correction(const model::Simulation& simulation, const Protocol& protocol, size_t trial,
                        const Eigen::VectorXd& change_mm, const Eigen::VectorXd& left_mm);

// Residuals and their derivatives at the base fit, by central differences.
void linearise(Study& study);

// The base's parameters, of study.parameters.
std::vector<model::Parameter> base_of(const Study& study);

// Residuals of many coordinate sets (columns), whitened; a column of NaN where a simulation diverged.
Eigen::MatrixXd residuals_at(const Study& study, const Eigen::MatrixXd& coordinates,
                             const std::vector<size_t>& trials = {});

}  // namespace selvedge::diagnose
