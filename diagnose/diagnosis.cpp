#include "diagnose/diagnosis.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <numeric>
#include <random>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>

#include <Eigen/Cholesky>

#include <nlohmann/json.hpp>

#include "diagnose/ahead.h"
#include "estimate/kept_input.h"
#include "estimate/least_squares.h"
#include "estimate/robust_cost.h"
#include "fit/fit_report.h"

namespace selvedge::diagnose {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// Shares of the work that are done when stages begin, as they were measured of seven trials of markers.
struct SharesAt {
  double screening, refitting, finer_grid, held_out, in_full, two_effects, ahead, free, next;
};
constexpr SharesAt kBegin = {0.40, 0.49, 0.61, 0.74, 0.75, 0.83, 0.89, 0.92, 0.98};

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

// Share of an effect's finite change that a refit of the base takes up.
double absorbed_share(const Study& study, const Hypothesis& h) {
  const Index base = static_cast<Index>(study.base_count), own = h.jacobian.cols() - base;
  if (own <= 0) return 0;
  const MatrixXd e = h.jacobian.rightCols(own);
  const MatrixXd& j = study.jacobian;
  const MatrixXd normal =
      j.transpose() * j + 1e-6 * j.squaredNorm() / static_cast<double>(base) * MatrixXd::Identity(base, base);
  const MatrixXd left = e - j * normal.ldlt().solve(j.transpose() * e);
  return e.squaredNorm() > 0 ? 1 - left.squaredNorm() / e.squaredNorm() : 1;
}

// The effects to refit on the fine grid, behind the base: those that explain most after their first refit, and as many
// of those whose finite change explains most. The first step of a refit may fail where an effect is large.
std::vector<Hypothesis> finalists(const std::vector<Hypothesis>& all, size_t count) {
  std::vector<size_t> order;
  for (size_t i = 1; i < all.size(); ++i) order.push_back(i);
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) { return all[a].cost < all[b].cost; });
  const auto half = order.begin() + static_cast<std::ptrdiff_t>(std::min((count + 1) / 2, order.size()));
  std::stable_sort(half, order.end(), [&](size_t a, size_t b) { return all[a].screened_gain > all[b].screened_gain; });
  std::vector<Hypothesis> few = {all[0]};
  for (size_t k = 0; k < std::min(count, order.size()); ++k) few.push_back(all[order[k]]);
  return few;
}

// Effects of how the fabric deforms are refitted from the other start as well; what leaves less is kept.
void refit_from_other_start(Study& study, std::vector<Hypothesis>& all) {
  std::vector<size_t> effects;
  for (size_t e = 0; e < study.effects.size(); ++e)
    if (const Effect& effect = study.effects[e];
        (effect.side == Side::elastic || effect.side == Side::dissipative) && effect.starts.empty())
      effects.push_back(e);
  if (effects.empty()) return;
  const MatrixXd columns = screen(study, *study.other_start, effects);
  std::vector<Hypothesis> arms;
  for (const size_t e : effects) arms.push_back(make_hypothesis(study, *study.other_start, {e}, columns));
  refit(study, arms, 3);
  for (Hypothesis& arm : arms) {
    Hypothesis& before = all[arm.effects[0] + 1];
    arm.screened_gain = before.screened_gain;
    if (arm.cost < before.cost) before = std::move(arm);
  }
}

// Derivatives afresh for those that came far from the base fit.
void relinearise_far(Study& study, std::vector<Hypothesis>& arms) {
  const auto n = static_cast<Index>(study.base_count);
  for (Hypothesis& arm : arms) {
    if ((arm.x - study.base).head(n).cwiseAbs().maxCoeff() < study.protocol.far) continue;
    std::vector<Hypothesis> one = {std::move(arm)};
    relinearise(study, one);
    arm = std::move(one[0]);
  }
}

// What to fit in full: the effect that predicts best, that of the others whose finite change explains most, and the
// base, which is to have every chance that an effect has.
std::vector<size_t> in_full(const std::vector<Hypothesis>& few, const std::vector<double>& log_ratio) {
  std::vector<size_t> order;
  for (size_t i = 1; i < few.size(); ++i) order.push_back(i);
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) { return log_ratio[a] > log_ratio[b]; });
  std::stable_sort(order.begin() + 1, order.end(),
                   [&](size_t a, size_t b) { return few[a].screened_gain > few[b].screened_gain; });
  order.resize(std::min<size_t>(order.size(), 2));
  order.push_back(0);
  return order;
}

