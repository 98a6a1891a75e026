#include "model/excerpts.h"

#include <algorithm>

#include "model/trial_error.h"

namespace selvedge::model {

namespace {

constexpr double kStep_s = 0.05;
constexpr double kBefore_s = 1.2;        // of what was seen before a piece
constexpr double kBeforeMotion_s = 0.5;  // that pictures' stamps may be early by

bool may_be_cut(const ObservedTrial& trial, const ExcerptOptions& options) {
  return !trial.still && (trial.markers || (options.pictures && trial.stripes && trial.experiment.starts_at_rest));
}

double end_s(const ObservedTrial& trial) {
  return trial.markers ? trial.markers->time_s.back() : observe::last_time_s(*trial.stripes);
}

double duration_s(const ObservedTrial& trial) { return end_s(trial) - trial.experiment.start_s; }

// Squared speed of both ends of the held edge, summed over a piece.
double excitation(const cloth::HeldPath& path, double from_s, double length_s) {
  double sum = 0;
  for (double t = from_s; t < from_s + length_s; t += kStep_s) sum += path.velocity_at(t).squaredNorm();
  return sum;
}

// The beginning of the piece with most excitation, s.
double most_excited(const ObservedTrial& trial, double length_s, double delay_s) {
  const double first = trial.experiment.start_s, last = trial.markers->time_s.back() - length_s;
  double best = first, most = -1;
  for (double from = first; from <= last; from += kStep_s) {
    const double here = excitation(trial.experiment.path, from - delay_s, length_s);
    if (here <= most) continue;
    most = here;
    best = from;
  }
  return best;
}

void begin_at(ObservedTrial& trial, double from_s, double length_s) {
  trial.experiment.start_s = from_s;
  trial.experiment.sample_s = sample_times(from_s, from_s + length_s);
}

void cut_markers(ObservedTrial& trial, double length_s, const ExcerptOptions& options) {
  const double start_s = trial.experiment.start_s, from_s = most_excited(trial, length_s, options.delay_s);
  if (from_s > start_s)
    trial.before = std::make_shared<observe::MarkerTrack>(
        piece_of(*trial.markers, std::max(start_s, from_s - kBefore_s), from_s + kStep_s));
  trial.markers = piece_of(*trial.markers, from_s, from_s + length_s);
  trial.lead_s = options.lead_s;
  begin_at(trial, from_s, length_s);
}

std::shared_ptr<const observe::StripeTrack> piece_of(const observe::StripeTrack& track, double from_s, double to_s) {
  auto out = std::make_shared<observe::StripeTrack>(track);
  std::erase_if(out->frames, [&](const observe::StripeFrame& f) { return f.time_s < from_s || f.time_s > to_s; });
  return out;
}

// From a while before the held edge begins to move: until then the fabric hangs still.
void cut_pictures(ObservedTrial& trial, double length_s) {
  const double last = end_s(trial) - length_s,
               from_s = std::max(trial.experiment.start_s, std::min(last, first_move_s(trial) - kBeforeMotion_s));
  const std::shared_ptr<const observe::StripeTrack> piece = piece_of(*trial.stripes, from_s, from_s + length_s);
  if (piece->frames.empty()) return;
  trial.stripes = piece;
  begin_at(trial, from_s, length_s);
}

}  // namespace

std::vector<ObservedTrial> excerpts(std::vector<ObservedTrial> trials, const ExcerptOptions& options) {
  double total_s = 0;
  for (const ObservedTrial& trial : trials)
    if (may_be_cut(trial, options)) total_s += duration_s(trial);
  if (total_s <= options.most_motion_s) return trials;
  for (ObservedTrial& trial : trials) {
    if (!may_be_cut(trial, options)) continue;
    const double share_s = duration_s(trial) * options.most_motion_s / total_s,
                 length_s = trial.markers ? share_s + options.lead_s : share_s;
    if (length_s >= duration_s(trial)) continue;
    if (trial.markers) cut_markers(trial, length_s, options);
    else cut_pictures(trial, length_s);
  }
  return trials;
}

ObservedTrial beginning_of(ObservedTrial trial, double until_s) {
  if (trial.still) return trial;
  std::vector<double>& sample_s = trial.experiment.sample_s;
  // One sample beyond the last observation serves interpolation.
  const auto end = std::upper_bound(sample_s.begin(), sample_s.end(), until_s);
  if (end != sample_s.end()) sample_s.erase(end + 1, sample_s.end());
  if (trial.markers) trial.markers = piece_of(*trial.markers, -1e300, until_s);
  if (trial.stripes) trial.stripes = piece_of(*trial.stripes, -1e300, until_s);
  return trial;
}

std::vector<ObservedTrial> without_leads(std::vector<ObservedTrial> trials) {
  for (ObservedTrial& trial : trials) {
    if (trial.lead_s <= 0) continue;
    const std::vector<double>& time_s = trial.markers->time_s;
    trial.markers = piece_of(*trial.markers, trial.experiment.start_s + trial.lead_s, time_s.back());
    trial.lead_s = 0;
  }
  return trials;
}

double motion_s(const std::vector<ObservedTrial>& trials) {
  double sum = 0;
  for (const ObservedTrial& t : trials)
    if (!t.still) sum += t.experiment.sample_s.back() - t.experiment.start_s;
  return sum;
}

}  // namespace selvedge::model
