#include "calib/drift.h"

#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <fmt/format.h>

namespace selvedge::calib {

namespace {

using Information = Eigen::Matrix<double, 6, 6>;

struct ShiftFit {
  PoseShift shift = PoseShift::Zero();
  Information covariance = Information::Zero();
};

Information prior(const DriftOptions& options) {
  Information information = Information::Zero();
  for (int i = 0; i < 3; ++i) {
    information(i, i) = std::pow(options.turn_sd_rad, -2);
    information(i + 3, i + 3) = std::pow(options.shift_sd_m, -2);
  }
  return information;
}

// Zero for the coordinate that was not seen.
Eigen::Matrix2d kept(Seen seen) {
  return Eigen::Vector2d(seen == Seen::row ? 0 : 1, seen == Seen::column ? 0 : 1).asDiagonal();
}

Eigen::Matrix2d weight_of(const PixelDerivatives& d, Seen seen, const DriftOptions& options) {
  const Eigen::Matrix2d covariance = sighting_covariance(d, options.pixel_noise_px, options.tracker_noise_m);
  if (seen == Seen::both) return covariance.inverse();
  return kept(seen) * covariance.diagonal().cwiseInverse().asDiagonal() * kept(seen);
}

// Gauss–Newton on Cauchy's loss, its scale brought down so that a knock of a hundred pixels is still found.
ShiftFit fit_shift(const CameraParameters& camera, const TrialSightings& trial, const DriftOptions& options) {
  ShiftFit fit;
  Information information;
  for (const double scale : {300.0, 60.0, 12.0, 3.0, 3.0, 3.0, 3.0, 3.0, 3.0, 3.0}) {
    information = prior(options);
    PoseShift gradient = information * fit.shift;
    for (const Sighting& s : trial.sightings) {
      const PixelDerivatives d = derivatives(camera, s.point, &fit.shift);
      const Eigen::Matrix2d weight = weight_of(d, trial.seen, options);
      const Eigen::Vector2d residual = d.pixel - s.pixel;
      const double robust = options.independent_share / (1 + residual.dot(weight * residual) / (scale * scale));
      information += robust * d.by_shift.transpose() * weight * d.by_shift;
      gradient += robust * d.by_shift.transpose() * weight * residual;
    }
    fit.shift -= information.ldlt().solve(gradient);
  }
  fit.covariance = information.inverse();
  return fit;
}

double rms(const CameraParameters& camera, const PoseShift& shift, const TrialSightings& trial) {
  double sum = 0;
  for (const Sighting& s : trial.sightings)
    sum += (kept(trial.seen) * (pixel_of(camera, s.point, &shift) - s.pixel)).squaredNorm();
  return std::sqrt(sum / static_cast<double>(trial.sightings.size()));
}

TrialDrift judge_trial(const CameraParameters& first, const TrialSightings& trial, const DriftOptions& options) {
  TrialDrift result;
  result.trial = trial.trial;
  if (trial.sightings.size() < options.least_sightings) return result;
  result.judged = true;
  const CameraParameters& calibrated = trial.calibrated ? *trial.calibrated : first;
  const ShiftFit fit = fit_shift(calibrated, trial, options);
  const Eigen::Matrix2d keep = kept(trial.seen);
  double variance = 0;
  for (const Sighting& s : trial.sightings) {
    result.shift_px += (keep * (pixel_of(calibrated, s.point, &fit.shift) - pixel_of(calibrated, s.point))).norm();
    const Eigen::Matrix<double, 2, 6> by_shift = keep * derivatives(calibrated, s.point, &fit.shift).by_shift;
    variance += (by_shift * fit.covariance * by_shift.transpose()).trace();
  }
  const double count = static_cast<double>(trial.sightings.size());
  result.shift_px /= count;
  result.sd_px = std::sqrt(variance / count + keep.trace() * std::pow(options.calibration_sd_px, 2));
  result.shift = fit.shift;
  result.turn_deg = result.shift_px / calibrated[kFocal + (trial.seen == Seen::row ? 1 : 0)] * 180 / M_PI;
  result.rms_px = rms(calibrated, PoseShift::Zero(), trial);
  result.rms_after_px = rms(calibrated, fit.shift, trial);
  result.moved = result.shift_px > std::max(options.least_ratio * result.sd_px, options.harmless_px);
  return result;
}

}  // namespace

Drift check_drift(const std::string& device, const CameraParameters& calibrated,
                  const std::vector<TrialSightings>& trials, const DriftOptions& options) {
  Drift drift;
  for (const TrialSightings& trial : trials) drift.trials.push_back(judge_trial(calibrated, trial, options));
  const TrialDrift* first_of_run = nullptr;
  const TrialDrift* last_judged = nullptr;
  for (const TrialDrift& trial : drift.trials) {
    if (!trial.judged) continue;
    last_judged = &trial;
    if (!trial.moved) first_of_run = nullptr;
    else if (!first_of_run) first_of_run = &trial;
  }
  if (!last_judged) {
    drift.sentence =
        fmt::format("The {} could not be checked: no trial shows {} tracked points.", device, options.least_sightings);
  } else if (first_of_run) {
    drift.since = first_of_run->trial;
    const std::string repeats =
        options.repeats_px > 0
            ? fmt::format(" (stripes repeat: or that and whole multiples of {:.0f} px)", options.repeats_px)
            : "";
    drift.sentence = fmt::format(
        "The {} has moved since trial {}: by {:.1f} ± {:.1f} px at the fabric{}, as much as a turn by {:.2f} degrees. "
        "Calibrate again; trials from {} on have a wrong matrix.",
        device, first_of_run->trial, first_of_run->shift_px, first_of_run->sd_px, repeats, first_of_run->turn_deg,
        first_of_run->trial);
  } else {
    drift.sentence = fmt::format("The {} stands where it was calibrated: {:.2f} ± {:.2f} px at the fabric in trial {}.",
                                 device, last_judged->shift_px, last_judged->sd_px, last_judged->trial);
  }
  return drift;
}

}  // namespace selvedge::calib
