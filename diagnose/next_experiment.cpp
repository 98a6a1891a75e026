#include "diagnose/next_experiment.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>

#include <fmt/format.h>

#include "cloth/simulate.h"
#include "diagnose/group_statistics.h"
#include "model/trial_error.h"

namespace selvedge::diagnose {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

struct Candidate {
  std::string what, session;
  std::function<void(model::Prediction&)> change;
};

// The path run through `speed` times as fast, from the same start.
void speed_up(model::Prediction& p, double speed) {
  cloth::Experiment& e = p.experiment;
  const auto at = [&](double t) { return e.start_s + (t - e.start_s) / speed; };
  for (double& t : e.path.time_s) t = at(t);
  for (double& t : e.sample_s) t = at(t);
  e.path.left_slope *= speed;
  e.path.right_slope *= speed;
}

void spread_corners(model::Prediction& p, double by_m) {
  cloth::HeldPath& path = p.experiment.path;
  const Eigen::Vector3d along = (path.right.col(0) - path.left.col(0)).normalized();
  path.left.colwise() -= 0.5 * by_m * along;
  path.right.colwise() += 0.5 * by_m * along;
}

std::vector<Candidate> candidates(double width_m, double height_m, double mass_kg) {
  std::vector<Candidate> list =
      {
          {"repeat the motion 1.5 times as fast", "frequency", [](model::Prediction& p) { speed_up(p, 1.5); }},
          {"repeat the motion at 0.6 of its speed", "frequency", [](model::Prediction& p) { speed_up(p, 0.6); }},
          {"bring the held corners 20 mm nearer together", "separation",
           [](model::Prediction& p) { spread_corners(p, -0.02); }},
          {"move the held corners 10 mm further apart", "separation",
           [](model::Prediction& p) { spread_corners(p, 0.01); }},
          {"turn the swatch over, the inside out", "flip",
           [](model::Prediction& p) {
    p.experiment.material.rest_curvature_u *= -1;
    p.experiment.material.rest_curvature_v *= -1;
           }},
          {fmt::format("hang a weight of {:.1f} g on the middle of the lower edge", 250 * mass_kg), "weight",
           [=](model::Prediction& p) {
    cloth::Material& m = p.experiment.material;
    if (m.local_mass_kg != 0) return;  // the fabric has one already, as the hypothesis has it
    m.local_mass_kg = 0.25 * mass_kg;
    m.local_u_m = 0.5 * width_m;
    m.local_v_m = height_m;
           }},
                         };
  if (std::abs(width_m - height_m) < 1e-3)
    list.push_back({"turn the swatch by 90 degrees, so that it is held at another edge", "turn",
                    [](model::Prediction& p) {
      cloth::Material& m = p.experiment.material;
      m.stretch_anisotropy *= -1;
      m.bend_anisotropy *= -1;
      std::swap(m.rest_curvature_u, m.rest_curvature_v);
                    }});
  return list;
}

model::Prediction predicted(const Study& study, const PredictedSet& set, const VectorXd& x, size_t trial) {
  model::Prediction p;
  p.experiment = study.simulation->trials()[trial].experiment;
  p.experiment.start_shape = set.branches.branch[trial];
  for (size_t k = 0; k < study.parameters.size(); ++k)
    study.parameters[k].apply(p, model::to_value(study.parameters[k], x(static_cast<Index>(k))));
  return p;
}

// What is simulated of this trial and how it moved.
struct Foretold {
  const model::ObservedTrial* trial;
  model::Prediction what;
  cloth::Trajectory run;
  Eigen::Matrix3Xd at(double t_s) const {
    const double shown_s = model::stamp_drift(*trial, what).shown_at(t_s);
    return model::position_at(what.experiment, run, shown_s - what.sensor.delay_s);
  }
};

// Side by side in lanes.
std::vector<Foretold> foretold(const Study& study, size_t trial, std::vector<model::Prediction> predictions) {
  std::vector<cloth::Experiment> lanes;
  for (const model::Prediction& p : predictions) lanes.push_back(p.experiment);
  std::vector<cloth::Trajectory> runs = simulate(study.simulation->sheet(), lanes, study.simulation->options().sheet);
  std::vector<Foretold> out;
  for (size_t i = 0; i < runs.size(); ++i)
    out.push_back({&study.simulation->trials()[trial], std::move(predictions[i]), std::move(runs[i])});
  return out;
}

// Root mean square distance of what the two show, over vertices and samples, mm.
double apart_mm(const Foretold& a, const Foretold& b) {
  if (!a.run.finite || !b.run.finite) return 0;
  double sum = 0, count = 0;
  for (size_t i = 0; i < a.what.experiment.sample_s.size(); i += 6) {
    const double t = a.what.experiment.sample_s[i];
    sum += (a.at(t) - b.at(t)).squaredNorm();
    count += static_cast<double>(a.run.start.cols());
  }
  return 1e3 * std::sqrt(sum / std::max(count, 1.0));
}

// Of two sets that differ: as it was recorded, and then under each of the candidates.
using Pair = std::array<std::vector<Foretold>, 2>;

Pair foretold_under(const Study& study, size_t trial, const std::array<model::Prediction, 2>& recorded,
                    const std::vector<Candidate>& list) {
  std::vector<model::Prediction> all;
  for (const model::Prediction& r : recorded) {
    all.push_back(r);
    for (const Candidate& c : list) {
      all.push_back(r);
      c.change(all.back());
    }
  }
  std::vector<Foretold> found = foretold(study, trial, std::move(all));
  const auto middle = found.begin() + static_cast<std::ptrdiff_t>(1 + list.size());
  return {std::vector<Foretold>(std::make_move_iterator(found.begin()), std::make_move_iterator(middle)),
          std::vector<Foretold>(std::make_move_iterator(middle), std::make_move_iterator(found.end()))};
}

// Excursion and frequency of the moved corner: half the span along its main axis, and crossings of the middle.
struct Wave {
  double amplitude_m = 0, frequency_hz = 1;
};

Wave wave_of(const cloth::HeldPath& path) {
  Index axis = 0;
  const Eigen::Vector3d span = path.right.rowwise().maxCoeff() - path.right.rowwise().minCoeff();
  const double most = span.maxCoeff(&axis),
               middle = 0.5 * (path.right.row(axis).maxCoeff() + path.right.row(axis).minCoeff());
  int crossings = 0;
  for (Index i = 0; i + 1 < path.right.cols(); ++i)
    crossings += (path.right(axis, i) < middle) != (path.right(axis, i + 1) < middle);
  const double duration_s = path.time_s.back() - path.time_s.front();
  return {0.5 * most, duration_s > 0 ? std::max(0.2, 0.5 * crossings / duration_s) : 1};
}

std::string session_of(const Candidate& c, const model::ObservedTrial& t, const model::Prediction& changed) {
  const Wave wave = wave_of(changed.experiment.path);
  std::string text = fmt::format(
      "# Proposed by `./selvedge diagnose`: {}.\n# Put these sections into the rig's configuration and run a "
      "session.\n",
      c.what);
  if (c.session == "flip" || c.session == "turn" || c.session == "weight")
    text += fmt::format("# By hand, before the trial: {}.\n", c.what);
  if (c.session == "separation")
    text += fmt::format("\n[arm]\ncorner_distance_m = {:.3f}\n",
                        (changed.experiment.path.right.col(0) - changed.experiment.path.left.col(0)).norm());
  text += fmt::format("\n[session]\ntrials = [\"next-1\", \"next-2\"]\n");
  for (const char* name : {"next-1", "next-2"})
    text +=
        fmt::format("\n[session.{}]\nkind = \"{}\"\nduration_s = {:.1f}\namplitude_m = {:.3f}\nfrequency_hz = {:.2f}\n",
                    name, t.kind == trial::Experiment::robot ? "robot" : "waving",
                    std::max(2.0, changed.experiment.sample_s.back() - changed.experiment.start_s + 0.7),
                    wave.amplitude_m, wave.frequency_hz);
  return text;
}

// The number of trials where none moves.
size_t first_moving(const Study& study) {
  size_t i = 0;
  while (i < study.simulation->trials().size() && study.simulation->trials()[i].still) ++i;
  return i;
}

}  // namespace