std::string best_of(const std::map<std::string, double>& probability) {
  return std::max_element(probability.begin(), probability.end(),
                          [](const auto& a, const auto& b) { return a.second < b.second; })
      ->first;
}

// Whether to fit in full before it is said what scores say.
bool is_in_doubt(const Study& study, const Scores& scores) {
  const std::string first = best_of(scores.probability);
  const double p = scores.probability.at(first);
  return first == "unknown" || (first == "none" && study.nudged && p < study.protocol.plainly_none);
}

size_t least_cost(const std::vector<Hypothesis>& arms) {
  return static_cast<size_t>(
      std::min_element(arms.begin(), arms.end(),
                       [](const Hypothesis& a, const Hypothesis& b) { return a.cost < b.cost; }) -
      arms.begin());
}

// The study's state with what the fine grid adds at this hypothesis.
model::State state_of(const Study& study, const Hypothesis& h) {
  model::State state = study.state;
  state.grid_correction_mm = study.mesh_change;
  for (size_t trial = 0; h.mesh_offset.size() && trial < study.mesh_change.size(); ++trial) {
    const Index first = study.rows->first(trial), count = study.rows->count(trial);
    state.grid_correction_mm[trial] +=
        h.mesh_offset.segment(first, count).cwiseProduct(study.rows->sd_mm().segment(first, count));
  }
  return state;
}

// Damping and drag as they usually are, shear as of an isotropic sheet, the rest as it is: in the base fit they stood
// in for what the base lacks, and where one of them does nothing, or is on its bound, least squares do not find the way
// back.
VectorXd as_usual(const Study& study, VectorXd x) {
  for (size_t k = 0; k < study.base_count; ++k)
    if (const model::Parameter& p = study.parameters[k]; !p.at_rest)
      x(static_cast<Index>(k)) = model::to_coordinate(p, p.start);
  return with_isotropic_shear(study, std::move(x));
}

// Least squares from where each of these has come to, with what the fine grid adds there, and from usual damping, drag
// and shear, but for two effects, which go on from one that was fitted so; once more those that came far.
void fit_further(Study& study, std::vector<Hypothesis>& arms, std::vector<size_t> few,
                 const report::ProgressCallback& progress) {
  constexpr double kFirstRound = 0.8;  // of the time
  const double round_share = kFirstRound / static_cast<double>(few.size());
  double done = 0;
  bool is_first = true;
  for (const int iterations : {3, 2}) {
    std::vector<Hypothesis> moving;
    for (const size_t i : few) {
      progress(done, "fitting in full: " + name_of(study, arms[i]));
      std::vector<Hypothesis> tried = {arms[i]};
      if (is_first && arms[i].effects.size() < 2) {
        tried.push_back(arms[i]);
        tried.back().x = as_usual(study, arms[i].x);
      }
      for (Hypothesis& h : tried) {
        model::State state = state_of(study, h);
        const estimate::LeastSquaresResult fitted =
            minimise(*study.simulation, state, model::only(study.parameters, h.active, h.x), h.x(h.active),
                     search_options(iterations, study.protocol.full_refit_enough));
        h.x(h.active) = fitted.coordinates;
        study.evaluations += fitted.evaluations;
      }
      refine_mesh(study, tried);
      moving.push_back(tried[least_cost(tried)]);
      if (is_first) done += round_share;
    }
    relinearise(study, moving);
    std::vector<size_t> far;
    for (size_t k = 0; k < few.size(); ++k) {
      Hypothesis& arm = arms[few[k]];
      if (moving[k].cost < (1 - study.protocol.far_cost) * arm.cost) far.push_back(few[k]);
      if (moving[k].cost < arm.cost) arm = std::move(moving[k]);
    }
    few = std::move(far);
    is_first = false;
    if (few.empty()) break;
  }
}

