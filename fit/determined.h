// What the trials of a fit say of each parameter, and of parameters together.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "estimate/least_squares.h"
#include "fit/fit_outcome.h"

namespace selvedge::fit {

// FitOutcome::parameters and remarks. start, mesh: coordinates; mesh: how far the grid leaves each open.
void judge_parameters(FitOutcome& out, const std::vector<model::Parameter>& parameters, const Eigen::VectorXd& start,
                      const estimate::LeastSquaresResult& fit, const Eigen::VectorXd& mesh);

// FitOutcome::combinations: eigenvectors of the information with little of it.
void name_weak_combinations(FitOutcome& out, const std::vector<model::Parameter>& parameters,
                            const estimate::LeastSquaresResult& fit);

// FitOutcome::correlation.
void find_correlation(FitOutcome& out, const estimate::LeastSquaresResult& fit);

}  // namespace selvedge::fit
