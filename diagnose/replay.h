// The recorded motions beside the base model and beside the likeliest set of effects, for the report to show in motion.
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "diagnose/missing_force.h"
#include "diagnose/windows.h"
#include "report/moving_sheets.h"

namespace selvedge::diagnose {

// A model to show: coordinates of all parameters, where its simulations begin, and what its windows leave, mm.
struct Shown {
  std::string name;
  Eigen::VectorXd x;
  model::State branches;
  Eigen::VectorXd residual;
};

// One moving trial of each group. Sheets are those of the windows: where a hold lets go of a sheet, it jumps.
std::vector<report::MovingSheet> replay(const Study& study, const Windows& windows, const std::vector<Shown>& models,
                                        const MissingForce& force);

// What the windows leave, trial by trial, as model::Residuals::mm has it; NaN where no window looks.
std::vector<Eigen::VectorXd> by_trial(const Study& study, const Windows& windows, const Eigen::VectorXd& residual);

}  // namespace selvedge::diagnose
