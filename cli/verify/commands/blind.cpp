// ./selvedge blind make|answer|open|without: diagnoses of campaigns whose keys are sealed until all are answered.
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <random>
#include <set>
#include <stdexcept>
#include <string>

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "cli/command.h"
#include "cli/output_folder.h"
#include "cli/slurm_options.h"
#include "evaluation/blind.h"
#include "diagnose/diagnosis_report.h"
#include "diagnose/effects/library.h"
#include "evaluation/fresh_reduction.h"
#include "evaluation/true_shares.h"
#include "files/bad_input.h"
#include "files/whole_file.h"
#include "hardware_sim/bank/bank_campaign.h"
#include "report/progress.h"
#include "cli/verify/blind_array.h"

namespace selvedge::cli {

namespace {

namespace fs = std::filesystem;

struct BlindArguments {
  fs::path folder;
  std::string world = "elements";
  int none = 40, known = 90, outside = 30, sets = 40;
  unsigned long long seed = 0;
  double minutes = 1e9;
  bool partial = false, shares = false;
  std::string campaign;  // the only one to answer; empty: all
  station::SlurmOptions slurm;
};

// A conversion to an unsigned number would take -1 for the largest one.
std::string not_negative(const std::string& text) {
  return text.starts_with('-') ? "found " + text + ", expected a whole number from 0 on" : "";
}

std::string hex_words(std::mt19937_64& g, int words) {
  std::string text;
  for (int i = 0; i < words; ++i) text += fmt::format("{:016x}", g());
  return text;
}

// Keys are drawn and sealed before the first campaign is simulated; a second call goes on where the first stopped.
void make_bank(const BlindArguments& a) {
  expect_folder("DIR", a.folder);
  std::mt19937_64 g(a.seed);
  std::vector<std::string> kinds;
  for (const auto& [kind, count] : {std::pair{"none", a.none}, std::pair{"known", a.known},
                                    std::pair{"outside", a.outside}, std::pair{"set", a.sets}})
    kinds.insert(kinds.end(), static_cast<size_t>(count), kind);
  std::shuffle(kinds.begin(), kinds.end(), g);
  std::vector<hardware_sim::BankKey> keys;
  std::vector<evaluation::SealedKey> sealed;
  // Identifiers come from a generator of their own: they must not follow from the order of kinds.
  std::mt19937_64 names(a.seed ^ 0x9e3779b97f4a7c15ULL);
  std::random_device device;
  for (const std::string& kind : kinds) {
    keys.push_back(hardware_sim::draw_key(kind, hardware_sim::bank_world(a.world), g));
    std::string salt;
    for (int i = 0; i < 8; ++i) salt += fmt::format("{:08x}", device());
    sealed.push_back({"c" + hex_words(names, 1), salt, hardware_sim::to_json(keys.back())});
  }
  if (!fs::exists(a.folder / "record.json")) evaluation::seal_keys(a.folder, sealed, evaluation::usual_seal());
  const evaluation::BlindRecord record = evaluation::read_record(a.folder);
  for (size_t i = 0; i < sealed.size(); ++i)
    if (i >= record.ids.size() || record.ids[i] != sealed[i].id)
      refuse((a.folder / "record.json").string(),
             "found a blind check of another seed or other numbers, expected --seed, --none, --known, --outside and "
             "--sets as when it was made");
  const auto progress = report::terminal_progress("blind make");
  std::mutex told;
  size_t made = 0;
  const auto one_more = [&](const std::string& id) {
    const std::lock_guard lock(told);
    progress(static_cast<double>(++made) / static_cast<double>(keys.size()), id);
  };
  progress(0, "simulating");
  // Campaigns are independent: each has random numbers of its own.
  tbb::parallel_for(
      size_t{0}, keys.size(),
      [&](size_t i) {
    const fs::path folder = a.folder / "campaigns" / record.ids[i];
    if (!fs::exists(folder / "campaign.json")) hardware_sim::write_bank_campaign(keys[i], record.ids[i], folder);
    one_more(record.ids[i]);
      },
      tbb::simple_partitioner());
  fmt::print("{} campaigns in {}; their keys are sealed in record.json\n", keys.size(),
             (a.folder / "campaigns").string());
}

void answer_bank(const BlindArguments& a, int& exit_status) {
  const auto begin = std::chrono::steady_clock::now();
  const auto enough = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count() > 60 * a.minutes;
  };
  const size_t total = evaluation::read_record(a.folder).ids.size();
  const auto one = [&](const fs::path& campaign) {
    diagnose::DiagnosisOptions options;
    options.study.progress = report::terminal_progress("blind answer " + campaign.filename().string());
    const trial::Campaign recorded = trial::read_campaign(campaign);
    diagnose::keep_base_fit(options, a.folder / "answers" / campaign.filename() / "base_fit.json", recorded);
    return diagnose::diagnose(recorded, diagnose::effect_library(), options);
  };
  if (!a.campaign.empty())
    return evaluation::answer_one(a.folder, evaluation::usual_seal(), a.campaign,
                                  station::own_array_task().value_or(""), one);
  const auto missing = [&](const std::string& id, const std::string& why) {
    fmt::print(stderr, "{}: its task ended without an answer; {}\n", id, why);
    exit_status = 1;
  };
  const size_t answered = a.slurm.used
                              ? answer_by_array(a.folder, a.slurm, report::terminal_progress("blind answer"), missing)
                              : evaluation::answer_all(a.folder, evaluation::usual_seal(), one, enough);
  fmt::print("{} of {} campaigns are answered{}\n", answered, total,
             answered == total ? "; the answers are final" : "; run the command again to go on");
}

void print_rows(const std::vector<evaluation::ScoreRow>& rows) {
  for (const evaluation::ScoreRow& r : rows)
    fmt::print("{:<66} {:>4} of {:<4} {:>6} {:>17}  {}\n", r.what, r.hits, r.of,
               r.of ? fmt::format("{:.0f} %", 100.0 * r.hits / r.of) : "–",
               r.of ? fmt::format("({:.0f} … {:.0f} %)", 100 * r.low, 100 * r.high) : "", r.wanted);
}

// Fresh trials of a key, simulated when the keys are open; nothing where the simulated world diverges.
std::optional<trial::Campaign> fresh_trials(const fs::path& folder, const hardware_sim::BankKey& key,
                                            const std::string& id) {
  try {
    if (!fs::exists(folder / "campaign.json")) hardware_sim::write_fresh_trials(key, id, folder);
  } catch (const std::runtime_error& error) {
    fmt::print(stderr, "{}: fresh trials are not scored: {}\n", id, error.what());
    return {};
  }
  return trial::read_campaign(folder);
}

std::optional<double> reduction_in_fresh_trials(const fs::path& folder, const evaluation::SealedKey& key,
                                                const nlohmann::json& diagnosis, const std::string& effect) {
  if (!key.key.contains("fabric") || !diagnosis.contains("fit") || !diagnosis.at("fit").contains(effect))
    return {};  // made or answered elsewhere
  const auto fresh = fresh_trials(folder / "fresh" / key.id, hardware_sim::bank_key(key.key), key.id);
  if (!fresh) return {};
  return evaluation::reduction_on(*fresh, diagnose::effect_library(), diagnosis, effect).fraction();
}

// From fresh trials with every subset of the key's effects; kept in fresh/ID/shares.json. A key from elsewhere may say
// them itself.
std::map<std::string, double> true_shares(const fs::path& folder, const evaluation::SealedKey& key,
                                          const nlohmann::json& diagnosis) {
  if (key.key.contains("shares")) return key.key.at("shares").get<std::map<std::string, double>>();
  if (!key.key.contains("fabric")) return {};
  const fs::path here = folder / "fresh" / key.id, file = here / "shares.json";
  if (fs::exists(file)) return files::read_json(file).get<std::map<std::string, double>>();
  const hardware_sim::BankKey all = hardware_sim::bank_key(key.key);
  bool known = true;
  double gap_with_all = 0;
  const std::vector<double> parts = evaluation::shapley(all.effects.size(), [&](unsigned subset) {
    hardware_sim::BankKey some = all;
    some.effects.clear();
    std::string name = "with";
    for (size_t k = 0; k < all.effects.size(); ++k)
      if ((subset >> k & 1u) != 0) {
        some.effects.push_back(all.effects[k]);
        name += "-" + all.effects[k].name;
      }
    const auto fresh = fresh_trials(some.effects.size() == all.effects.size() ? here : here / name, some, key.id);
    if (!fresh) known = false;
    return gap_with_all = fresh ? evaluation::base_gap_mm2(*fresh, diagnosis) : 0;  // the last subset is of all
  });
  std::map<std::string, double> out;
  if (known && gap_with_all > 0)
    for (size_t k = 0; k < parts.size(); ++k) out[all.effects[k].name] = parts[k] / gap_with_all;
  fs::create_directories(here);
  files::write_json(file, out);
  return out;
}

std::optional<evaluation::TrueParameter> true_size(const evaluation::SealedKey& key) {
  if (!key.key.contains("fabric")) return {};  // made elsewhere
  const auto parameter = hardware_sim::true_parameter(hardware_sim::bank_key(key.key));
  return parameter ? std::optional(evaluation::TrueParameter{parameter->first, parameter->second}) : std::nullopt;
}

void print_answers(const std::vector<evaluation::Opened>& answers) {
  for (const evaluation::Opened& o : answers)
    fmt::print("{:<18} {:<5} {} {:.2f}, truly {}; gap {:.1f} of what a right model leaves\n", o.id,
               o.right ? "right" : "wrong", o.named, o.probability, o.truth, o.ratio);
  fmt::print("\n");
  std::fflush(stdout);
}

void open_bank(const BlindArguments& a) {
  evaluation::Truth truth;
  truth.begins = print_answers;
  const auto progress = report::terminal_progress("blind open");
  truth.on_progress = [&](double done, const std::string& id) {
    progress(done, done < 1 ? "fresh trials of " + id : "scored");
  };
  truth.reduction = [&](const evaluation::SealedKey& key, const nlohmann::json& diagnosis, const std::string& effect) {
    return reduction_in_fresh_trials(a.folder, key, diagnosis, effect);
  };
  truth.size = true_size;
  truth.shares = [&](const evaluation::SealedKey& key, const nlohmann::json& diagnosis) {
    if (!a.shares && !key.key.contains("shares")) return std::map<std::string, double>();
    return true_shares(a.folder, key, diagnosis);
  };
  const evaluation::BlindScore s = evaluation::open_keys(a.folder, evaluation::usual_seal(), a.partial, truth);
  fmt::print("{} campaigns answered; shares with their exact 95 % intervals (Clopper and Pearson)\n\n", s.answered);
  print_rows(s.rows);
  fmt::print("\n");
  print_rows(s.baselines);
  fmt::print("\ncalibration error {:.3f} (at most 0.10); Brier score {:.3f}, of the base rates {:.3f}\n\n",
             s.calibration_error, s.brier, s.brier_base_rates);
  fmt::print("calibration error of inclusion {:.3f} over {} inclusions of 0.05 or more (at most 0.07)\n\n",
             s.inclusion_error, s.inclusions);
  if (s.shares > 0)
    fmt::print("shares of the gap, told against true: median error {:.2f} over {} (at most 0.10)\n\n", s.share_error,
               s.shares);
  if (s.reductions > 0)
    fmt::print(
        "gap reduction, told against that of fresh trials: median error {:.2f} over {} causes named right (at most "
        "0.10)\n\n",
        s.reduction_error, s.reductions);
  for (const std::string& line : s.sizes) fmt::print("{}\n", line);
  if (!s.sizes.empty()) fmt::print("\n");
  for (const std::string& line : s.confusion) fmt::print("{}\n", line);
}

// Campaigns whose cause was named right, diagnosed once more by a library that lacks its effect.
void answer_without(const BlindArguments& a) {
  const auto begin = std::chrono::steady_clock::now();
  const std::vector<evaluation::NamedRight> campaigns =
      evaluation::named_right(a.folder, evaluation::usual_seal(), a.partial);
  for (const evaluation::NamedRight& c : campaigns) {
    const fs::path out = a.folder / "without" / c.id;
    if (fs::exists(out / "diagnosis.json")) continue;
    if (std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count() > 60 * a.minutes) break;
    std::vector<diagnose::Effect> effects = diagnose::effect_library();
    std::erase_if(effects, [&](const diagnose::Effect& e) { return e.name == c.cause; });
    diagnose::DiagnosisOptions options;
    options.study.progress = report::terminal_progress("blind without " + c.id);
    const trial::Campaign recorded = trial::read_campaign(a.folder / "campaigns" / c.id);
    diagnose::keep_base_fit(options, a.folder / "answers" / c.id / "base_fit.json", recorded);
    const diagnose::Diagnosis d = diagnose::diagnose(recorded, effects, options);
    diagnose::write_diagnosis(d, out);
    fmt::print("{}: {} with its effect deleted is answered {} ({:.2f})\n", c.id, c.cause, d.cause,
               d.probability.at(d.cause));
  }
  print_rows(evaluation::score_without(a.folder, campaigns));
}

}  // namespace

