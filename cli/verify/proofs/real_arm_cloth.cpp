// Recordings of a real cloth that a robot arm swings, tracked by a depth camera: what a fit says of recordings that it
// has not seen, beside the nodes' own noise, a rigid plate on the same bar and the same model without air drag; and of
// recordings whose clocks are as they were, the camera's delay, by a fit and by a diagnosis.
#include "cli/verify/proofs/real.h"

#include <algorithm>
#include <cmath>

#include <boost/math/distributions/students_t.hpp>
#include <fmt/format.h>

#include "diagnose/diagnosis.h"
#include "diagnose/effects/library.h"
#include "fit/fit_campaign.h"
#include "fit/stages.h"
#include "fit/trial_errors.h"
#include "report/text_table.h"

namespace selvedge::cli {

namespace {

// Mean over the recordings with its 90 % interval, recordings as independent draws.
struct OverRecordings {
  double mean = 0, lower = 0, upper = 0;
};

OverRecordings over_recordings(const std::vector<double>& values) {
  const double n = static_cast<double>(values.size());
  double mean = 0, squares = 0;
  for (const double v : values) mean += v / n;
  for (const double v : values) squares += (v - mean) * (v - mean);
  const double half = boost::math::quantile(boost::math::students_t(n - 1), 0.95) * std::sqrt(squares / (n - 1) / n);
  return {mean, mean - half, mean + half};
}

fit::FitOutcome fit_with(const trial::Campaign& campaign, model::Drag drag, const FigureOptions& options, double from,
                         const std::string& name) {
  fit::FitOptions how;
  how.drag = drag;
  how.hold_out = fit::HoldOut::trials;
  if (options.quick) how.cells = 6;
  if (options.quick) how.coarse_cells = 4;
  if (options.quick) how.max_iterations = 2;
  how.progress = fit::part_of(options.progress, from, from + 0.5, name);
  return fit::fit_campaign(campaign, how);
}

std::string with_interval(const fit::TrialError& t) {
  return t.held_out_interval_mm ? fmt::format("{:.1f} ({:.1f} to {:.1f})", t.held_out_mm, t.held_out_interval_mm->first,
                                              t.held_out_interval_mm->second)
                                : fmt::format("{:.1f}", t.held_out_mm);
}

}  // namespace

std::vector<Figure> prove_real_arm_cloth(const std::filesystem::path& folder, const FigureOptions& options) {
  trial::Campaign campaign = trial::read_campaign(folder);
  if (options.quick) campaign.trials.resize(2);
  const fit::FitOutcome drag = fit_with(campaign, model::Drag::nonlinear, options, 0, "with drag"),
                        none = fit_with(campaign, model::Drag::none, options, 0.5, "without drag");

  std::vector<std::vector<std::string>> rows;
  std::vector<double> held_out, beside_plate, beside_none, in_noise;
  for (size_t i = 0; i < drag.trials.size(); ++i) {
    const fit::TrialError &a = drag.trials[i], &b = none.trials[i];
    rows.push_back({a.name, with_interval(a), fmt::format("{:.2f}", a.held_out_in_noise.value()), with_interval(b),
                    fmt::format("{:.1f}", a.rigid_plate_mm.value())});
    in_noise.push_back(*a.held_out_in_noise);
    held_out.push_back(a.held_out_mm);
    beside_plate.push_back(a.held_out_mm - *a.rigid_plate_mm);
    beside_none.push_back(a.held_out_mm - b.held_out_mm);
  }
  fmt::print(
      "Root mean square error of recordings that the fit did not see, mm (90 %: blocks of 1 s)\n{}\n",
      report::text_table({"recording", "model with drag", "in its nodes' noise", "without drag", "rigid plate"}, rows));
  const OverRecordings ours = over_recordings(held_out), plate = over_recordings(beside_plate),
                       without = over_recordings(beside_none);
  fmt::print(
      "Mean over {} recordings, 90 % interval with recordings as draws: {:.1f} mm ({:.1f} to {:.1f}); less a rigid "
      "plate's {:+.1f} ({:+.1f} to {:+.1f}); "
      "less the model's without drag {:+.1f} ({:+.1f} to {:+.1f})\n{} and {} simulations in {:.0f} and {:.0f} s\n\n",
      held_out.size(), ours.mean, ours.lower, ours.upper, plate.mean, plate.lower, plate.upper, without.mean,
      without.lower, without.upper, drag.evaluations, none.evaluations, drag.wall_s, none.wall_s);
  const Relation judged = options.quick ? Relation::shown : Relation::at_most;
  return {
      {"arm cloth: held-out error in deviations of each node's noise, mean of recordings",
       over_recordings(in_noise).mean, 1.5, "", judged, "the held edge's departure from the bar"},
      {"arm cloth: held-out error, all recordings", fit::held_out_mm(drag), *fit::rigid_plate_mm(drag), "mm", judged,
       "a rigid plate on the same bar"},
      {"arm cloth: held-out error, all recordings", fit::held_out_mm(drag), fit::held_out_mm(none), "mm", judged,
       "the same model without drag"},
      {"arm cloth: error less a rigid plate's, upper end of 90 %", plate.upper, 0, "mm", judged,
       "six recordings as draws"},
      {"arm cloth: error less the model's without drag, upper end of 90 %", without.upper, 0, "mm", Relation::shown,
       "six recordings as draws"},
  };
}

std::vector<Figure> prove_real_arm_cloth_raw(const std::filesystem::path& folder, const FigureOptions& options) {
  constexpr double kLeast_s = 0.27, kMost_s = 0.35;  // over the recordings
  const char* const source = "both clocks of the recordings, as their author found them";
  trial::Campaign campaign = trial::read_campaign(folder);
  if (options.quick) campaign.trials.resize(2);
  const fit::FitOutcome fitted = fit_with(campaign, model::Drag::nonlinear, options, 0, "with drag");
  std::vector<Figure> out;
  const auto add = [&](const std::string& who, double delay_s) {
    out.push_back({who, delay_s, kLeast_s, "s", Relation::at_least, source});
    out.push_back({who, delay_s, kMost_s, "s", Relation::at_most, source});
  };
  add("raw arm cloth: the camera's delay, by a fit", fitted.delay ? fitted.delay->delay_s : 0);
  if (options.quick) return out;
  diagnose::DiagnosisOptions how;
  how.study.progress = fit::part_of(options.progress, 0.5, 1, "diagnosis");
  const diagnose::Diagnosis told = diagnose::diagnose(campaign, diagnose::effect_library(), how);
  const auto delay = std::find_if(told.effects.begin(), told.effects.end(),
                                  [](const diagnose::EffectFinding& f) { return f.name == "camera_delay"; });
  add("raw arm cloth: the camera's delay, by a diagnosis",
      delay != told.effects.end() && !delay->size.empty() ? delay->size[0].value : 0);
  out.push_back({"raw arm cloth: probability of a camera's delay", told.inclusion.at("camera_delay"), 0.5, "",
                 Relation::at_least, source});
  out.push_back({"raw arm cloth: time of the diagnosis", told.wall_s, 480, "s", Relation::shown, "the slowest asked"});
  return out;
}

}  // namespace selvedge::cli
