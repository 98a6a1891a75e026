#include "diagnose/diagnosis.h"

#include <algorithm>
#include <chrono>
#include <ctime>

#include "diagnose/looked_at.h"
#include "diagnose/told.h"

namespace selvedge::diagnose {

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

// One diagnosis under way: each step fills its part of what is told.
class Run {
 public:
  Run(const trial::Campaign& campaign, const std::vector<Effect>& effects, const DiagnosisOptions& options)
      : campaign_(campaign), effects_(effects), options_(options) {}

  Diagnosis all() {
    const std::clock_t cpu = std::clock();
    take_base();
    take_simulator();
    weigh_sets();
    look_at_leaders();
    tell_leaders();
    tell_budget();
    tell_probabilities();
    tell_simulator();
    list_measured(out_, study().measured);
    list_parameters(out_, study(), likeliest().without.x, likeliest().with.x);
    stages_.done("budget");
    tell_where();
    tell_next();
    out_.evaluations = study().evaluations;
    out_.wall_s = stages_.total();
    out_.cpu_s = static_cast<double>(std::clock() - cpu) / CLOCKS_PER_SEC;
    options_.study.progress(1, "done");
    return std::move(out_);
  }

 private:
  Study& study() { return fitted_->study; }
  const LookedAt& likeliest() const { return looked_at_.front(); }
  double fit_share() const { return options_.study.fitted || options_.study.base_fit ? kBegin.windows : 0.4; }
  double imitated_at() const { return options_.other ? 0.5 * (1 + fit_share()) : fit_share(); }
  report::ProgressCallback after() const { return part(options_.study.progress, imitated_at(), 1); }

  void take_base() {
    StudyOptions how = options_.study;
    how.progress = part(options_.study.progress, 0, fit_share());
    fitted_.emplace(make_study(campaign_, effects_, how));
    out_.base_fit = fitted_->base_fit;
    if (options_.on_base_fit) options_.on_base_fit(out_.base_fit);
    out_.protocol = study().protocol;
    out_.campaign = study().campaign;
    out_.input = options_.input.empty() ? input_of(options_, campaign_) : options_.input;
    out_.doubts = study().doubts;
    out_.remarks = study().remarks;
    out_.cells = study().simulation->options().cells;
    out_.fine_cells = study().fine->options().cells;
    out_.base = model::to_text(options_.study.drag);
    stages_.done("base");
  }

  void take_simulator() {
    if (!options_.other) return;
    StudyOptions like = options_.study;
    like.progress = part(options_.study.progress, fit_share(), imitated_at());
    imitation_ = imitate(campaign_, like, *options_.other);
    stages_.done("imitating " + options_.other->simulator->name());
  }

  void weigh_sets() {
    windows_.emplace(*study().simulation, study().protocol);
    WeighingOptions how;
    how.begins = part(after(), kBegin.windows, kBegin.likeliest);
    how.ends = [&](const std::string& stage) { stages_.done(stage); };
    weighing_.emplace(weigh(study(), *windows_, how));
    weighed_.emplace(Weighed{study(), *windows_, *weighing_, noise_of(study(), *windows_, *weighing_->evidence)});
  }

  // The likeliest sets, each in trials that it was not fitted to, beside the base without their effects.
  void look_at_leaders() {
    after()(kBegin.likeliest, "how much each effect takes");
    std::vector<std::vector<size_t>> leaders;
    for (const Weight& w : weighing_->verdict.weights) {
      if (leaders.size() >= static_cast<size_t>(study().protocol.leaders)) break;
      const bool is_new = std::find(leaders.begin(), leaders.end(), w.effects) == leaders.end();
      if (leaders.empty() || (is_new && !w.effects.empty())) leaders.push_back(w.effects);
    }
    looked_at_ = look_at(*weighed_, leaders);
    std::map<std::vector<size_t>, GapTaken> taken;
    for (const LookedAt& l : looked_at_)
      if (!l.arm.effects.empty()) taken[l.arm.effects] = taken_by(l, weighed_->noise, study().protocol);
    taken[{}].p_of_right = p_of_gap(likeliest().before, weighed_->noise, study().protocol);
    verdict_ = judge(study(), weighing_->sets, weighed_->evidence().error().scales, taken);
    const auto is_named = [&](const LookedAt& l) {
      double sum = 0;
      for (const Weight& w : verdict_.weights)
        if (w.effects == l.arm.effects) sum += w.probability * w.all_take;
      return sum;
    };
    const auto first =
        std::max_element(looked_at_.begin(), looked_at_.end(),
                         [&](const LookedAt& a, const LookedAt& b) { return is_named(a) < is_named(b); });
    std::rotate(looked_at_.begin(), first, first + 1);
  }

