#include "diagnose/diagnosis_verdict.h"

#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace selvedge::diagnose {

using report::Trust;

namespace {

constexpr double kLikely = 0.8, kHalf = 0.5, kSure = 0.05;

std::string ahead(const Diagnosis& d) {
  return d.is_ahead ? fmt::format(", predicted {:g} s ahead,", d.protocol.free_s) : "";
}

// That there is none of these is not known.
std::string unseen(const Diagnosis& d) {
  return d.cannot_tell.empty()
             ? ""
             : fmt::format(" At their usual size these trials could not show {}.", fmt::join(d.cannot_tell, ", "));
}

std::string answer_in_words(const Diagnosis& d) {
  const std::string sizes =
      fmt::format("The base model ({}) leaves {:.2f} mm of held-out trials{} where the sensor alone leaves {:.2f} mm.",
                  d.base, d.before_mm, ahead(d), d.noise_floor_mm);
  const double p = d.probability.at(d.cause);
  if (d.cause == "none") return fmt::format("No effect is needed (probability {}). {}{}", percent(p), sizes, unseen(d));
  if (d.cause == "unknown")
    return fmt::format("There is a gap, and no effect of the library closes it: unknown (probability {}). {}",
                       percent(p), sizes);
  for (const EffectFinding& f : d.effects) {
    if (f.name != d.cause) continue;
    std::string beside;
    for (const BudgetPart& part : d.budget.parts)
      if (part.effect != d.cause && part.probability > 0.5) beside += (beside.empty() ? "" : ", ") + part.effect;
    return fmt::format(
        "{} {}: {} (probability that it is there {}, {} side){}. Added to the model, {} "
        "takes the error of held-out trials{} from {:.2f} to {:.2f} mm, {} of the gap. {}",
        f.reduction.fraction < kHalf ? "A part of the gap is consistent with" : "Consistent with", f.name, f.summary,
        percent(f.inclusion), d.side, beside.empty() ? "" : ", beside " + beside, beside.empty() ? "it" : d.likeliest,
        ahead(d), f.reduction.before_mm, f.reduction.after_mm, percent(f.reduction.fraction), sizes);
  }
  return sizes;
}

void weigh_cause(const Diagnosis& d, report::Verdict& verdict) {
  const bool named = d.cause != "none" && d.cause != "unknown";
  const std::map<std::string, double>& likely = named ? d.inclusion : d.probability;
  const auto of_cause = likely.find(d.cause);
  const double p = of_cause == likely.end() ? 0 : of_cause->second;
  if (d.cause == "unknown")
    verdict.lower(Trust::limited, "what causes the gap is not in the library, or not to be told");
  if (p < kLikely) verdict.lower(Trust::limited, fmt::format("it is likely by {} only", percent(p)));
  if (d.cause == "none" && d.p_value < kSure)
    verdict.lower(
        Trust::limited,
        fmt::format("the base leaves more of held-out trials than a right model would (p {:.2g})", d.p_value));
  if (!named) return;
  if (d.groups < 2)
    verdict.lower(Trust::limited,
                  "all trials repeat one motion: whether a right model would leave as much cannot be told");
  else if (d.p_value > kSure)
    verdict.lower(Trust::limited,
                  fmt::format("trials vary so much that a right model may leave as much (p {:.2g})", d.p_value));
  const auto part = std::find_if(d.budget.parts.begin(), d.budget.parts.end(),
                                 [&](const BudgetPart& b) { return b.effect == d.cause; });
  if (part != d.budget.parts.end() && part->share.value < kHalf)
    verdict.lower(Trust::limited, fmt::format("it takes {} of the gap; {} nothing explains", percent(part->share.value),
                                              percent(d.budget.unexplained.value)));
  std::vector<std::string> others;
  for (const std::string& name : d.confusable)
    if (name != d.cause) others.push_back(name);
  if (!others.empty())
    verdict.lower(Trust::limited, fmt::format("these data do not tell it from {}", fmt::join(others, ", ")));
}

}  // namespace

report::Verdict verdict_of(const Diagnosis& d) {
  report::Verdict verdict;
  verdict.sentence = answer_in_words(d);
  for (const std::string& doubt : d.doubts) verdict.lower(Trust::none, "the recording is doubted: " + doubt);
  weigh_cause(d, verdict);
  return verdict;
}

}  // namespace selvedge::diagnose
