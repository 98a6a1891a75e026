// Where on the fabric, when, how fast and at which camera row the residual lies.
//
// Cells of five axes are compared by their share of the squared held-out residual of the base model, less what
// noise alone leaves. A cell stands out where its mean square exceeds that of the rest of its axis in trial after
// trial: a t test over groups of trials on the log ratio, Holm's correction for all cells looked at.
#pragma once

#include <string>
#include <vector>

#include "diagnose/spots_seen.h"
#include "diagnose/study.h"

namespace selvedge::diagnose {

struct Cell {
  std::string axis;  // region, time, frequency, regime, image
  std::string cell;
  double share = 0;    // of the squared residual above noise, within its axis
  double mm = 0;       // root mean square there
  double p_value = 1;  // corrected
};

// For pictures: root mean square at each marker, at each time of each trial, and in each frequency band.
struct ResidualMap {
  double width_m = 0, height_m = 0;
  std::vector<cloth::Hold> held;    // of the trials, each once
  std::vector<Eigen::Vector2d> uv;  // markers, or centres of a grid where images were compared
  std::vector<double> at_mm;        // of the base model
  std::vector<double> after_mm;     // with the likeliest effects; empty where there are none
  struct OverTime {
    std::string trial;
    std::vector<double> time_s, mm;
  };
  std::vector<OverTime> over_time;
  std::vector<double> frequency_hz, frequency_mm;
  std::vector<double> image_row_px, image_mm;
};

struct Where {
  std::vector<Cell> cells;
  ResidualMap map;
};

// seen: of each trial (spots_seen). residual_mm: a trial, as model::Residuals::mm, as predicted without its group; NaN:
// not looked at. noise_mm: what the sensor alone leaves of a marker or a point of pictures.
Where split_residual(const Study& study, const std::vector<SpotsSeen>& seen,
                     const std::vector<Eigen::VectorXd>& residual_mm, double noise_mm);

}  // namespace selvedge::diagnose
