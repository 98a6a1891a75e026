#include "fit/fold_objective.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>

#include <Eigen/QR>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include "files/bad_input.h"
#include "observe/silhouette.h"
#include "observe/stripe_residual.h"
#include "render/row_map.h"

namespace selvedge::fit {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Brightness over one period of the pattern, blurred by projector and lens.
class StripeProfile {
 public:
  explicit StripeProfile(const render::StripePattern& pattern) : pattern_(pattern), grey_(kSteps) {
    constexpr double kBlur_px = 1.2;  // projector px, one standard deviation
    const double low = render::border_px(pattern, 0), high = render::border_px(pattern, 1);
    for (int i = 0; i < kSteps; ++i) {
      const double x = low + pattern.period_px * i / kSteps;
      double lit = 0;
      for (int k = -1; k <= 1; ++k) {
        const auto below = [&](double border) {
          return 0.5 * std::erfc((border + k * pattern.period_px - x) / (kBlur_px * std::sqrt(2.0)));
        };
        lit += below(low) - below(high);
      }
      grey_[static_cast<size_t>(i)] = static_cast<unsigned char>(std::lround(20 + 200 * std::clamp(lit, 0.0, 1.0)));
    }
    first_ = low;
  }

  unsigned char at(float coordinate_px) const {
    const double periods = (coordinate_px - first_) / pattern_.period_px;
    return grey_[static_cast<size_t>((periods - std::floor(periods)) * kSteps) % kSteps];
  }

 private:
  static constexpr int kSteps = 256;
  render::StripePattern pattern_;
  std::vector<unsigned char> grey_;
  double first_ = 0;
};

// What one thread pictures and compares one trial with.
class FoldBench {
 public:
  explicit FoldBench(const FoldTrack& track)
      : track_(track), map_(track.camera, track.projector), profile_(track.pattern) {}

  double energy(const Eigen::Matrix3Xd& position, const std::vector<std::array<int, 3>>& triangles, size_t frame) {
    map_.rasterise(position, triangles);
    map_.fill_silhouette(inside_);
    return metric_.compare(track_.recorded[frame], metric_.angle_map(lit_rows(), inside_)).total;
  }

 private:
  render::Image lit_rows() {
    map_.fill(row_, column_, depth_);
    const std::vector<float>& across = track_.pattern.horizontal ? row_ : column_;
    render::Image image = render::Image::Constant(map_.height_px(), map_.width_px(), 4);
    const render::RowMap::Box box = map_.covered();
    for (int y = box.top; y < box.bottom; ++y)
      for (int x = box.left; x < box.right; ++x) {
        const float row = across[static_cast<size_t>(y * map_.width_px() + x)];
        if (!std::isnan(row)) image(y, x) = profile_.at(row);
      }
    return image;
  }

  const FoldTrack& track_;
  render::RowMap map_;
  StripeProfile profile_;
  FoldMetric metric_;
  std::vector<unsigned char> inside_;
  std::vector<float> row_, column_, depth_;
};

// Of one parameter set and trial: the sheet at each compared frame; empty where the simulation diverged.
using Sheets = std::vector<Eigen::Matrix3Xd>;

std::vector<Sheets> simulate_sheets(const model::Simulation& scenes, const model::State& state, const FoldTrack& track,
                                    size_t trial, const std::vector<model::Parameter>& parameters,
                                    const MatrixXd& coordinates) {
  const model::ObservedTrial& observed = scenes.trials()[trial];
  std::vector<cloth::Experiment> lanes;
  for (model::Prediction& p : scenes.predictions(state, parameters, coordinates, trial, 0, coordinates.cols())) {
    // The recording may go on after the last frame compared.
    while (!observed.still && p.experiment.sample_s.size() > 3 &&
           p.experiment.sample_s[p.experiment.sample_s.size() - 3] > track.time_s.back())
      p.experiment.sample_s.pop_back();
    lanes.push_back(std::move(p.experiment));
  }
  std::vector<Sheets> sheets(lanes.size());
  if (observed.still) {
    const std::vector<cloth::Rest> rests = scenes.relaxed(lanes);
    for (size_t i = 0; i < rests.size(); ++i)
      if (rests[i].position.allFinite()) sheets[i] = {scenes.view().of(rests[i].position)};
    return sheets;
  }
  const std::vector<cloth::Trajectory> runs = scenes.simulated(lanes);
  for (size_t i = 0; i < runs.size(); ++i)
    if (runs[i].finite)
      for (const double t : track.time_s)
        sheets[i].push_back(scenes.view().of(model::position_at(lanes[i], runs[i], t)));
  return sheets;
}

}  // namespace