NextExperiment propose_experiment(const Study& study, const std::vector<PredictedSet>& sets,
                                  const std::map<std::string, double>& probability) {
  NextExperiment out;
  std::vector<const PredictedSet*> order;
  for (const PredictedSet& s : sets)
    if (probability.contains(s.name)) order.push_back(&s);
  const auto chance = [&](const PredictedSet* s) { return probability.at(s->name); };
  std::stable_sort(order.begin(), order.end(),
                   [&](const PredictedSet* a, const PredictedSet* b) { return chance(a) > chance(b); });
  const size_t moving = first_moving(study);
  if (order.size() < 2 || moving == study.simulation->trials().size()) {
    out.what = "record a trial in which the fabric moves";
    return out;
  }
  const model::ObservedTrial& t = study.simulation->trials()[moving];
  const model::Prediction likeliest = predicted(study, *order[0], order[0]->x, moving);
  const double mass_kg = t.experiment.material.density * t.width_m * t.height_m,
               least_mm = study.simulation->sd_mm(moving).minCoeff();
  out.like_trial = t.name;
  const std::vector<Candidate> list = candidates(t.width_m, t.height_m, mass_kg);
  // The second likeliest, or the next one where no experiment shows what differs.
  for (size_t k = 1; k < order.size(); ++k) {
    const std::vector<std::string> pair = {order[0]->name, order[k]->name};
    const auto [first, second] =
        foretold_under(study, moving, {likeliest, predicted(study, *order[k], order[k]->x, moving)}, list);
    const double present_mm = apart_mm(first[0], second[0]);
    for (size_t i = 0; i < list.size(); ++i) {
      const double mm = apart_mm(first[1 + i], second[1 + i]);
      if (mm <= std::max(out.predicted_mm, least_mm)) continue;
      out.predicted_mm = mm;
      out.present_mm = present_mm;
      out.separates = pair;
      out.session = list[i].session;
      out.session_toml = session_of(list[i], t, first[1 + i].what);
      out.what = fmt::format("{}: {} and {} would then lie {:.1f} mm apart, {:.1f} mm as recorded in {}", list[i].what,
                             pair[0], pair[1], mm, present_mm, t.name);
    }
    if (!out.separates.empty()) return out;
  }
  out.what = fmt::format(
      "none of the experiments that the rig can run takes {} and the effects that come nearest further apart than "
      "{:.1f} mm",
      order[0]->name, least_mm);
  return out;
}

