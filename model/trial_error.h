// The error of a simulated trial in one number, and how far to trust it.
#pragma once

#include <optional>
#include <utility>

#include "model/observed_trial.h"

namespace selvedge::model {

// Root mean square of the finite residuals of a trial between two times, mm: distance of markers in space
// (three residuals a marker count as one), or of stripe and outline points.
double rms_mm(const ObservedTrial& trial, const Eigen::VectorXd& residual, const Eigen::VectorXd& time_s,
              double from_s = -1e300, double to_s = 1e300);

// When a held point first lies 1 mm from where it began; NaN where none does.
double first_move_s(const ObservedTrial& trial);

// 90 % interval of that, with blocks of 1 s as independent draws; nothing where fewer than four blocks were seen.
using Interval = std::pair<double, double>;
std::optional<Interval> rms_interval_mm(const ObservedTrial& trial, const Eigen::VectorXd& residual,
                                        const Eigen::VectorXd& time_s, double from_s = -1e300, double to_s = 1e300);

// Root mean square of markers' finite residuals from a time on, an axis, each in standard deviations of its marker's
// measured noise (marker_noise_m); nothing of a trial without markers.
std::optional<double> rms_in_noise(const ObservedTrial& trial, const Eigen::VectorXd& residual,
                                   const Eigen::VectorXd& time_s, double from_s = -1e300);

}  // namespace selvedge::model
