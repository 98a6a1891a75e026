// `./selvedge prove diagnosis`: the checks of a diagnosis that need no bank. Injected forces, calibration, power and
// deletion are of data that one campaign's own linearisation drew (evaluation/drawn_campaign.h); stability is of whole
// diagnoses of campaigns of the simulated world.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <tbb/global_control.h>

#include "cli/verify/figures.h"
#include "diagnose/diagnosis.h"
#include "diagnose/effects/library.h"
#include "evaluation/drawn_campaign.h"
#include "hardware_sim/bank/bank_campaign.h"

namespace selvedge::cli {

namespace {

using evaluation::DrawnAnswer;
using evaluation::DrawnCampaign;
using evaluation::DrawnKind;

struct Numbers {
  int draws, power_draws, campaigns;
  std::vector<double> times;
};
Numbers numbers_of(const FigureOptions& options) {
  if (options.quick) return {16, 1, 1, {0.5, 4}};
  return {40, 4, 4, {0.5, 1, 2, 4}};
}

std::vector<diagnose::Effect> effects_of(const FigureOptions& options) {
  std::vector<diagnose::Effect> out = diagnose::effect_library();
  if (!options.quick) return out;
  const std::vector<std::string> few = {"camera_delay", "draught", "coupling", "anisotropy"};
  std::erase_if(out, [&](const diagnose::Effect& e) { return std::find(few.begin(), few.end(), e.name) == few.end(); });
  return out;
}

diagnose::StudyOptions study_of(const FigureOptions& options) {
  diagnose::StudyOptions study;
  if (!options.quick) return study;
  study.protocol.cells = 6;
  study.protocol.rate_hz = 10;
  return study;
}

hardware_sim::BankKey key_of(const std::string& kind, const FigureOptions& options, std::mt19937_64& random) {
  using trial::Experiment;
  hardware_sim::BankKey key = hardware_sim::draw_key(kind, hardware_sim::BankWorld::lattice, random);
  key.design = hardware_sim::usual_design();
  if (options.quick) {
    key.design.rate_hz = 60;
    key.design.dots_across = key.design.dots_down = 4;
    key.design.trials = {{Experiment::static_hang, 0.1}, {Experiment::waving, 0.75}, {Experiment::waving, 0.75}};
    // The short form's six cells do not follow softer fabric.
    key.truth = {};
    if (kind == "known") key.effects = {{"camera_delay", 0.02}};
  }
  return key;
}

trial::Campaign recorded(const hardware_sim::BankKey& key, const std::string& name) {
  namespace fs = std::filesystem;
  const fs::path folder = fs::temp_directory_path() / ("selvedge_prove_diagnosis_" + name);
  fs::remove_all(folder);
  hardware_sim::write_bank_campaign(key, name, folder);
  trial::Campaign campaign = trial::read_campaign(folder);
  fs::remove_all(folder);
  return campaign;
}

// The base model's coordinates where it has the fabric's own numbers.
Eigen::VectorXd true_base(const hardware_sim::FabricTruth& truth) {
  const std::vector<model::Parameter> base = model::base_parameters();
  Eigen::VectorXd x = model::usual_coordinates(base);
  for (size_t k = 0; k < base.size(); ++k)
    for (const hardware_sim::FabricParameter& p : hardware_sim::fabric_parameters())
      if (base[k].name == p.name) x(static_cast<Eigen::Index>(k)) = model::to_coordinate(base[k], truth.*p.member);
  return x;
}

// The short form's one small campaign is too little to judge bands by.
void add_forces(DrawnCampaign& campaign, const FigureOptions& options, std::mt19937_64& random,
                std::vector<Figure>& out) {
  for (const double s : {1.0, 3.0}) {
    const double held = campaign.forces_held(s, random);
    const std::string what =
        fmt::format("forces of {:.0f} times the usual size, injected: held by the map's 90 % bands", s);
    out.push_back({what, held, 0.85, "", options.quick ? Relation::shown : Relation::at_least, "asked"});
    out.push_back({what, held, 0.95, "", options.quick ? Relation::shown : Relation::at_most, "asked"});
  }
}

void add_calibration(const DrawnCampaign& campaign, const FigureOptions& options, std::mt19937_64& random,
                     std::vector<Figure>& out) {
  const int draws = numbers_of(options).draws;
  std::vector<DrawnAnswer> answers;
  for (size_t kind = 0; kind < evaluation::kDrawnKinds; ++kind)
    for (int i = 0; i < draws; ++i) {
      options.progress(
          0.1 + 0.4 * static_cast<double>(answers.size()) / (static_cast<double>(draws) * evaluation::kDrawnKinds),
          "calibration");
      answers.push_back(campaign.drawn(static_cast<DrawnKind>(kind), random));
    }
  const auto prior = campaign.prior();
  const auto errors = evaluation::drawn_kind_errors(answers, prior);
  for (size_t kind = 0; kind < evaluation::kDrawnKinds; ++kind) {
    double own = 0;
    for (const DrawnAnswer& a : answers)
      if (static_cast<size_t>(a.kind) == kind) own += a.kinds[kind] / draws;
    const std::string what = to_text(static_cast<DrawnKind>(kind));
    out.push_back({fmt::format("calibration, {} draws of each kind, {}: mean probability less its prior", draws, what),
                   std::abs(errors[kind]), options.quick ? 0.15 : 0.07, "", Relation::at_most,
                   fmt::format("0 but for chance; prior {:.3f}", prior[kind])});
    out.push_back({fmt::format("{}: its mean probability where it was drawn", what), own, prior[kind], "",
                   Relation::shown, "its prior"});
  }
  out.push_back({"calibration error of inclusion", evaluation::drawn_inclusion_error(answers, prior),
                 options.quick ? 0.2 : 0.07, "", Relation::at_most, "asked of a bank"});
}

void add_power(const DrawnCampaign& campaign, const FigureOptions& options, std::mt19937_64& random,
               std::vector<Figure>& out) {
  const Numbers numbers = numbers_of(options);
  const std::vector<size_t>& effects = campaign.tellable();
  const auto of = static_cast<double>(effects.size()) * numbers.power_draws;
  for (size_t t = 0; t < numbers.times.size(); ++t) {
    int detected = 0, first = 0;
    for (const size_t e : effects) {
      int here = 0;
      for (int i = 0; i < numbers.power_draws; ++i) {
        const DrawnAnswer a = campaign.drawn_at(e, numbers.times[t], false, random);
        detected += a.verdict.inclusion.at(campaign.study().effects[e].name) > 0.5;
        here += a.named() == campaign.study().effects[e].name;
      }
      first += here;
      if (!options.quick)
        out.push_back({fmt::format("{} at {:g} times what the whitened noise shows: named first",
                                   campaign.study().effects[e].name, numbers.times[t]),
                       static_cast<double>(here) / numbers.power_draws, 1, "", Relation::shown, ""});
      options.progress(0.5 + 0.2 * static_cast<double>(t) / static_cast<double>(numbers.times.size()), "power");
    }
    const bool plain = numbers.times[t] >= 4;
    const std::string what =
        fmt::format("every effect at {:g} times what the whitened noise shows: ", numbers.times[t]);
    out.push_back({what + "included", detected / of, plain ? 0.85 : 0, "", plain ? Relation::at_least : Relation::shown,
                   plain ? "asked of names in a bank" : ""});
    out.push_back({what + "named first", first / of, plain ? 0.85 : 0, "", plain ? Relation::at_least : Relation::shown,
                   plain ? "asked of a bank" : ""});
  }
}

void add_deletion(const DrawnCampaign& campaign, const FigureOptions& options, std::mt19937_64& random,
                  std::vector<Figure>& out) {
  const int draws = numbers_of(options).power_draws;
  const std::vector<size_t>& effects = campaign.tellable();
  int unknown = 0, none = 0, wrong = 0;
  for (const size_t e : effects) {
    int here = 0;
    for (int i = 0; i < draws; ++i) {
      const DrawnAnswer a = campaign.drawn_at(e, 4, true, random);
      here += a.named() == "unknown";
      none += a.named() == "none";
      wrong += a.named() != "none" && a.named() != "unknown" && a.verdict.probability.at(a.named()) > 0.8;
    }
    unknown += here;
    if (!options.quick)
      out.push_back({fmt::format("{} deleted: unknown", campaign.study().effects[e].name),
                     static_cast<double>(here) / draws, 1, "", Relation::shown, ""});
  }
  const double of = static_cast<double>(effects.size()) * draws;
  const std::string what = "every effect, at four times what the whitened noise shows, deleted: ";
  out.push_back({what + "unknown", unknown / of, 0.5, "", Relation::shown, "asked of a bank"});
  out.push_back({what + "none", none / of, 0, "", Relation::shown, ""});
  out.push_back({what + "a neighbour's name with more than 0.8", wrong / of, 0, "", Relation::shown, ""});
}

// Diagnosed, restarted, resumed, on one thread and on two, and from a base three times off.
void add_stability(const FigureOptions& options, std::mt19937_64& random, std::vector<Figure>& out) {
  const Numbers numbers = numbers_of(options);
  int same = 0, of = 0;
  for (int c = 0; c < numbers.campaigns; ++c) {
    const hardware_sim::BankKey key = key_of(c == 1 ? "none" : "known", options, random);
    const trial::Campaign campaign = recorded(key, fmt::format("stability_{}", c));
    const auto named = [&](const diagnose::DiagnosisOptions& o) {
      return diagnose::diagnose(campaign, effects_of(options), o);
    };
    diagnose::DiagnosisOptions usual;
    usual.study = study_of(options);
    options.progress(0.75 + 0.25 * c / numbers.campaigns, "stability");
    const diagnose::Diagnosis first = named(usual);
    const auto look = [&](const std::string& what, const diagnose::Diagnosis& d) {
      ++of;
      same += d.cause == first.cause;
      options.tell(fmt::format("{}: {} {:.2f}; {}: {} {:.2f}", key.cause(), first.cause,
                               first.probability.at(first.cause), what, d.cause, d.probability.at(d.cause)));
    };
    if (!options.quick) look("restarted", named(usual));
    diagnose::DiagnosisOptions resumed = usual;
    resumed.study.base_fit = first.base_fit;
    look("resumed", named(resumed));
    for (const size_t threads : {size_t{1}, size_t{2}}) {
      if (options.quick && threads == 2) continue;
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      look(fmt::format("on {} threads", threads), named(resumed));
    }
    diagnose::DiagnosisOptions off = usual;
    off.study.fitted = first.base_fit.coordinates;
    for (Eigen::Index k = 0; k < off.study.fitted->size(); ++k)
      (*off.study.fitted)(k) += (k % 2 == 0 ? 1 : -1) * std::log(3.0);
    look("from a base three times off", named(off));
  }
  out.push_back({fmt::format("the same first name, of {} answers", of), static_cast<double>(same) / of,
                 options.quick ? 0.6 : 0.95, "", Relation::at_least, "asked: 19 of 20"});
}

}  // namespace

std::vector<Figure> prove_diagnosis(const FigureOptions& options) {
  std::mt19937_64 random(options.seed);
  const hardware_sim::BankKey key = key_of("none", options, random);
  diagnose::StudyOptions study = study_of(options);
  study.base_fit = diagnose::BaseFit{true_base(key.truth), 0, {}};
  options.progress(0, "one campaign, linearised");
  DrawnCampaign campaign(recorded(key, "drawn"), effects_of(options), study);
  std::vector<Figure> out;
  add_forces(campaign, options, random, out);
  add_calibration(campaign, options, random, out);
  add_power(campaign, options, random, out);
  add_deletion(campaign, options, random, out);
  add_stability(options, random, out);
  options.progress(1, "done");
  return out;
}

}  // namespace selvedge::cli
