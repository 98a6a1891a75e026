// How much a trial holds: samples, rates, gaps, hidden samples. Nothing here is needed to fit it.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "capture/trial/trial.h"

namespace selvedge::trial {

struct Sampling {
  size_t count = 0;
  double first_s = 0, last_s = 0;
  double rate_hz = 0;        // 1 / median step; 0 where there are fewer than two distinct times
  size_t gaps = 0;           // steps above 1.5 medians
  double longest_gap_s = 0;  // the longest step
};

// times_s ascending; equal ones count as one.
Sampling sampling(const std::vector<double>& times_s);

struct MarkerSummary {
  size_t markers = 0;
  Sampling sampling;
  double hidden_share = 0;  // of markers × times, those without a row
};
MarkerSummary summary(const Markers& markers);

// Points of a surface that share a time, m.
struct Cloud {
  double time_s = 0;
  Eigen::Matrix3Xd points;
};
std::vector<Cloud> clouds(const Surface& surface);

// Frame numbers between first and last that are not in the list.
size_t missing_numbers(const Frames& frames);

// The same samples with hidden ones where steps above 1.5 medians say that some are missing: what smooths a path over
// the samples then knows how long the gap is.
Corners with_gaps_hidden(const Corners& corners);

// Share of samples in which that corner is hidden.
double hidden_share(const Eigen::Matrix3Xd& corner);

}  // namespace selvedge::trial