FoldTrack track_folds(const trial::Trial& trial, const FoldTrackOptions& options, bool still) {
  if (!trial.frames || trial.frames->time_s.empty())
    refuse((trial.folder / "trial.json").string(),
           "found no frames, expected images: the fold metric compares pictures");
  observe::require_optics(trial);
  FoldTrack track;
  track.camera = *trial.camera;
  track.projector = *trial.projector;
  track.pattern = observe::pattern_of(*trial.pattern);
  FoldMetric metric;
  double next = -std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < trial.frames->time_s.size() && track.time_s.size() < (still ? 1 : options.most_frames); ++i) {
    const double t = trial.frames->time_s[i];
    if (t < next) continue;
    next = t + 1 / options.rate_hz - 1e-3;
    const render::Image image = trial::read_frame(trial, i);
    track.time_s.push_back(t);
    track.recorded.push_back(
        metric.angle_map(image, observe::silhouette_mask(image, observe::measure_background(image))));
  }
  return track;
}

FoldObjective::FoldObjective(const model::Simulation& scenes, const model::State& state,
                             const std::vector<FoldTrack>& tracks)
    : scenes_(scenes), state_(state), tracks_(tracks) {}

MatrixXd FoldObjective::energy(const std::vector<model::Parameter>& parameters, const MatrixXd& coordinates,
                               const std::vector<size_t>& wanted) const {
  std::vector<size_t> trials = wanted;
  if (trials.empty()) {
    trials.resize(tracks_.size());
    std::iota(trials.begin(), trials.end(), 0);
  }
  const Index lanes_at_once = cloth::spline::most_lanes(scenes_.options().sheet.precision);
  const Index sets = coordinates.cols(), groups = (sets + lanes_at_once - 1) / lanes_at_once;
  std::vector<std::vector<Sheets>> sheets(trials.size(), std::vector<Sheets>(static_cast<size_t>(sets)));
  tbb::parallel_for(size_t{0}, trials.size() * static_cast<size_t>(groups), [&](size_t task) {
    const size_t t = task / static_cast<size_t>(groups);
    const Index first = static_cast<Index>(task % static_cast<size_t>(groups)) * lanes_at_once,
                count = std::min(lanes_at_once, sets - first);
    std::vector<Sheets> some = simulate_sheets(scenes_, state_, tracks_[trials[t]], trials[t], parameters,
                                               coordinates.middleCols(first, count));
    std::move(some.begin(), some.end(), sheets[t].begin() + first);
  });

  MatrixXd energy(sets, static_cast<Index>(trials.size()));
  for (size_t t = 0; t < trials.size(); ++t) {
    const FoldTrack& track = tracks_[trials[t]];
    const size_t frames = track.time_s.size();
    std::vector<double> of_frame(static_cast<size_t>(sets) * frames, std::numeric_limits<double>::infinity());
    tbb::enumerable_thread_specific<std::unique_ptr<FoldBench>> bench;
    tbb::parallel_for(size_t{0}, of_frame.size(), [&](size_t i) {
      const Sheets& sheet = sheets[t][i / frames];
      if (sheet.empty()) return;
      std::unique_ptr<FoldBench>& mine = bench.local();
      if (!mine) mine = std::make_unique<FoldBench>(track);
      of_frame[i] = mine->energy(sheet[i % frames], scenes_.view().mesh().triangles, i % frames);
    });
    for (Index set = 0; set < sets; ++set) {
      const auto from = of_frame.begin() + static_cast<std::ptrdiff_t>(static_cast<size_t>(set) * frames);
      energy(set, static_cast<Index>(t)) =
          std::accumulate(from, from + static_cast<std::ptrdiff_t>(frames), 0.0) / static_cast<double>(frames);
    }
  }
  return energy;
}

std::vector<double> variability_percent(const estimate::BatchCosts& costs,
                                        const std::vector<model::Parameter>& parameters, const VectorXd& point) {
  constexpr double largest = 0.2;
  constexpr Index steps = 3;
  const Index n = point.size(), each = 2 * steps;
  MatrixXd sets(n, 1 + n * each);
  VectorXd relative(each);
  for (Index i = 0; i < each; ++i)
    relative(i) = largest * static_cast<double>(i < steps ? i - steps : i - steps + 1) / steps;
  for (Index k = 0; k < sets.cols(); ++k) sets.col(k) = point;
  for (Index k = 0; k < n; ++k)
    for (Index i = 0; i < each; ++i) {
      const model::Parameter& p = parameters[static_cast<size_t>(k)];
      sets(k, 1 + k * each + i) = to_coordinate(p, to_value(p, point(k)) * (1 + relative(i)));
    }
  const std::vector<double> all = costs(sets);
  std::vector<double> out;
  for (Index k = 0; k < n; ++k) {
    // E = a + b x + c x², x relative; the least over the parabola is where 1 % is counted from.
    MatrixXd powers(each + 1, 3);
    VectorXd value(each + 1);
    for (Index i = 0; i <= each; ++i) {
      const double x = i < each ? relative(i) : 0;
      powers.row(i) << 1, x, x * x;
      value(i) = i < each ? all[static_cast<size_t>(1 + k * each + i)] : all[0];
    }
    const VectorXd c = powers.colPivHouseholderQr().solve(value);
    out.push_back(value.allFinite() && c(2) > 0 ? 100 * std::sqrt(0.01 * all[0] / c(2))
                                                : std::numeric_limits<double>::infinity());
  }
  return out;
}

}  // namespace selvedge::fit