// Pooled error of some groups, drawn with replacement where `draw` says so.
struct GroupErrors {
  std::vector<double> square, count;  // a group
  double mm(const std::vector<size_t>& draw) const {
    double s = 0, n = 0;
    for (const size_t g : draw) {
      s += square[g];
      n += count[g];
    }
    return std::sqrt(s / std::max(n, 1.0));
  }
};

GroupErrors errors_of(const Study& study, const VectorXd& mm_of_trial) {
  GroupErrors out;
  for (const std::vector<size_t>& group : study.groups) {
    double s = 0, n = 0;
    for (const size_t t : group) {
      const double rows = study.rows->seen().segment(study.rows->first(t), study.rows->count(t)).sum();
      const double mm = mm_of_trial(static_cast<Index>(t));
      if (!std::isfinite(mm)) continue;
      s += rows * mm * mm;
      n += rows;
    }
    out.square.push_back(s);
    out.count.push_back(n);
  }
  return out;
}

std::vector<size_t> in_order(size_t count) {
  std::vector<size_t> all(count);
  for (size_t i = 0; i < count; ++i) all[i] = i;
  return all;
}

// 5 % and 95 % of a figure under resampled groups.
template <class Figure>
std::pair<double, double> bootstrap(size_t groups, long count, const Figure& figure) {
  std::mt19937 generator(20260101);
  std::uniform_int_distribution<size_t> pick(0, groups - 1);
  std::vector<double> values;
  for (long b = 0; b < count; ++b) {
    std::vector<size_t> draw(groups);
    for (size_t& g : draw) g = pick(generator);
    const double v = figure(draw);
    if (std::isfinite(v)) values.push_back(v);
  }
  if (values.empty()) return {0, 0};
  std::sort(values.begin(), values.end());
  const auto at = [&](double share) {
    return values[static_cast<size_t>(share * static_cast<double>(values.size() - 1))];
  };
  return {at(0.05), at(0.95)};
}

// A figure of all groups but one, for each.
template <class Figure>
VectorXd leaving_one_out(size_t groups, const Figure& figure) {
  VectorXd without(static_cast<Index>(groups));
  for (size_t g = 0; g < groups; ++g) {
    std::vector<size_t> rest = in_order(groups);
    rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(g));
    without(static_cast<Index>(g)) = figure(rest);
  }
  return without;
}

// Half of a 90 % interval over its standard deviation, where that was found from so many groups.
double half_width(size_t groups) {
  return boost::math::quantile(boost::math::students_t(static_cast<double>(groups - 1)), 0.95);
}

GapReduction reduction_of(const GroupErrors& before, const GroupErrors& after, const GroupErrors& floor) {
  const size_t groups = before.square.size();
  const auto fraction = [&](const std::vector<size_t>& draw) {
    const double gap = before.mm(draw) - floor.mm(draw);
    return gap > 1e-6 ? (before.mm(draw) - after.mm(draw)) / gap : 0;
  };
  const std::vector<size_t> all = in_order(groups);
  // Trials to come vary as much as these: hence √2.
  const double half = groups > 1 ? half_width(groups) * std::sqrt(2.0) * jackknife_sd(leaving_one_out(groups, fraction))
                                 : std::numeric_limits<double>::quiet_NaN();
  return {before.mm(all), after.mm(all), fraction(all), fraction(all) - half, fraction(all) + half, false};
}

// Value at the fit to all trials; its interval joins what the jackknife over groups shows and what no trial shows: a
// model of another form than nature's has its best fit at another size.
std::vector<SizedParameter> size_of(const Study& study, const Hypothesis& h, const MatrixXd& folds, size_t effect,
                                    const Protocol& protocol) {
  std::vector<SizedParameter> out;
  const Effect& e = study.effects[effect];
  const double form_share = boost::math::quantile(boost::math::normal(), 0.95) * size_form_share(protocol, e.side);
  for (size_t k = 0; k < e.parameters.size(); ++k) {
    const model::Parameter& p = e.parameters[k];
    const auto at = static_cast<Index>(study.first_parameter[effect] + k);
    const VectorXd values = folds.row(at);
    const double half = study.groups.size() > 1 ? half_width(study.groups.size()) * jackknife_sd(values) : 0;
    const double x = h.x(at), value = model::to_value(p, x);
    // Components of one vector err by what all of it is.
    double square = 0;
    int alike = 0;
    for (size_t j = 0; j < e.parameters.size(); ++j) {
      if (e.parameters[j].unit != p.unit) continue;
      square +=
          std::pow(model::to_value(e.parameters[j], h.x(static_cast<Index>(study.first_parameter[effect] + j))), 2);
      ++alike;
    }
    const double form = form_share * std::max(std::abs(value), std::sqrt(square / alike));
    out.push_back({p.name, p.unit, value,
                   std::max(p.lower, value - std::hypot(value - model::to_value(p, x - half), form)),
                   std::min(p.upper, value + std::hypot(model::to_value(p, x + half) - value, form))});
  }
  return out;
}

