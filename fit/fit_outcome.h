// What a fit is asked for, and what it answers.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "estimate/least_squares.h"
#include "estimate/optimisers/search.h"
#include "material_tests/fabric_library.h"
#include "material_tests/fit_tests.h"
#include "model/held_markers.h"
#include "model/trial_error.h"

namespace selvedge::fit {

enum class HoldOut { automatic, frames, trials, none };

// A search from `start` on the final grid; `cost` says which trials and times count, and takes its progress.
using CampaignSearchFunction = std::function<estimate::SearchResult(
    const model::Simulation& simulation, const model::State& state, const std::vector<model::Parameter>& parameters,
    const Eigen::VectorXd& start, const estimate::LeastSquaresOptions& cost)>;

struct FitOptions {
  model::Drag drag = model::Drag::nonlinear;
  int cells = 0;  // of the final grid along the width; 0: chosen from the fabric
  int coarse_cells = 8;
  double rate_hz = 30;        // observations are thinned to this
  double image_rate_hz = 10;  // frames likewise
  // Of motion that markers saw, the pieces that move most (model/excerpts.h); 0: all of it. Held-out frames need all.
  double most_motion_s = 18;
  HoldOut hold_out = HoldOut::automatic;  // trials where at least four move, else the last third of the frames
  int max_iterations = 10;
  std::optional<material_tests::LibraryFabric> like;  // where rigidity begins, and what it is loosely drawn to
  CampaignSearchFunction search;                      // where set, takes the place of step 3 (campaign_search.h)
  std::filesystem::path journal;  // of what is found before a search, and by least squares (fit_journal.h); empty: none
  // In the place of our sheet: its own parameters on its own grid, which is looked at through `cells` (0: 16); drag and
  // like are not used.
  std::shared_ptr<const model::Simulator> simulator;
  std::shared_ptr<model::Ranks> ranks;  // that share out evaluations (model/ranks/ranks.h); empty: this process alone
  report::ProgressCallback progress = [](double, const std::string&) {};
  cloth::StopFlag stop;  // fit_campaign() then throws cloth::Stopped
};

struct FittedParameter {
  model::Parameter parameter;
  double value = 0;
  double start = 0;                               // from the coarse grid
  double lower_interval = 0, upper_interval = 0;  // 90 %, with what the grid leaves open
  double mesh_percent = 0;                        // of that: how far the limit of ever finer grids may lie from it
  double variability_percent = 0;                 // change that raises the error by 1 % (Bhat et al. 2003, section 5)
  bool at_bound = false;
  bool determined = false;  // 90 % interval within a factor of 1.25 of value, and not at a bound
};

struct TrialError {
  std::string name;
  double start_mm = 0, end_mm = 0;  // root mean square, fitted part
  double moving_mm = 0;             // end_mm from the held points' first move on; NaN where they rest
  double held_out_mm = 0;           // NaN where nothing of this trial was held out
  std::optional<model::Interval> held_out_interval_mm;           // 90 %; absent where too little was held out for one
  std::optional<double> held_out_in_noise;                       // markers: in deviations of each one's measured noise
  std::optional<double> rigid_plate_mm;                          // the same samples, what does not move in itself
  std::optional<double> velocity_start_mm_s, velocity_end_mm_s;  // markers alone
  size_t frames = 0;                                             // compared times
};

struct FitOutcome {
  std::string campaign, model, hold_out;
  std::string input;                                  // input_of what was fitted
  std::shared_ptr<const model::Simulator> simulator;  // that took our sheet's place; null: none
  std::vector<FittedParameter> parameters;
  Eigen::VectorXd coordinates;
  std::vector<TrialError> trials;
  std::vector<double> history;  // cost after each iteration of the last stage
  std::string optimiser = "least_squares";
  std::vector<estimate::SearchStep> trace;  // of a search that took the place of least squares
  int evaluations = 0;
  double wall_s = 0;
  double cut_s = 0;  // frames after it were held out (hold_out frames)
  model::Residuals residuals, residuals_start;
  std::shared_ptr<const model::Simulation> simulation;  // on the final grid
  double grid_mm = 0;  // rms between the final grid and the next finer one, over all residuals; NaN: not looked at
  model::State state;  // in which it ended
  std::optional<model::HeldDelay> delay;  // of markers on held points behind the grips' path, which was moved by it
  std::vector<material_tests::KindAnswer> tests;  // of the campaign's material tests, where it holds some
  std::vector<std::string> doubts;                // of the recordings (capture/trial/doubts.h)
  std::vector<std::string> remarks;               // what a reader should know: bounds, what the trials do not show
  std::vector<std::string> combinations;          // of parameters that they do not tell apart
  Eigen::MatrixXd correlation;                    // of the parameters' coordinates
};

}  // namespace selvedge::fit
