#include "diagnose/diagnosis.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <limits>

#include <fmt/format.h>

#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>

#include <nlohmann/json.hpp>

#include "diagnose/weighing.h"
#include "estimate/kept_input.h"
#include "fit/fit_report.h"

namespace selvedge::diagnose {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// Shares of the work that are done when stages begin, of a campaign of seven trials of markers whose fit is there.
struct SharesAt {
  double windows, likeliest, next;
};
constexpr SharesAt kBegin = {0.02, 0.78, 0.97};

class Stages {
 public:
  explicit Stages(Diagnosis& out) : out_(out), begin_(std::chrono::steady_clock::now()), last_(begin_) {}
  void done(const std::string& name) {
    const auto now = std::chrono::steady_clock::now();
    out_.stage_s.emplace_back(name, std::chrono::duration<double>(now - last_).count());
    last_ = now;
  }
  double total() const { return std::chrono::duration<double>(last_ - begin_).count(); }

 private:
  Diagnosis& out_;
  std::chrono::steady_clock::time_point begin_, last_;
};

report::ProgressCallback part(const report::ProgressCallback& whole, double from, double to) {
  return [=](double done, const std::string& what) { whole(from + (to - from) * done, what); };
}

// Pooled over groups, before and after.
GapReduction reduction_of(const Study& study, const HeldOut& before, const HeldOut& after, const HeldOut& noise) {
  const auto fraction = [&](const std::vector<size_t>& groups) {
    const double gap = before.mm(groups) - noise.mm(groups);
    return gap > 1e-6 ? (before.mm(groups) - after.mm(groups)) / gap : 0;
  };
  const size_t groups = study.groups.size();
  const double all = fraction(all_groups(groups));
  // Trials to come vary as much as these: hence √2.
  const double half = std::sqrt(2.0) * half_interval(groups, fraction);
  return {before.mm(), after.mm(), all, all - half, all + half};
}

double size_share(const Protocol& protocol, Side side) {
  const bool of_rig = side == Side::measurement || side == Side::boundary || side == Side::aerodynamic;
  return of_rig ? protocol.rig_size_share : protocol.fabric_size_share;
}

// The evidence's interval, joined with what a model of another form than nature's is usually off by.
std::vector<SizedParameter> size_of(const Study& study, const Linearisation& about, const Arm& arm,
                                    const Posterior& posterior, size_t effect) {
  const double k90 = boost::math::quantile(boost::math::normal(), 0.95);
  const Effect& e = study.effects[effect];
  const double form_share = k90 * size_share(study.protocol, e.side);
  std::vector<SizedParameter> out;
  const auto add = [&](const model::Parameter& p, double coordinate, double deviation) {
    const double value = model::to_value(p, coordinate),
                 half = std::hypot(k90 * std::abs(model::to_value(p, deviation)), form_share * std::abs(value));
    out.push_back({p.name, p.unit, value, std::max(p.lower, value - half), std::min(p.upper, value + half)});
  };
  for (const Way& way : about.ways) {
    if (way.effect != effect || arm.sizes[static_cast<size_t>(way.columns[0])] != Size::free) continue;
    if (!way.units.empty()) {
      const VectorXd at = effect_at(study, way, posterior.mean);
      add(e.parameters[0], at(0), deviation_at(study, way, posterior));
      for (Index j = 1; j < at.size(); ++j) add(e.parameters[static_cast<size_t>(j)], at(j), 0);
      continue;
    }
    for (const Index k : way.columns) {
      const Column& c = about.columns[static_cast<size_t>(k)];
      add(study.parameters[static_cast<size_t>(c.coordinate)],
          std::clamp(arm.x(c.coordinate) + posterior.mean(k), c.lower, c.upper), posterior.sd(k));
    }
  }
  return out;
}

std::map<std::string, double> values_of(const Study& study, const VectorXd& x) {
  std::map<std::string, double> out;
  for (size_t k = 0; k < study.first_force; ++k)
    out[study.parameters[k].name] = model::to_value(study.parameters[k], x(static_cast<Index>(k)));
  return out;
}

// The smallest set of effects that holds `credible` of what the effects have together.
std::vector<std::string> credible_set(const std::map<std::string, double>& probability, double credible) {
  std::vector<std::pair<double, std::string>> effects;
  double sum = 0;
  for (const auto& [name, p] : probability)
    if (name != "none" && name != "unknown") {
      effects.emplace_back(p, name);
      sum += p;
    }
  std::sort(effects.rbegin(), effects.rend());
  std::vector<std::string> set;
  double held = 0;
  for (const auto& [p, name] : effects) {
    if (held >= credible * sum) break;
    set.push_back(name);
    held += p;
  }
  return set;
}

// How unlikely it is that groups of trials show so much more than a right model leaves: t test of the logarithms.
double p_of_gap(const HeldOut& before, double right_mm) {
  std::vector<double> excess;
  for (Index g = 0; g < before.rows.size(); ++g)
    if (before.rows(g) > 0) excess.push_back(std::log(before.mm({static_cast<size_t>(g)}) / right_mm));
  return p_above_zero(excess);
}

// Share of each effect's change that a refit of the base takes up, and of the residual that it explains beyond that.
void fill_screened(const Study& study, const Linearisation& about, std::vector<EffectFinding>& effects) {
  const BeyondBase beyond(about.changes.leftCols(static_cast<Index>(study.base_count)));
  const VectorXd left = beyond.of(about.residual);
  for (size_t e = 0; e < effects.size(); ++e) {
    std::vector<Index> columns;
    for (const Way& way : about.ways)
      if (way.effect == e) columns.insert(columns.end(), way.columns.begin(), way.columns.end());
    const MatrixXd all = about.changes(Eigen::all, columns), own = beyond.of(all);
    effects[e].absorbed = all.squaredNorm() > 0 ? 1 - own.squaredNorm() / all.squaredNorm() : 1;
    MatrixXd gram = own.transpose() * own;
    gram.diagonal().array() += 1e-9 * gram.trace() + 1e-30;
    const VectorXd with = own.transpose() * left;
    effects[e].screened_gain = std::clamp(with.dot(gram.ldlt().solve(with)) / left.squaredNorm(), 0.0, 1.0);
  }
}

// What all looks at sets need.
struct Weighed {
  Study& study;
  const Windows& windows;
  const Evidence& evidence;
  HeldOut noise;
};

// A set of effects in trials that it was not fitted to, and the base with its effects neutral.
struct LookedAt {
  const Linearisation& about;
  Arm arm;
  size_t scale = 0;
  Posterior posterior;
  HeldOut before, after;
  PredictedSet without, with;
  std::vector<Share> parts;
  Share unexplained = {1, 1, 1};
};

LookedAt look_at(const Weighed& w, const Linearisation& about, const EffectSet& set) {
  LookedAt out{about, arm_at(w.study, about, set.chosen), set.scale, {}, {}, {}, {}, {}, {}};
  Arm neutral = out.arm;
  for (size_t k = 0; k < neutral.sizes.size(); ++k)
    if (neutral.sizes[k] == Size::free) neutral.sizes[k] = Size::neutral;
  out.posterior = posterior_of(w.study, w.evidence, out.arm, set.scale);
  out.after = hold_out(w.study, w.windows, w.evidence, out.arm, set.scale, out.arm.effects);
  out.before = hold_out(w.study, w.windows, w.evidence, out.arm, set.scale, {},
                        beyond_derivatives(w.study, w.windows, w.evidence, out.arm, set.scale, {}));
  const VectorXd d = posterior_of(w.study, w.evidence, neutral, set.scale).mean;
  out.without = {"none", estimate_of(w.study, about, neutral, d), out.before.coordinates};
  out.with = {name_of(w.study, out.arm.effects), estimate_of(w.study, about, out.arm, out.posterior.mean),
              out.after.coordinates};
  if (!out.arm.effects.empty())
    out.parts = shares_of(w.study, w.windows, w.evidence, out.arm, set.scale, out.unexplained);
  return out;
}

// Where the base leaves little more than a right model does, nothing is left to take.
GapTaken taken_by(const LookedAt& l, const HeldOut& noise, const Protocol& protocol) {
  GapTaken out;
  for (const Share& part : l.parts) out.parts.push_back(part.value);
  const double before = std::pow(l.before.mm(), 2), right = std::pow(noise.mm(), 2) + std::pow(protocol.form_mm, 2);
  if (before > protocol.explains_over * right) out.explained = (before - std::pow(l.after.mm(), 2)) / (before - right);
  return out;
}

void fill_gap(Diagnosis& out, const Study& study, const HeldOut& before, const HeldOut& noise) {
  out.is_ahead = before.dimensions == 3;
  out.before_mm = before.mm();
  out.noise_floor_mm = noise.mm();
  out.right_floor_mm = std::hypot(noise.mm(), study.protocol.form_mm);
  out.gap_mm = out.low_mm = out.high_mm = out.before_mm - out.noise_floor_mm;
  out.groups = study.groups.size();
  out.p_value = p_of_gap(before, out.right_floor_mm);
  const double half = half_interval(
      study.groups.size(), [&](const std::vector<size_t>& groups) { return before.mm(groups) - noise.mm(groups); });
  out.low_mm -= half;
  out.high_mm += half;
}

void list_effects(Diagnosis& out, const Study& study, const Linearisation& about) {
  for (size_t e = 0; e < study.effects.size(); ++e) {
    EffectFinding& f = out.effects.emplace_back();
    f.name = study.effects[e].name;
    f.summary = study.effects[e].summary;
    f.side = study.effects[e].side;
    if (!about.can_tell[e]) out.cannot_tell.push_back(f.name);
  }
  fill_screened(study, about, out.effects);
}

void list_parameters(Diagnosis& out, const Study& study, const VectorXd& base, const VectorXd& likeliest) {
  for (size_t k = 0; k < study.base_count; ++k) {
    const model::Parameter& p = study.parameters[k];
    const double x = base(static_cast<Index>(k));
    out.parameters.push_back(
        {p.name, p.unit, model::to_value(p, x), model::to_value(p, likeliest(static_cast<Index>(k)))});
    if (x >= model::to_coordinate(p, p.upper) - 1e-3 || x <= model::to_coordinate(p, p.lower) + 1e-3)
      out.remarks.push_back(
          fmt::format("{} of the base model ends at its bound {:.3g} {}", p.name, model::to_value(p, x), p.unit));
  }
}

void list_measured(Diagnosis& out, const Measured& measured) {
  if (measured.held_m > 0)
    out.remarks.push_back(fmt::format(
        "markers on held points lie {:.1f} mm (root mean square) from the grips' path, which no physics lets "
        "them leave",
        1e3 * measured.held_m));
  if (measured.delay) out.remarks.push_back(in_words(*measured.delay));
}

std::string settings_of(const StudyOptions& study) {
  std::string text = std::string(model::to_text(study.drag)) + ' ' + nlohmann::json(study.protocol).dump();
  if (study.fitted)
    for (const double x : *study.fitted) text += fmt::format(" {}", x);
  return text;
}

}  // namespace