// The smallest set of effects that holds credible of what the effects have together.
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

// Two effects at once: the best one with those of all others whose change of a finite size, from where it was fitted,
// explains most of what it leaves. An effect that a larger one hides is no finalist of its own.
std::vector<Hypothesis> pairs_with(Study& study, const Hypothesis& best) {
  std::vector<size_t> others;
  for (size_t e = 0; e < study.effects.size(); ++e)
    if (e != best.effects[0] && study.effects[e].name != "mesh_resolution") others.push_back(e);
  const MatrixXd columns = screen(study, best, others);
  std::vector<Hypothesis> pairs;
  for (const size_t e : others) {
    pairs.push_back(make_hypothesis(study, best, {e}, columns));
    pairs.back().effects = {best.effects[0], e};
  }
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const Hypothesis& a, const Hypothesis& b) { return a.screened_gain > b.screened_gain; });
  pairs.resize(std::min(pairs.size(), static_cast<size_t>(study.protocol.pairs)), best);
  return pairs;
}

// The `count` hypotheses beside the base that predict best.
std::vector<size_t> nearest_by(const std::vector<double>& log_ratio, size_t count) {
  std::vector<size_t> order;
  for (size_t i = 1; i < log_ratio.size(); ++i) order.push_back(i);
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) { return log_ratio[a] > log_ratio[b]; });
  order.resize(std::min(order.size(), count));
  return order;
}

// Of two effects the one that is likelier, alone and with the other.
std::string likelier_of(const Study& study, const Hypothesis& two, const std::map<std::string, double>& probability) {
  const std::string &a = study.effects[two.effects[0]].name, &b = study.effects[two.effects[1]].name;
  return probability.at(b) > probability.at(a) ? b : a;
}

void append(HeldOut& to, const HeldOut& more) {
  const Index before = to.mm.rows();
  to.mm.conservativeResize(before + more.mm.rows(), Eigen::NoChange);
  to.mm.bottomRows(more.mm.rows()) = more.mm;
  to.coordinates.insert(to.coordinates.end(), more.coordinates.begin(), more.coordinates.end());
  to.residual.insert(to.residual.end(), more.residual.begin(), more.residual.end());
}

// The base and some others of what was held out.
HeldOut only_rows(const HeldOut& all, const std::vector<size_t>& others) {
  HeldOut out{MatrixXd(static_cast<Index>(others.size() + 1), all.mm.cols()), {}, {}};
  for (size_t k = 0; k <= others.size(); ++k) {
    const size_t from = k == 0 ? 0 : others[k - 1];
    out.mm.row(static_cast<Index>(k)) = all.mm.row(static_cast<Index>(from));
    out.coordinates.push_back(all.coordinates[from]);
    out.residual.push_back(all.residual[from]);
  }
  return out;
}

// Predictions Protocol::ahead_s ahead of what was held out, arms × trial.
MatrixXd held_out_ahead(Study& study, const HeldOut& held) {
  MatrixXd mm = MatrixXd::Constant(static_cast<Index>(held.coordinates.size()),
                                   static_cast<Index>(study.rows->trials()), std::numeric_limits<double>::quiet_NaN());
  for (size_t g = 0; g < study.groups.size(); ++g) {
    MatrixXd sets(study.base.size(), mm.rows());
    for (Index k = 0; k < sets.cols(); ++k)
      sets.col(k) = held.coordinates[static_cast<size_t>(k)].col(static_cast<Index>(g));
    const MatrixXd found =
        ahead_mm(*study.fine, study.fine_state, study.protocol, study.parameters, sets, study.groups[g]);
    for (const size_t t : study.groups[g]) mm.col(static_cast<Index>(t)) = found.col(static_cast<Index>(t));
  }
  study.evaluations += 2 * static_cast<int>(mm.rows());
  return mm;
}

