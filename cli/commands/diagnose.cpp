// ./selvedge diagnose CAMPAIGN --out DIR: where the gap lies, what causes it, how far it shrinks.
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "capture/trial/trial.h"
#include "cli/command.h"
#include "cli/output_folder.h"
#include "diagnose/diagnosis_report.h"
#include "diagnose/diagnosis_verdict.h"
#include "diagnose/diagnosis_words.h"
#include "diagnose/effects/library.h"
#include "diagnose/simulator_report.h"
#include "estimate/kept_input.h"
#include "files/bad_input.h"
#include "fit/fit_campaign.h"
#include "fit/fit_report.h"
#include "report/progress.h"
#include "station/simulator/foreign_simulator.h"

namespace selvedge::cli {

namespace {

struct DiagnoseArguments {
  std::filesystem::path path, out, fit;
  std::vector<std::filesystem::path> with;
  std::string base = "nonlinear_drag", simulator;
  double run_limit_s = 60;
  std::vector<std::string> effects, without;
  diagnose::DiagnosisOptions options;
};

void print_diagnosis(const diagnose::Diagnosis& d) {
  fmt::print("{}\n", report::for_terminal(diagnose::verdict_of(d)));
  if (!d.other.name.empty())
    for (const std::string& line : diagnose::lines_of(d.other)) fmt::print("{}\n", line);
  for (const diagnose::SimulatorPart& p : d.other.parts)
    fmt::print("of {}'s gap: {} {}, {:.2f} mm left where it alone is put right\n", d.other.name, p.name,
               diagnose::percent(p.share), p.alone_mm);
  fmt::print("{}: cause {} (probability {:.2f}), side {}\n", d.campaign, d.cause, d.probability.at(d.cause), d.side);
  fmt::print("held-out error{} {:.2f} mm, noise {:.2f} mm\n{}\n{}\n",
             d.is_ahead ? fmt::format(", predicted {:g} s ahead,", d.protocol.free_s) : "", d.before_mm,
             d.noise_floor_mm, diagnose::gap_in_words(d), diagnose::no_effect_in_words(d));
  for (const diagnose::BudgetPart& p : d.budget.parts)
    fmt::print("of the gap: {} {}, there with probability {:.2f}\n", p.effect, diagnose::percent(p.share),
               p.probability);
  fmt::print("of the gap: {} that nothing explains\n", diagnose::percent(d.budget.unexplained));
  fmt::print("{:<38} {:>9} {:>12} {:>20} {:>9}  {}\n", "effect", "probable", "error, mm", "of the gap (90 %)", "hidden",
             "size (90 %)");
  for (const diagnose::EffectFinding& f : d.effects) {
    if (!f.weighed) continue;
    fmt::print("{:<38} {:>9.3f} {:>12} {:>20} {:>9.2f}  {}\n", diagnose::name_in_words(f), f.inclusion,
               diagnose::before_and_after(f.reduction), diagnose::share_closed(f.reduction), f.absorbed,
               diagnose::in_words(f.size));
  }
  if (!d.forecast.motion.empty())
    fmt::print("forecast: in {}, the base model will be {:.1f} mm off{}, with {} {:.1f} mm\n",
               diagnose::motion_in_words(d.forecast.motion, d.forecast.moving_s), d.forecast.before_mm,
               diagnose::interval_in_words(d.forecast.low_mm, d.forecast.high_mm, 1), d.likeliest, d.forecast.after_mm);
  if (d.cause != "none" && !d.confusable.empty())
    fmt::print("effects that these data leave standing: {}\n", fmt::join(d.confusable, ", "));
  fmt::print("next: {}\n", d.next_experiment);
}

[[noreturn]] void refuse_fit(const DiagnoseArguments& a, const trial::Campaign& campaign) {
  refuse("--fit",
         "found a fit of other recordings, of another drag law or simulator, or by another version of Selvedge in {}, "
         "expected one of {}",
         (a.fit / "fit.json").string(), campaign.folder.string());
}

// The simulator as a fit.json has it that rests on these recordings; else as it is fitted now, kept in --out.
// fit_is_ours: --fit holds one of our sheet.
diagnose::FittedSimulator fitted_simulator(const DiagnoseArguments& a, const trial::Campaign& campaign,
                                           bool fit_is_ours) {
  const std::filesystem::path own = a.out / "simulator";
  std::filesystem::create_directories(own);
  fit::FitOptions options;
  options.simulator = std::make_shared<station::ForeignSimulator>(
      a.simulator, station::ForeignOptions{own / "simulator.log", a.run_limit_s});
  const std::string input = fit::input_of(estimate::recordings_hash(campaign), *options.simulator);
  for (const std::filesystem::path& folder : {a.fit, own, a.out, campaign.folder}) {
    if (folder.empty() || !std::filesystem::exists(folder / "fit.json")) continue;
    if (const auto x = fit::read_fit(folder / "fit.json", input, options.simulator->parameters())) {
      fmt::print("{} as {} has it\n", options.simulator->name(), (folder / "fit.json").string());
      return {options.simulator, *x};
    }
    if (folder == a.fit && !fit_is_ours) refuse_fit(a, campaign);
  }
  options.hold_out = fit::HoldOut::none;
  options.progress = report::terminal_progress("fit " + options.simulator->name());
  const fit::FitOutcome out = fit::fit_campaign(campaign, options);
  fit::write_fit(out, trial::only_tests(campaign, false), own);
  return {options.simulator, out.coordinates};
}

void run_diagnose(DiagnoseArguments& a) {
  expect_folder("--out", a.out);
  std::vector<trial::Campaign> campaigns = {trial::read_campaign(a.path)};
  for (const std::filesystem::path& more : a.with) campaigns.push_back(trial::read_campaign(more));
  const trial::Campaign campaign = trial::joined(campaigns);
  const std::vector<diagnose::Effect> effects = diagnose::chosen_effects(a.effects, a.without, "--effects, --without");
  a.options.study.drag = model::drag_named(a.base);
  a.options.study.progress = report::terminal_progress("diagnose " + campaign.folder.filename().string());
  if (!a.fit.empty() && !std::filesystem::exists(a.fit / "fit.json"))
    refuse("--fit", "found no fit.json in {}, expected what ./selvedge fit wrote", a.fit.string());
  const auto begun = diagnose::begin_with_fit(a.options, campaign,
                                              a.fit.empty() ? std::vector{a.out, campaign.folder} : std::vector{a.fit});
  if (begun) fmt::print("begins with the parameters of {}\n", begun->string());
  if (!a.simulator.empty()) a.options.other = fitted_simulator(a, campaign, begun.has_value());
  else if (!begun && !a.fit.empty()) refuse_fit(a, campaign);
  diagnose::keep_base_fit(a.options, a.out / "base_fit.json", campaign);
  const diagnose::Diagnosis d = diagnose::diagnose(campaign, effects, a.options);
  diagnose::write_diagnosis(d, a.out);
  print_diagnosis(d);
  fmt::print("wrote {} and {}; {} simulations, {:.0f} s of processor time\n", (a.out / "diagnosis.json").string(),
             (a.out / "report.html").string(), d.evaluations, d.cpu_s);
}

}  // namespace

void add_diagnose(CLI::App& app, int&) {
  auto* command = app.add_subcommand(
      "diagnose",
      "where the simulated fabric departs from the recorded one, which effect causes it, how far it shrinks");
  auto a = std::make_shared<DiagnoseArguments>();
  command->add_option("CAMPAIGN", a->path, "folder of a campaign (or of one trial)")->required();
  command->add_option("--out", a->out, "folder for diagnosis.json and report.html")->required();
  command->add_option("--fit", a->fit,
                      "folder with the campaign's fit.json, to begin with its parameters; by default where it lies in "
                      "--out or in the campaign");
  command->add_option(
      "--with", a->with,
      "a further campaign of the same fabric on the same rig, diagnosed together with it; may be given more than once");
  command->add_option("--base", a->base, "drag law of the base model")
      ->check(CLI::IsMember({"nonlinear_drag", "linear_drag", "no_drag"}))
      ->capture_default_str();
  command->add_option("--simulator", a->simulator,
                      "command of another simulator: what its motion lacks is told beside (docs/simulator.md)");
  command->add_option("--run-limit", a->run_limit_s, "of a run of that simulator")
      ->type_name("SECONDS")
      ->check(CLI::PositiveNumber)
      ->capture_default_str()
      ->needs("--simulator");
  command->add_option("--effects", a->effects, "try these effects alone, comma between")->delimiter(',');
  command->add_option("--without", a->without, "leave these effects out, comma between")->delimiter(',');
  command
      ->add_option(
          "--cells", a->options.study.protocol.cells,
          "of the sheet of splines along the width (6 to 48), for derivatives; by default as many as the fabric "
          "asks for. Predictions are brought to a grid half as fine again")
      ->check(CLI::Range(6, 48));
  command->callback([a] { run_diagnose(*a); });
}

}  // namespace selvedge::cli