void keep_base_fit(DiagnosisOptions& options, const std::filesystem::path& file, const trial::Campaign& campaign) {
  const std::string input = estimate::input_hash(estimate::recordings_hash(campaign), settings_of(options.study));
  options.study.base_fit = read_base_fit(file, input);
  options.on_base_fit = [file, input](const BaseFit& fit) { write_base_fit(file, fit, input); };
}

std::optional<std::filesystem::path> begin_with_fit(DiagnosisOptions& options, const trial::Campaign& campaign,
                                                    const std::vector<std::filesystem::path>& folders) {
  for (const std::filesystem::path& folder : folders) {
    const std::filesystem::path file = folder / "fit.json";
    if (!std::filesystem::exists(file)) continue;
    options.study.fitted = fit::read_fit(file, fit::input_of(estimate::recordings_hash(campaign), options.study.drag),
                                         model::base_parameters(options.study.drag));
    if (options.study.fitted) return file;
  }
  return {};
}

Diagnosis diagnose(const trial::Campaign& campaign, const std::vector<Effect>& effects,
                   const DiagnosisOptions& options) {
  Diagnosis out;
  Stages stages(out);
  const std::clock_t cpu = std::clock();
  const report::ProgressCallback& progress = options.study.progress;
  StudyOptions study_options = options.study;
  const bool is_fitted = options.study.fitted || options.study.base_fit;
  const double fit_share = is_fitted ? kBegin.windows : 0.4;
  study_options.progress = part(progress, 0, fit_share);
  const double imitated_at = options.other ? 0.5 * (1 + fit_share) : fit_share;
  const report::ProgressCallback after = part(progress, imitated_at, 1);
  FittedStudy fitted = make_study(campaign, effects, study_options);
  Study& study = fitted.study;
  out.base_fit = fitted.base_fit;
  if (options.on_base_fit) options.on_base_fit(out.base_fit);
  out.protocol = study.protocol;
  out.campaign = study.campaign;
  out.input = estimate::input_hash(estimate::recordings_hash(campaign), settings_of(options.study));
  out.doubts = study.doubts;
  out.remarks = study.remarks;
  out.cells = study.simulation->options().cells;
  out.fine_cells = study.fine->options().cells;
  out.base = model::to_text(options.study.drag);
  stages.done("base");

  std::optional<Imitation> imitation;
  if (options.other) {
    StudyOptions like = options.study;
    like.progress = part(progress, fit_share, imitated_at);
    imitation = imitate(campaign, like, *options.other);
    stages.done("imitating " + options.other->simulator->name());
  }
  const Windows windows(*study.simulation, study.protocol);
  WeighingOptions weighing_options;
  weighing_options.begins = part(after, kBegin.windows, kBegin.likeliest);
  weighing_options.ends = [&](const std::string& stage) { stages.done(stage); };
  const Weighing weighing = weigh(study, windows, weighing_options);
  const Linearisation& none = weighing.none;
  const Evidence& evidence = *weighing.evidence;
  Verdict verdict = weighing.verdict;

  // The likeliest sets, each in trials that it was not fitted to, beside the base without their effects.
  after(kBegin.likeliest, "how much each effect takes");
  list_effects(out, study, none);
  const Weighed weighed{study, windows, evidence, noise_of(study, windows, evidence)};
  std::vector<LookedAt> looked_at;
  std::map<std::vector<size_t>, GapTaken> taken;
  const auto look = [&](const std::vector<size_t>& effects_of) {
    looked_at.push_back(look_at(weighed, weighing.about(effects_of), weighing.set_of(effects_of)));
    if (!effects_of.empty()) taken[effects_of] = taken_by(looked_at.back(), weighed.noise, study.protocol);
  };
  look(verdict.weights.front().effects);
  for (const Weight& w : verdict.weights) {
    if (looked_at.size() >= static_cast<size_t>(study.protocol.leaders)) break;
    if (!w.effects.empty() && !taken.contains(w.effects) && w.effects != looked_at.front().arm.effects) look(w.effects);
  }
  const LookedAt& likeliest = looked_at.front();
  fill_gap(out, study, likeliest.before, weighed.noise);
  out.likeliest = name_of(study, likeliest.arm.effects);
  out.fit["none"] = values_of(study, likeliest.without.x);
  std::vector<PredictedSet> predicted = {likeliest.without};
  for (const LookedAt& l : looked_at) {
    if (l.arm.effects.empty()) continue;
    predicted.push_back(l.with);
    out.fit[l.with.name] = values_of(study, l.with.x);
    for (const size_t e : l.arm.effects) {
      EffectFinding& f = out.effects[e];
      if (f.weighed) continue;
      f.weighed = true;
      f.size = size_of(study, l.about, l.arm, l.posterior, e);
      f.reduction = reduction_of(study, l.before, l.after, weighed.noise);
    }
  }
  verdict = judge(study, weighing.sets, evidence.error().scales, taken);
  for (size_t k = 0; k < likeliest.parts.size(); ++k)
    out.budget.parts.push_back({study.effects[likeliest.arm.effects[k]].name, 0, likeliest.parts[k]});
  out.budget.unexplained = likeliest.unexplained;
  out.missing_force = missing_force(study, windows, evidence, likeliest.arm, likeliest.scale);
  std::vector<Shown> shown = {{"the base model", likeliest.without.x, likeliest.before.residual}};
  if (!likeliest.arm.effects.empty())
    shown.push_back({"with " + out.likeliest, likeliest.with.x, likeliest.after.residual});
  out.replay = replay(study, windows, shown, out.missing_force);
  out.budget.total_mm = out.before_mm;
  out.budget.noise_mm = out.noise_floor_mm;
  for (BudgetPart& p : out.budget.parts) p.probability = verdict.inclusion.at(p.effect);
  for (size_t k = 0; k < std::min<size_t>(verdict.weights.size(), 10); ++k) {
    const Weight& w = verdict.weights[k];
    out.sets.push_back({name_of(study, w.effects), w.and_unknown, w.probability, evidence.error().scales[w.scale]});
  }
  out.probability = verdict.probability;
  out.inclusion = verdict.inclusion;
  for (EffectFinding& f : out.effects) {
    f.probability = out.probability.at(f.name);
    f.inclusion = out.inclusion.at(f.name);
  }
  out.cause = cause_of(out.probability, out.inclusion, out.budget);
  const auto named =
      std::find_if(out.effects.begin(), out.effects.end(), [&](const EffectFinding& f) { return f.name == out.cause; });
  out.side = named == out.effects.end() ? out.cause : to_text(named->side);
  if (out.cause != "none") out.confusable = credible_set(out.probability, study.protocol.credible);
  if (imitation) {
    out.other = simulator_gap(study, windows, evidence, likeliest.arm, likeliest.with.x, *imitation);
    out.other.name = options.other->simulator->name();
    out.other.identity = options.other->simulator->identity();
  }
  list_measured(out, study.measured);
  list_parameters(out, study, likeliest.without.x, likeliest.with.x);
  stages.done("budget");

  const Where where = split_residual(study, by_trial(study, windows, likeliest.before.residual), out.noise_floor_mm);
  out.where = where.cells;
  out.map = where.map;
  if (!likeliest.arm.effects.empty()) {
    const Where after_it =
        split_residual(study, by_trial(study, windows, likeliest.after.residual), out.noise_floor_mm);
    if (after_it.map.uv == where.map.uv) out.map.after_mm = after_it.map.at_mm;
  }
  stages.done("where");
  after(kBegin.next, "what to record next");
  const NextExperiment next = propose_experiment(study, predicted, out.probability);
  out.separates = next.separates;
  out.next_experiment = next.what;
  out.next_session = next.session_toml;
  if (out.likeliest != "none" && out.cause != "unknown" && named != out.effects.end())
    out.forecast = forecast(study, likeliest.without, likeliest.with, likeliest.after.mm());
  stages.done("next experiment");
  std::stable_sort(out.effects.begin(), out.effects.end(), [](const EffectFinding& a, const EffectFinding& b) {
    return a.weighed != b.weighed ? a.weighed : a.probability > b.probability;
  });
  out.evaluations = study.evaluations;
  out.wall_s = stages.total();
  out.cpu_s = static_cast<double>(std::clock() - cpu) / CLOCKS_PER_SEC;
  progress(1, "done");
  return out;
}

}  // namespace selvedge::diagnose