// Each refitted from where nudging has led it, and held out, without nudging.
HeldOut held_out_free(Study& study, std::vector<Hypothesis>& arms) {
  run_free(study);
  MatrixXd sets(study.base.size(), static_cast<Index>(arms.size()));
  for (Index i = 0; i < sets.cols(); ++i) sets.col(i) = arms[static_cast<size_t>(i)].x;
  const MatrixXd r = residuals_at(study, sets);
  study.evaluations += static_cast<int>(arms.size());
  for (Index i = 0; i < sets.cols(); ++i) {
    Hypothesis& h = arms[static_cast<size_t>(i)];
    h.mesh_offset.resize(0);
    h.residual = r.col(i);
    h.cost = estimate::cauchy_cost(h.residual, cauchy_constant(study));
  }
  refine_mesh(study, arms);
  relinearise(study, arms);
  refit(study, arms, 2);
  return hold_out(study, arms);
}

void list_parameters(Diagnosis& out, const Study& study, const Hypothesis& base, const Hypothesis* named) {
  for (size_t k = 0; k < study.base_count; ++k) {
    const model::Parameter& p = study.parameters[k];
    const double x = base.x(static_cast<Index>(k));
    out.parameters.push_back(
        {p.name, p.unit, model::to_value(p, x), model::to_value(p, (named ? *named : base).x(static_cast<Index>(k)))});
    if (x >= model::to_coordinate(p, p.upper) - 1e-3 || x <= model::to_coordinate(p, p.lower) + 1e-3)
      out.remarks.push_back(
          fmt::format("{} of the base fit ends at its bound {:.3g} {}", p.name, model::to_value(p, x), p.unit));
  }
}

report::ProgressCallback part(const report::ProgressCallback& whole, double from, double to) {
  return [=](double done, const std::string& what) { whole(from + (to - from) * done, what); };
}

void fill_gap(Diagnosis& out, const GroupErrors& before, const GroupErrors& noise, const GroupErrors& right) {
  const std::vector<size_t> all = in_order(before.square.size());
  out.before_mm = before.mm(all);
  out.noise_floor_mm = noise.mm(all);
  out.right_floor_mm = right.mm(all);
  out.gap_mm = out.before_mm - out.noise_floor_mm;
  std::tie(out.low_mm, out.high_mm) =
      bootstrap(all.size(), out.protocol.bootstraps,
                [&](const std::vector<size_t>& draw) { return before.mm(draw) - noise.mm(draw); });
}

Judged judged_by(const Study& study, const std::vector<Hypothesis>& few, const HeldOut& held, const Floor& floor) {
  Judged out;
  for (const std::vector<size_t>& group : study.groups)
    out.groups.push_back(study.simulation->trials()[group.front()].name);
  out.noise = group_mm(study, floor.noise_mm);
  out.right_model = group_mm(study, floor.right_mm);
  for (size_t i = 0; i < few.size(); ++i)
    out.left[name_of(study, few[i])] = group_mm(study, held.mm.row(static_cast<Index>(i)));
  return out;
}

