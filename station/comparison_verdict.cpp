#include "station/comparison_verdict.h"

#include <cmath>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "station/json_text.h"

namespace selvedge::station {

namespace {

using nlohmann::json;
using report::Trust;
using report::Verdict;

constexpr std::pair<const char*, const char*> sides[] = {{"a", "A"}, {"b", "B"}};

bool has_both(const json& numbers) { return numbers["difference"].is_number(); }

// Trials of which both sides have an interval, and of those, which lie apart in whose favour.
struct Intervals {
  int both = 0, a_better = 0, b_better = 0;

  void add(const json& a, const json& b) {
    if (a.is_null() || b.is_null()) return;
    ++both;
    a_better += a[1].get<double>() < b[0].get<double>();
    b_better += b[1].get<double>() < a[0].get<double>();
  }
};

// What is compared: held-out errors or, where one side has none, gaps.
struct Contest {
  const json* mm = nullptr;
  Intervals intervals;
  bool of_gaps = false;
};

Contest contest_of(const json& pair) {
  Contest contest;
  if (has_both(pair["held_out_mm"])) {
    contest.mm = &pair["held_out_mm"];
    for (const json& trial : pair["trials"])
      contest.intervals.add(trial["held_out_interval_mm"]["a"], trial["held_out_interval_mm"]["b"]);
  } else if (pair.contains("gap") && has_both(pair["gap"]["value_mm"])) {
    contest.mm = &pair["gap"]["value_mm"];
    contest.of_gaps = true;
    contest.intervals.add(pair["gap"]["interval_mm"]["a"], pair["gap"]["interval_mm"]["b"]);
  }
  return contest;
}

std::string sentence_of(const json& pair, const Contest& contest) {
  if (!contest.mm) return "nothing here says which of the two predicts better";
  const json& mm = *contest.mm;
  const double difference = mm["difference"];
  const json better = better_of(pair);
  const char* const what = contest.of_gaps ? "gap" : "error of what they were not fitted to";
  if (better == "neither")
    return fmt::format("no difference that the data can show: the {} is {} mm of A and {} mm of B", what,
                       number_text(mm["a"]), number_text(mm["b"]));
  // Without intervals the smaller is named all the same, with care.
  const bool b = better.is_null() ? difference < 0 : better == "b";
  return fmt::format("{0} {2} by {3} mm than {1} ({4} and {5} mm)", b ? "B" : "A", b ? "A" : "B",
                     contest.of_gaps ? "leaves a gap smaller" : "predicts what it was not fitted to better",
                     number_text(std::abs(difference)), number_text(mm[b ? "b" : "a"]), number_text(mm[b ? "a" : "b"]));
}

void weigh_sides(const json& pair, Verdict& verdict) {
  for (const auto& [key, side] : sides) {
    for (const auto& [kind, what] : {std::pair{"fit", "fit"}, {"diagnosis", "diagnosis"}}) {
      const auto own = report::read_verdict(pair["verdicts"][kind][key]);
      if (own && own->trust != Trust::full)
        verdict.lower(own->trust, fmt::format("the {} of {} is {}: {}", what, side, to_text(own->trust),
                                              fmt::join(own->because, "; ")));
    }
    const json &plate = pair["rigid_plate_mm"][key], &error = pair["held_out_mm"][key];
    // A fit that has a verdict says so itself.
    if (pair["verdicts"]["fit"][key].is_null() && plate.is_number() && error.is_number() && error >= plate)
      verdict.lower(Trust::none, fmt::format("a rigid plate, carried along, comes as near as {}: {} mm beside {}", side,
                                             number_text(plate), number_text(error)));
  }
}

std::string by_text(const json& by) { return by.is_string() ? by.get<std::string>() : "–"; }

void weigh_contest(const json& pair, const Contest& contest, Verdict& verdict) {
  if (!contest.mm) {
    for (const auto& [key, side] : sides)
      if (!pair["held_out_mm"][key].is_number())
        verdict.lower(Trust::limited, fmt::format("{} held nothing out", side));
    return;
  }
  if (contest.intervals.both == 0)
    verdict.lower(Trust::limited, "there are no intervals on both sides: the difference may be no more than chance");
  if (contest.of_gaps) return;
  if (pair["held_out_by"]["a"] != pair["held_out_by"]["b"])
    verdict.lower(Trust::limited, fmt::format("the two are not measured alike: A holds out {}, B {}",
                                              by_text(pair["held_out_by"]["a"]), by_text(pair["held_out_by"]["b"])));
  std::vector<std::string> of_one;
  for (const auto& [name, trial] : pair["trials"].items())
    if (trial["held_out_mm"]["a"].is_number() != trial["held_out_mm"]["b"].is_number()) of_one.push_back(name);
  if (!of_one.empty())
    verdict.lower(Trust::limited, fmt::format("the errors are not of the same trials: {} {} held out on one side alone",
                                              fmt::join(of_one, ", "), of_one.size() == 1 ? "is" : "are"));
  if (contest.intervals.a_better > 0 && contest.intervals.b_better > 0)
    verdict.lower(Trust::limited, fmt::format("each predicts some trials better beyond their intervals: A {}, B {}",
                                              contest.intervals.a_better, contest.intervals.b_better));
}

}  // namespace

json better_of(const json& pair) {
  const Contest contest = contest_of(pair);
  if (!contest.mm || contest.intervals.both == 0) return {};
  const double difference = (*contest.mm)["difference"];
  const Intervals& i = contest.intervals;
  if (difference < 0 && i.b_better > 0 && i.a_better == 0) return "b";
  if (difference > 0 && i.a_better > 0 && i.b_better == 0) return "a";
  return "neither";
}

Verdict verdict_of_pair(const json& pair) {
  const Contest contest = contest_of(pair);
  Verdict verdict;
  verdict.sentence = sentence_of(pair, contest);
  weigh_sides(pair, verdict);
  weigh_contest(pair, contest, verdict);
  return verdict;
}

Verdict verdict_of_pairs(const json& pairs) {
  if (pairs.size() == 1)
    if (auto alone = report::read_verdict(pairs[0]["verdict"])) return *alone;
  Verdict all;
  int a = 0, b = 0, neither = 0, open = 0;
  for (const json& pair : pairs) {
    const json& better = pair["better"];
    ++(better == "a" ? a : better == "b" ? b : better.is_null() ? open : neither);
    const auto own = report::read_verdict(pair["verdict"]);
    if (own && own->trust != Trust::full)
      all.lower(own->trust, fmt::format("{} is {}: {}", pair["name"].get<std::string>(), to_text(own->trust),
                                        fmt::join(own->because, "; ")));
  }
  all.sentence = fmt::format("of {} fabrics A predicts {} better, B {}", pairs.size(), a, b);
  if (neither > 0) all.sentence += fmt::format("; of {} the data can show no difference", neither);
  if (open > 0) all.sentence += fmt::format("; of {} nothing says which is better", open);
  return all;
}

}  // namespace selvedge::station