Forecast forecast(const Study& study, const PredictedSet& base, const PredictedSet& named, double named_left_mm) {
  constexpr double kFaster = 1.2;
  Forecast out;
  const size_t moving = first_moving(study);
  if (moving == study.simulation->trials().size()) return out;
  // Pairs of the base and the named set: of all trials, then without each group.
  std::vector<model::Prediction> faster;
  const auto add = [&](const PredictedSet& set, const VectorXd& x) {
    faster.push_back(predicted(study, set, x, moving));
    speed_up(faster.back(), kFaster);
  };
  add(base, base.x);
  add(named, named.x);
  for (size_t g = 0; g < base.without.size(); ++g) {
    add(base, base.without[g]);
    add(named, named.without[g]);
  }
  const std::vector<Foretold> all = foretold(study, moving, std::move(faster));
  const auto effect_mm = [&](size_t pair) {
    const Foretold &a = all[2 * pair], &b = all[2 * pair + 1];
    return a.run.finite && b.run.finite ? apart_mm(a, b) : std::numeric_limits<double>::quiet_NaN();
  };
  // Of the base, which lacks so much of what the named set leaves.
  const auto before_mm = [&](double lacks_mm) { return std::hypot(lacks_mm, named_left_mm); };
  const double lacks_mm = effect_mm(0);
  if (std::isnan(lacks_mm)) return out;
  const model::ObservedTrial& like = study.simulation->trials()[moving];
  out.like_trial = like.name;
  out.speed = kFaster;
  out.moving_s = like.experiment.sample_s.back() - model::first_move_s(like);
  out.motion = fmt::format("{} at {:.1f} times its speed", out.like_trial, out.speed);
  out.before_mm = before_mm(lacks_mm);
  out.after_mm = named_left_mm;
  VectorXd folds(static_cast<Index>(base.without.size()));
  for (Index g = 0; g < folds.size(); ++g) folds(g) = effect_mm(1 + static_cast<size_t>(g));
  const double half_mm = 1.645 * jackknife_sd(folds);
  out.low_mm = before_mm(std::max(lacks_mm - half_mm, 0.0));  // NaN stays: it is the first
  out.high_mm = before_mm(lacks_mm + half_mm);
  return out;
}

}  // namespace selvedge::diagnose