  void tell_leaders() {
    list_effects(out_, study(), weighing_->none);
    const EffectSet& set = weighing_->set_of(likeliest().arm.effects);
    const auto at_most =
        sizes_at_most(study(), weighed_->evidence(), *likeliest().about, set.chosen, likeliest().scale);
    for (size_t e = 0; e < at_most.size(); ++e) out_.effects[e].at_most = at_most[e];
    out_.likeliest = name_of(study(), likeliest().arm.effects);
    out_.fit["none"] = values_of(study(), likeliest().without.x);
    predicted_ = {likeliest().without};
    for (const LookedAt& l : looked_at_) {
      if (l.arm.effects.empty()) continue;
      predicted_.push_back(l.with);
      out_.fit[l.with.name] = values_of(study(), l.with.x);
      for (const size_t e : l.arm.effects) {
        EffectFinding& f = out_.effects[e];
        if (f.weighed) continue;
        f.weighed = true;
        for (const size_t other : l.arm.effects)
          if (other != e) f.beside.push_back(study().effects[other].name);
        f.size = size_of(study(), *l.about, l.arm.sizes, l.arm.x, l.posterior, e);
        f.reduction = reduction_of(study(), l, weighed_->noise);
      }
    }
  }

  void tell_budget() {
    const LookedAt& l = likeliest();
    fill_gap(out_, study(), l.before, weighed_->noise);
    out_.budget.total_mm = out_.before_mm;
    out_.budget.noise_mm = out_.noise_floor_mm;
    for (size_t k = 0; k < l.parts.size(); ++k) {
      const std::string& effect = study().effects[l.arm.effects[k]].name;
      out_.budget.parts.push_back({effect, verdict_.inclusion.at(effect), l.parts[k]});
    }
    out_.budget.unexplained = l.unexplained;
    out_.missing_force = missing_force(study(), *windows_, weighed_->evidence(), l.arm, l.scale);
    std::vector<Shown> shown = {{"the base model", l.without.x, l.without.branches, l.before.residual}};
    if (!l.arm.effects.empty())
      shown.push_back({"with " + out_.likeliest, l.with.x, l.with.branches, l.after.residual});
    out_.replay = replay(study(), *windows_, shown, out_.missing_force);
  }

  void tell_probabilities() {
    constexpr size_t kMostSets = 10;
    for (size_t k = 0; k < std::min(verdict_.weights.size(), kMostSets); ++k) {
      const Weight& w = verdict_.weights[k];
      out_.sets.push_back({name_of(study(), w.effects), w.and_unknown, w.probability,
                           weighed_->evidence().error().scales[w.scale] / study().right_scale});
    }
    out_.probability = verdict_.probability;
    out_.inclusion = verdict_.inclusion;
    for (EffectFinding& f : out_.effects) {
      f.probability = out_.probability.at(f.name);
      f.inclusion = out_.inclusion.at(f.name);
      if (f.inclusion > 0.5) f.at_most.clear();
    }
    out_.cause = cause_of(out_.probability, out_.inclusion, out_.budget);
    out_.side = out_.cause;
    for (const EffectFinding& f : out_.effects)
      if (f.name == out_.cause) out_.side = to_text(f.side);
    if (out_.cause != "none") out_.confusable = credible_set(out_.probability, study().protocol.credible);
    std::stable_sort(out_.effects.begin(), out_.effects.end(), [](const EffectFinding& a, const EffectFinding& b) {
      return a.weighed != b.weighed ? a.weighed : a.probability > b.probability;
    });
  }

  void tell_simulator() {
    if (!imitation_) return;
    const LookedAt& l = likeliest();
    out_.other = simulator_gap(study(), *windows_, weighed_->evidence(), l.arm, l.with.x, *imitation_);
    out_.other.name = options_.other->simulator->name();
    out_.other.identity = options_.other->simulator->identity();
  }

  void tell_where() {
    const std::vector<SpotsSeen> seen = spots_seen(study());
    const auto split = [&](const HeldOut& left) {
      return split_residual(study(), seen, by_trial(study(), *windows_, left.residual), out_.noise_floor_mm);
    };
    const Where where = split(likeliest().before);
    out_.where = where.cells;
    out_.map = where.map;
    if (!likeliest().arm.effects.empty()) {
      const Where with = split(likeliest().after);
      if (with.map.uv == where.map.uv) out_.map.after_mm = with.map.at_mm;
    }
    stages_.done("where");
  }

  void tell_next() {
    after()(kBegin.next, "what to record next");
    const NextExperiment next = propose_experiment(study(), predicted_, out_.probability);
    out_.separates = next.separates;
    out_.next_experiment = next.what;
    out_.next_session = next.session_toml;
    const bool is_named = out_.cause != "none" && out_.cause != "unknown";
    if (is_named && out_.likeliest != "none")
      out_.forecast = forecast(study(), likeliest().without, likeliest().with, likeliest().after.mm());
    stages_.done("next experiment");
  }

  const trial::Campaign& campaign_;
  const std::vector<Effect>& effects_;
  const DiagnosisOptions& options_;
  Diagnosis out_;
  Stages stages_{out_};
  std::optional<FittedStudy> fitted_;
  std::optional<Imitation> imitation_;
  std::optional<Windows> windows_;
  std::optional<Weighing> weighing_;
  std::optional<Weighed> weighed_;
  std::vector<LookedAt> looked_at_;  // the likeliest first
  Verdict verdict_;
  std::vector<PredictedSet> predicted_;
};

}  // namespace

Diagnosis diagnose(const trial::Campaign& campaign, const std::vector<Effect>& effects,
                   const DiagnosisOptions& options) {
  return Run(campaign, effects, options).all();
}

}  // namespace selvedge::diagnose