void add_blind(CLI::App& app, int& exit_status) {
  auto* command =
      app.add_subcommand("blind", "diagnose campaigns whose keys are sealed, and score the answers afterwards");
  command->require_subcommand(1);
  auto a = std::make_shared<BlindArguments>();
  auto* made = command->add_subcommand(
      "make", "draw campaigns of the simulated world and seal their keys; goes on where it stopped");
  made->add_option("DIR", a->folder, "folder of the blind check")->required();
  made->add_option("--seed", a->seed, "draw it after library and thresholds are frozen")
      ->required()
      ->check(not_negative);
  made->add_option("--none", a->none, "campaigns without an effect")->check(CLI::Range(0, 1000))->capture_default_str();
  made->add_option("--known", a->known, "with an effect of the library")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str();
  made->add_option("--outside", a->outside, "with an effect outside it")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str();
  made->add_option("--sets", a->sets, "with two or three effects of the library at once")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str();
  made->add_option("--world", a->world, "that simulates them; the library's constants are set on the first two")
      ->check(CLI::IsMember(hardware_sim::bank_world_names()))
      ->capture_default_str();
  made->callback([a] { make_bank(*a); });
  auto* answered = command->add_subcommand("answer", "diagnose every campaign that has no answer yet");
  answered->add_option("DIR", a->folder, "folder of the blind check")->required();
  auto* minutes = answered->add_option("--minutes", a->minutes, "begin no further campaign after this time")
                      ->check(CLI::PositiveNumber);
  auto* campaign =
      answered->add_option("--campaign", a->campaign, "this one alone, as a task of a job array does")->type_name("ID");
  add_slurm_options(*answered, a->slurm);
  answered->get_option("--slurm")->excludes(minutes)->excludes(campaign);
  answered->callback([a, &exit_status] { answer_bank(*a, exit_status); });
  auto* opened = command->add_subcommand("open", "check seals and answers, then score");
  opened->add_option("DIR", a->folder, "folder of the blind check")->required();
  opened->add_flag("--partial", a->partial, "score what is answered so far");
  opened->add_flag("--shares", a->shares,
                   "also find what each effect truly takes of the gap, from fresh trials with every subset of them");
  opened->callback([a] { open_bank(*a); });
  auto* without = command->add_subcommand(
      "without",
      "diagnose what was named right once more, with the true effect deleted from the library; opens the keys");
  without->add_option("DIR", a->folder, "folder of the blind check")->required();
  without->add_option("--minutes", a->minutes, "begin no further campaign after this time")->check(CLI::PositiveNumber);
  without->add_flag("--partial", a->partial, "of what is answered so far");
  without->callback([a] { answer_without(*a); });
}

}  // namespace selvedge::cli