std::map<std::string, double> values_of(const Study& study, const Hypothesis& h) {
  std::map<std::string, double> out;
  for (const Index k : h.active) {
    const model::Parameter& p = study.parameters[static_cast<size_t>(k)];
    out[p.name] = model::to_value(p, h.x(k));
  }
  return out;
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
    options.study.fitted = fit::read_fit(file, estimate::recordings_hash(campaign), options.study.drag);
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
  study_options.progress = part(progress, 0, kBegin.screening);
  FittedStudy fitted = make_study(campaign, effects, study_options);
  Study& study = fitted.study;
  out.protocol = study.protocol;
  out.base_fit = fitted.base_fit;
  if (options.on_base_fit) options.on_base_fit(out.base_fit);
  out.campaign = study.campaign;
  out.cells = study.simulation->options().cells;
  out.fine_cells = study.fine->options().cells;
  if (!study.nudged_harder.empty())
    out.remarks.push_back(
        fmt::format("nudged harder than the others, as the base model leaves the recorded folds there, or a finer "
                    "grid goes another way: {}",
                    fmt::join(study.nudged_harder, ", ")));
  out.base = model::to_text(options.study.drag);
  stages.done("base fit");

  progress(kBegin.screening, "changing every effect by a finite size");
  std::vector<Hypothesis> all = {base_hypothesis(study)};
  std::vector<size_t> every(study.effects.size());
  std::iota(every.begin(), every.end(), 0);
  const MatrixXd columns = screen(study, all[0], every);
  for (const size_t e : every) all.push_back(make_hypothesis(study, all[0], {e}, columns));
  stages.done("screening");
  for (size_t e = 0; e < study.effects.size(); ++e) {
    const Effect& effect = study.effects[e];
    EffectFinding& found = out.effects.emplace_back();
    found.name = effect.name;
    found.summary = effect.summary;
    found.side = effect.side;
    found.absorbed = absorbed_share(study, all[e + 1]);
    found.screened_gain = all[e + 1].screened_gain;
    if (out.effects.back().absorbed > study.protocol.absorbed) out.cannot_tell.push_back(effect.name);
  }

  progress(kBegin.refitting, "refitting with every effect");
  refit(study, all, 1);
  if (study.other_start) refit_from_other_start(study, all);
  std::vector<Hypothesis> few = finalists(all, static_cast<size_t>(study.protocol.finalists));
  refit(study, few, 1);
  stages.done("refitting");
  progress(kBegin.finer_grid, "finer grid for the best");
  refine_mesh(study, few);
  relinearise_far(study, few);
  refit(study, few, 2);
  stages.done("finer grid for the best");
  progress(kBegin.held_out, "predicting held-out trials");
  HeldOut held = hold_out(study, few);
  stages.done("held-out trials");

  const Floor floor = floor_of(study, options.study.protocol);
  out.replicate_mm = floor.replicate_mm;
  Scores scores = score(study, few, held, floor, options.study.protocol);
  const auto fit_in_full = [&](const std::vector<size_t>& which) {
    fit_further(study, few, which, part(progress, kBegin.in_full, kBegin.two_effects));
    held = hold_out(study, few);
    scores = score(study, few, held, floor, options.study.protocol);
    stages.done("nearest in full");
  };
  const auto best = [&] { return few.size() > 1 ? nearest_by(scores.log_ratio, 1)[0] : 0; };
  // A large effect lies far from the base fit: nothing is called unknown, nor none in doubt, before the likeliest were
  // fitted in full; nor is one named, sized and found to leave something to a second.
  if (few.size() > 1 && is_in_doubt(study, scores)) fit_in_full(in_full(few, scores.log_ratio));
  else if (best() > 0 && best_of(scores.probability) != "none") fit_in_full({0, best()});
  std::vector<Hypothesis> pairs, one_and_two = few;
  const Hypothesis* two = nullptr;
  // A second effect, where the best one leaves a gap that an effect could still close.
  if (best() > 0 && best_of(scores.probability) != "none" &&
      scores.log_ratio_right - scores.log_ratio[best()] > study.protocol.pair_gain) {
    progress(kBegin.two_effects, "two effects at once");
    pairs = pairs_with(study, few[best()]);
  }
  if (!pairs.empty()) {
    refit(study, pairs, 2);
    fit_further(study, pairs, {least_cost(pairs)},
                part(progress, 0.5 * (kBegin.two_effects + kBegin.ahead), kBegin.ahead));
    append(held, hold_out(study, pairs));
    one_and_two.insert(one_and_two.end(), pairs.begin(), pairs.end());
    scores = score(study, one_and_two, held, floor, options.study.protocol);
    for (size_t k = 0; k < pairs.size(); ++k)
      if (name_of(study, pairs[k]) == scores.likeliest) {
        two = &pairs[k];
        out.pair = scores.likeliest;
        out.pair_probability = scores.of_two.at(out.pair);
        out.fit[out.pair] = values_of(study, *two);
        const HeldOut pair = only_rows(held, {few.size() + k});
        const MatrixXd mm = study.nudged ? held_out_ahead(study, pair) : pair.mm;
        out.pair_reduction =
            reduction_of(errors_of(study, mm.row(0)), errors_of(study, mm.row(1)), errors_of(study, floor.noise_mm));
        out.pair_reduction.is_ahead = study.nudged;
      }
    scores.log_ratio.resize(few.size());
    stages.done("two effects");
  }
  out.judged = judged_by(study, one_and_two, held, floor);
  out.p_value = scores.p_value;
  out.probability = scores.probability;
  out.cause = out.pair.empty() ? scores.likeliest : likelier_of(study, *two, out.probability);
  for (EffectFinding& f : out.effects) f.probability = out.probability.at(f.name);

  // How far the nearest effects close the gap.
  const std::vector<size_t> nearest =
      nearest_by(scores.log_ratio, out.cause == "none" ? size_t{1} : static_cast<size_t>(study.protocol.run_free));
  std::vector<Hypothesis> arms = {few[0]};
  for (const size_t i : nearest) arms.push_back(few[i]);
  for (const Hypothesis& h : arms) out.fit[name_of(study, h)] = values_of(study, h);
  MatrixXd ahead;
  if (study.nudged) {
    progress(kBegin.ahead, "predicting a short time ahead");
    ahead = held_out_ahead(study, only_rows(held, nearest));
    stages.done("a short time ahead");
  }

  // How large it is in motions that run free.
  progress(kBegin.free, "running free");
  const HeldOut free = study.nudged ? held_out_free(study, arms) : only_rows(held, nearest);
  const Floor free_floor = floor_of(study, options.study.protocol);
  const GroupErrors before = errors_of(study, free.mm.row(0)), noise = errors_of(study, free_floor.noise_mm);
  fill_gap(out, before, noise, errors_of(study, free_floor.right_mm));
  for (const Hypothesis& h : arms) out.free_fit[name_of(study, h)] = values_of(study, h);
  for (size_t k = 0; k < nearest.size(); ++k) {
    const Hypothesis& h = few[nearest[k]];
    EffectFinding& f = out.effects[h.effects[0]];
    f.finalist = true;
    f.size = size_of(study, h, held.coordinates[nearest[k]], h.effects[0], options.study.protocol);
    const auto arm = static_cast<Index>(k + 1);
    f.free_reduction = reduction_of(before, errors_of(study, free.mm.row(arm)), noise);
    f.reduction = f.free_reduction;
    if (ahead.size() > 0 && f.name != "mesh_resolution") {  // predictions ahead are made on the fine grid alone
      f.reduction = reduction_of(errors_of(study, ahead.row(0)), errors_of(study, ahead.row(arm)),
                                 errors_of(study, floor.noise_mm));
      f.reduction.is_ahead = true;
    }
    if (f.name == out.cause)
      out.forecast = forecast(study, arms[0], free.coordinates[0], arms[k + 1], free.coordinates[k + 1],
                              f.free_reduction.after_mm);
  }
  stages.done("running free");

  const bool named = out.cause != "none" && out.cause != "unknown";
  const Hypothesis* cause = two;
  for (const Hypothesis& h : few)
    if (!cause && named && name_of(study, h) == out.cause) cause = &h;
  list_parameters(out, study, few[0], cause);
  out.side = out.cause;
  if (named)
    for (const EffectFinding& f : out.effects)
      if (f.name == out.cause) out.side = to_text(f.side);
  if (out.cause != "none") out.confusable = credible_set(out.probability, study.protocol.credible);
  const Where where = split_residual(study, free.residual[0], free_floor.noise_mm);
  out.where = where.cells;
  out.map = where.map;
  stages.done("where");
  progress(kBegin.next, "what to record next");
  const NextExperiment next = propose_experiment(study, few, out.probability);
  out.separates = next.separates;
  out.next_experiment = next.what;
  out.next_session = next.session_toml;
  stages.done("next experiment");
  std::stable_sort(out.effects.begin(), out.effects.end(), [](const EffectFinding& a, const EffectFinding& b) {
    return a.finalist != b.finalist ? a.finalist : a.probability > b.probability;
  });
  out.evaluations = study.evaluations;
  out.wall_s = stages.total();
  out.cpu_s = static_cast<double>(std::clock() - cpu) / CLOCKS_PER_SEC;
  progress(1, "done");
  return out;
}

}  // namespace selvedge::diagnose
