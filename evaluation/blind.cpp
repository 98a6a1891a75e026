#include "evaluation/blind.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <set>
#include <thread>
#include <tuple>

#include <boost/math/distributions/beta.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include "diagnose/diagnosis_report.h"
#include "diagnose/effects/library.h"
#include "evaluation/set_score.h"
#include "files/bad_input.h"
#include "files/json_reader.h"
#include "files/lock.h"
#include "files/sha256.h"
#include "files/whole_file.h"
#include "geometry/order_statistics.h"

namespace selvedge::evaluation {

namespace fs = std::filesystem;
using nlohmann::json;

std::string usual_seal() { return diagnose::protocol_hash(diagnose::Protocol{}, diagnose::effect_library()); }

namespace {

// As its locks say it.
std::string own_name() { return fmt::format("process {}", ::getpid()); }

std::string sealed(const SealedKey& key) { return files::sha256_hex(key.key.dump() + key.salt); }

std::string answers_hash(const fs::path& folder, const BlindRecord& record) {
  std::string all;
  for (const std::string& id : record.ids)
    all += files::sha256_hex(files::read_whole(folder / "answers" / id / "diagnosis.json"));
  return files::sha256_hex(all);
}

void write_record(const fs::path& folder, const BlindRecord& record) {
  json campaigns = json::array();
  for (size_t i = 0; i < record.ids.size(); ++i)
    campaigns.push_back({{"id", record.ids[i]}, {"seal", record.seals[i]}});
  files::write_json(
      folder / "record.json",
      {{"format", "blind/1"}, {"library", record.library}, {"campaigns", campaigns}, {"answers", record.answers}});
}

// Of a cause such as "a+b"; none of "none" and "unknown".
std::set<std::string> effects_of(const std::string& cause) {
  std::set<std::string> out;
  if (cause == "none" || cause == "unknown") return out;
  for (size_t from = 0; from <= cause.size();) {
    const size_t to = std::min(cause.find('+', from), cause.size());
    out.insert(cause.substr(from, to - from));
    from = to + 1;
  }
  return out;
}

struct Answered : AnsweredSet {
  SealedKey key;
  std::string truth, side;
  double ratio = 0;  // gap / floor
  json diagnosis;
  std::optional<double> reduction_found;  // of the cause, in fresh trials
  std::optional<TrueParameter> true_size;
  // What the probabilities should be: several effects at once have as much each.
  std::map<std::string, double> shares() const {
    std::map<std::string, double> out;
    if (effects.empty()) out[truth] = 1;
    for (const std::string& name : effects) out[name] = 1 / static_cast<double>(effects.size());
    return out;
  }
};

// What the named cause should be, for the side.
std::string true_side(const std::string& cause, const std::map<std::string, std::string>& side_of) {
  const auto at = side_of.find(cause);
  return at == side_of.end() ? "" : at->second;
}

ScoreRow row(const std::string& what, const std::string& wanted, int hits, int of) {
  const auto [low, high] = clopper_pearson(hits, of);
  return {what, wanted, hits, of, low, high};
}

std::vector<double> where_vector(const json& diagnosis) {
  std::map<std::string, double> shares;
  for (const json& cell : diagnosis.at("where"))
    shares[cell.at("axis").get<std::string>() + cell.at("cell").get<std::string>()] = cell.at("share").get<double>();
  std::vector<double> out = {std::log(std::max(0.01, diagnosis.at("gap").at("held_out_mm").get<double>()))};
  for (const auto& [name, share] : shares) out.push_back(share);
  return out;
}

// The nearest other campaign's class, by the residual map alone.
std::string nearest_class(const std::vector<Answered>& all, size_t i) {
  const std::vector<double> here = where_vector(all[i].diagnosis);
  double least = 1e300;
  std::string name = "none";
  for (size_t j = 0; j < all.size(); ++j) {
    if (j == i) continue;
    const std::vector<double> there = where_vector(all[j].diagnosis);
    double d = 0;
    for (size_t k = 0; k < std::min(here.size(), there.size()); ++k) d += (here[k] - there[k]) * (here[k] - there[k]);
    if (d < least) {
      least = d;
      name = all[j].truth;
    }
  }
  return name;
}

// Forward selection by BIC over linear columns, every sample taken for independent.
std::string by_bic(const json& diagnosis) {
  constexpr double kSamples = 18000;
  double best = 0;
  std::string name = "none";
  for (const auto& [effect, s] : diagnosis.at("screened").items()) {
    const double gain = std::min(s.at("gain").get<double>(), 0.9999);
    const double score = -kSamples * std::log(1 - gain) - std::log(kSamples);
    if (score > best) {
      best = score;
      name = effect;
    }
  }
  return name;
}

int right(const std::vector<Answered>& all, const std::function<std::string(size_t)>& says) {
  int hits = 0;
  for (size_t i = 0; i < all.size(); ++i) hits += says(i) == all[i].truth;
  return hits;
}

void add_probabilities(BlindScore& out, const std::vector<Answered>& all) {
  std::map<std::string, double> base_rate;
  for (const Answered& a : all)
    for (const auto& [name, share] : a.shares()) base_rate[name] += share / static_cast<double>(all.size());
  std::vector<std::pair<double, bool>> confidence;
  for (const Answered& a : all) {
    const json& p = a.diagnosis.at("probabilities");
    std::map<std::string, double> wanted = a.shares();
    double brier = 0, base = 0;
    for (const auto& [name, rate] : base_rate)
      base += std::pow(rate - (wanted.contains(name) ? wanted.at(name) : 0), 2);
    for (const auto& [name, value] : p.items()) {
      brier += std::pow(value.get<double>() - (wanted.contains(name) ? wanted.at(name) : 0), 2);
      wanted.erase(name);
    }
    for (const auto& [name, share] : wanted) brier += share * share;  // effects that the answer does not know
    out.brier += brier / static_cast<double>(all.size());
    out.brier_base_rates += base / static_cast<double>(all.size());
    confidence.emplace_back(a.probability, a.is_named_right());
  }
  // Expected calibration error over five bins of the named cause's probability.
  for (int bin = 0; bin < 5; ++bin) {
    double p = 0, hit = 0, n = 0;
    for (const auto& [c, ok] : confidence)
      if (std::min(4, static_cast<int>(5 * c)) == bin) {
        p += c;
        hit += ok;
        ++n;
      }
    if (n > 0) out.calibration_error += std::abs(p - hit) / static_cast<double>(confidence.size());
  }
}

}  // namespace

std::pair<double, double> clopper_pearson(int hits, int of, double level) {
  if (of == 0) return {0, 1};
  using Beta = boost::math::beta_distribution<>;
  const double tail = 0.5 * (1 - level);
  return {hits == 0 ? 0 : boost::math::quantile(Beta(hits, of - hits + 1), tail),
          hits == of ? 1 : boost::math::quantile(Beta(hits + 1, of - hits), 1 - tail)};
}

void seal_keys(const fs::path& folder, const std::vector<SealedKey>& keys, const std::string& library) {
  if (fs::exists(folder / "record.json"))
    refuse((folder / "record.json").string(), "found a blind check, expected a folder without one");
  BlindRecord record;
  record.library = library;
  json list = json::array();
  for (const SealedKey& key : keys) {
    record.ids.push_back(key.id);
    record.seals.push_back(sealed(key));
    list.push_back({{"id", key.id}, {"salt", key.salt}, {"key", key.key}});
  }
  fs::create_directories(folder);
  files::write_json(folder / "keys.json", list);
  write_record(folder, record);
}

BlindRecord read_record(const fs::path& folder) {
  const files::JsonReader reader(folder / "record.json");
  if (reader.text("format") != "blind/1")
    refuse(reader.where("format"), "found {}, expected blind/1", reader.text("format"));
  BlindRecord record;
  record.library = reader.text("library");
  record.answers = reader.text("answers");
  for (const json& c : reader.value("campaigns")) {
    record.ids.push_back(c.at("id").get<std::string>());
    record.seals.push_back(c.at("seal").get<std::string>());
  }
  return record;
}

namespace {

void expect_seal(const fs::path& folder, const BlindRecord& record, const std::string& seal) {
  if (record.library != seal)
    refuse((folder / "record.json").string(),
           "found the seal {} of another protocol, other effects or other code, expected {}: answer and open with the "
           "version that made it",
           record.library.substr(0, 12), seal.substr(0, 12));
}

}  // namespace

BlindRecord open_record(const fs::path& folder, const std::string& seal) {
  BlindRecord record = read_record(folder);
  expect_seal(folder, record, seal);
  if (!record.answers.empty())
    refuse((folder / "record.json").string(),
           "found answers that are final already, expected none; keys may have been opened");
  return record;
}

void answer_one(const fs::path& folder, const std::string& seal, const std::string& id, const std::string& task,
                const std::function<diagnose::Diagnosis(const fs::path&)>& diagnose) {
  constexpr std::chrono::seconds kLook{2};
  const BlindRecord record = open_record(folder, seal);
  if (std::find(record.ids.begin(), record.ids.end(), id) == record.ids.end())
    refuse((folder / "record.json").string(), "found no campaign {}, expected one of {}", in_quotes(id),
           record.ids.size());
  const fs::path out = folder / "answers" / id;
  fs::create_directories(folder / "answers");
  for (; !fs::exists(out / "diagnosis.json"); std::this_thread::sleep_for(kLook)) {
    const files::Lock claim(folder / "answers" / (id + ".lock"), task.empty() ? own_name() : task, !task.empty());
    if (!claim.held()) continue;
    if (!fs::exists(out / "diagnosis.json")) diagnose::write_diagnosis(diagnose(folder / "campaigns" / id), out);
    return;
  }
}

size_t answer_all(const fs::path& folder, const std::string& seal,
                  const std::function<diagnose::Diagnosis(const fs::path&)>& diagnose,
                  const std::function<bool()>& enough) {
  BlindRecord record = open_record(folder, seal);
  for (const std::string& id : record.ids) {
    const fs::path out = folder / "answers" / id;
    if (!fs::exists(out / "diagnosis.json")) {
      if (enough()) continue;
      fs::create_directories(folder / "answers");
      const files::Lock claim(folder / "answers" / (id + ".lock"), own_name(), false);
      if (!claim.held()) continue;
      if (!fs::exists(out / "diagnosis.json")) diagnose::write_diagnosis(diagnose(folder / "campaigns" / id), out);
    }
  }
  // Others may have answered some meanwhile.
  const auto answered =
      static_cast<size_t>(std::count_if(record.ids.begin(), record.ids.end(), [&](const std::string& id) {
        return fs::exists(folder / "answers" / id / "diagnosis.json");
      }));
  if (answered == record.ids.size()) {
    record.answers = answers_hash(folder, record);
    write_record(folder, record);
  }
  return answered;
}

namespace {

std::map<std::string, ToldShare> told_shares(const json& budget) {
  std::map<std::string, ToldShare> out;
  for (const json& part : budget.at("parts")) {
    const json& interval = part.at("interval");
    ToldShare told{part.at("share").is_number() ? part.at("share").get<double>() : 0, 1, 0};
    if (interval[0].is_number() && interval[1].is_number()) {
      told.low = interval[0].get<double>();
      told.high = interval[1].get<double>();
    }
    out[part.at("effects")[0].get<std::string>()] = told;
  }
  return out;
}

// Answers beside their keys, both checked.
std::vector<Answered> opened(const fs::path& folder, const std::string& seal, bool partial) {
  const BlindRecord record = read_record(folder);
  expect_seal(folder, record, seal);
  if (!partial && record.answers.empty())
    refuse((folder / "record.json").string(),
           "found campaigns without an answer; run `blind answer` first, or open with --partial");
  if (!partial && answers_hash(folder, record) != record.answers)
    refuse((folder / "answers").string(), "found answers that were changed after they were final");
  std::vector<Answered> all;
  for (const json& k : files::read_json(folder / "keys.json")) {
    const SealedKey key{k.at("id").get<std::string>(), k.at("salt").get<std::string>(), k.at("key")};
    const auto at = std::find(record.ids.begin(), record.ids.end(), key.id);
    if (at == record.ids.end())
      refuse((folder / "keys.json").string(), "found a key of {}, which the record has not", key.id);
    if (sealed(key) != record.seals[static_cast<size_t>(at - record.ids.begin())])
      refuse((folder / "keys.json").string(), "found a key of {} that is not the one sealed", key.id);
    const fs::path file = folder / "answers" / key.id / "diagnosis.json";
    if (!fs::exists(file)) continue;
    Answered a;
    a.key = key;
    a.truth = key.key.at("cause").get<std::string>();
    a.diagnosis = files::read_json(file);
    a.named = a.diagnosis.at("cause").get<std::string>();
    a.side = a.diagnosis.at("side").get<std::string>();
    a.probability = a.diagnosis.at("probabilities").value(a.named, 0.0);
    a.effects = effects_of(a.truth);
    a.outside = a.truth == "unknown";
    a.inclusion = a.diagnosis.value("inclusion", std::map<std::string, double>());
    if (a.diagnosis.contains("budget")) a.told = told_shares(a.diagnosis.at("budget"));
    const double floor = a.diagnosis.at("gap").at("right_model_mm").get<double>();
    a.ratio = (a.diagnosis.at("gap").at("held_out_mm").get<double>() - floor) / floor;
    all.push_back(std::move(a));
  }
  return all;
}

// What is known of their campaigns beside the causes.
void add_truths(const Truth& truth, std::vector<Answered>& all) {
  if (truth.begins) {
    std::vector<Opened> answers;
    for (const Answered& a : all)
      answers.push_back({a.key.id, a.truth, a.named, a.probability, a.ratio, a.is_named_right()});
    truth.begins(answers);
  }
  for (size_t i = 0; i < all.size(); ++i) {
    Answered& a = all[i];
    if (truth.on_progress) truth.on_progress(static_cast<double>(i) / static_cast<double>(all.size()), a.key.id);
    if (truth.reduction && a.named == a.truth && a.diagnosis.at("shrink").contains(a.truth))
      a.reduction_found = truth.reduction(a.key, a.diagnosis, a.truth);
    if (truth.size && a.named == a.truth && a.diagnosis.at("effect_size").contains(a.truth))
      a.true_size = truth.size(a.key);
    if (truth.shares && !a.effects.empty()) a.true_share = truth.shares(a.key, a.diagnosis);
  }
  if (truth.on_progress) truth.on_progress(1, "");
}

}  // namespace

std::vector<NamedRight> named_right(const fs::path& folder, const std::string& seal, bool partial) {
  std::vector<NamedRight> out;
  for (const Answered& a : opened(folder, seal, partial))
    if (!a.effects.empty() && a.is_named_right()) out.push_back({a.key.id, a.named});
  return out;
}

std::vector<ScoreRow> score_without(const fs::path& folder, const std::vector<NamedRight>& campaigns) {
  int unknown = 0, none = 0, of = 0;
  for (const NamedRight& c : campaigns) {
    const fs::path file = folder / "without" / c.id / "diagnosis.json";
    if (!fs::exists(file)) continue;
    const std::string named = files::read_json(file).at("cause").get<std::string>();
    ++of;
    unknown += named == "unknown";
    none += named == "none";
  }
  return {row("the true effect deleted: unknown", "at least 50 %", unknown, of),
          row("the true effect deleted: none", "", none, of),
          row("the true effect deleted: a neighbour's name", "", of - unknown - none, of)};
}

BlindScore open_keys(const fs::path& folder, const std::string& seal, bool partial, const Truth& truth) {
  std::vector<Answered> all = opened(folder, seal, partial);
  add_truths(truth, all);
  std::map<std::string, std::string> side_of;
  for (const Answered& a : all)
    for (const auto& [name, value] : a.diagnosis.at("sides").items()) side_of[name] = value.get<std::string>();
  BlindScore out;
  out.answered = all.size();
  int none = 0, alarms = 0, there_plain = 0, first = 0, in_set = 0, outside = 0, unknown = 0, confident_wrong = 0,
      sided = 0, side_right = 0, sets = 0, all_included = 0, none_wrong = 0, held = 0, sizes_held = 0;
  std::vector<size_t> set_sizes;
  std::map<std::string, int> confusion;
  std::vector<double> reduction_errors;
  for (const Answered& a : all) {
    ++confusion[fmt::format("{} → {}", a.truth, a.named)];
    confident_wrong += !a.is_named_right() && a.probability > 0.8;
    if (a.effects.size() > 1) {
      ++sets;
      all_included += a.includes_all();
      none_wrong += !a.includes_wrong();
    }
    if (a.outside) {
      ++outside;
      unknown += a.named == "unknown";
    } else if (a.effects.empty()) {
      ++none;
      alarms += a.named != "none";
    }
    if (a.effects.empty()) continue;
    if (a.ratio >= 2) {
      ++there_plain;
      first += a.is_named_right();
    }
    if (a.effects.size() > 1) continue;
    const std::string side = true_side(a.truth, side_of);
    if (a.named != "none" && a.named != "unknown") {
      ++sided;
      side_right += (side == "measurement") == (a.side == "measurement");
    }
    if (a.reduction_found && std::isfinite(*a.reduction_found)) {
      const json& told = a.diagnosis.at("shrink").at(a.truth);
      reduction_errors.push_back(std::abs(told.at("fraction").get<double>() - *a.reduction_found));
      held += *a.reduction_found >= told.at("interval")[0].get<double>() &&
              *a.reduction_found <= told.at("interval")[1].get<double>();
    }
    if (a.true_size) {
      const json& told = a.diagnosis.at("effect_size").at(a.truth).at(a.true_size->name);
      const double low = told.at("interval")[0].get<double>(), high = told.at("interval")[1].get<double>();
      sizes_held += a.true_size->value >= low && a.true_size->value <= high;
      out.sizes.push_back(fmt::format("{}: {} told as {:.3g} {} ({:.2g} to {:.2g}), truly {:.3g}", a.truth,
                                      a.true_size->name, told.at("value").get<double>(),
                                      told.at("unit").get<std::string>(), low, high, a.true_size->value));
    }
    if (a.ratio < 2) continue;
    const auto set = a.diagnosis.at("confusable").get<std::vector<std::string>>();
    in_set += std::find(set.begin(), set.end(), a.truth) != set.end();
    set_sizes.push_back(set.size());
  }
  const std::vector<AnsweredSet> answers(all.begin(), all.end());
  const ShareScore shares = score_shares(answers);
  out.rows = {
      row("no effect: alarms", "at most 5 %", alarms, none),
      row("effects there, gap at least twice the floor: the one that takes most named first", "at least 85 %", first,
          there_plain),
      row("one effect, the same: the confusable set holds it", "at least 90 %", in_set,
          static_cast<int>(set_sizes.size())),
      row("outside the library: unknown", "at least 75 %", unknown, outside),
      row("any campaign: wrong with more than 0.8", "at most 3 %", confident_wrong, static_cast<int>(all.size())),
      row("sets: every effect with a quarter of the gap or more included", "at least 70 %", all_included, sets),
      row("sets: none included wrongly", "at least 80 %", none_wrong, sets),
      row("budget: the 90 % interval of a share holds the true one", "85 to 95 %", shares.held, shares.of),
      row("one effect, some effect named: measurement or physics", "at least 95 %", side_right, sided),
      row("gap reduction, named right: the 90 % interval holds that of fresh trials", "85 to 95 %", held,
          static_cast<int>(reduction_errors.size())),
      row("size, named right: the 90 % interval holds the true one", "85 to 95 %", sizes_held,
          static_cast<int>(out.sizes.size()))};
  out.shares = shares.errors.size();
  if (!shares.errors.empty()) out.share_error = geometry::median(shares.errors);
  std::tie(out.inclusion_error, out.inclusions) = inclusion_error(answers, kWorthSaying);
  out.reductions = reduction_errors.size();
  if (!reduction_errors.empty()) out.reduction_error = geometry::median(reduction_errors);
  for (const double ratio : {0.5, 1.0, 2.0, 4.0}) {
    int of = 0, detected = 0, named = 0;
    for (const Answered& a : all)
      if (a.effects.size() == 1 && a.ratio >= ratio / std::sqrt(2.0) && a.ratio < ratio * std::sqrt(2.0)) {
        ++of;
        detected += a.named != "none";
        named += a.named == a.truth;
      }
    out.rows.push_back(row(fmt::format("power at gap/floor about {}: detected", ratio), "shown", detected, of));
    out.rows.push_back(row(fmt::format("power at gap/floor about {}: named first", ratio), "shown", named, of));
  }
  if (!set_sizes.empty())
    out.confusion.push_back(fmt::format("median size of the confusable set: {}", geometry::median(set_sizes)));
  const int total = static_cast<int>(all.size());
  std::map<std::string, int> count;
  for (const Answered& a : all) ++count[a.truth];
  std::string commonest = "none";
  for (const auto& [name, n] : count)
    if (n > count[commonest]) commonest = name;
  out.baselines = {
      row("Selvedge", "right answer",
          std::count_if(all.begin(), all.end(), [](const Answered& a) { return a.is_named_right(); }), total),
      row("always " + commonest, "right answer", right(all, [&](size_t) { return commonest; }), total),
      row("always unknown", "right answer", right(all, [](size_t) { return std::string("unknown"); }), total),
      row("nearest residual map", "right answer", right(all, [&](size_t i) { return nearest_class(all, i); }), total),
      row("forward selection by BIC", "right answer", right(all, [&](size_t i) { return by_bic(all[i].diagnosis); }),
          total)};
  if (!all.empty()) add_probabilities(out, all);
  for (const auto& [name, n] : confusion) out.confusion.push_back(fmt::format("{}: {}", name, n));
  return out;
}

}  // namespace selvedge::evaluation
