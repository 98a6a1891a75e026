#include "diagnose/diagnosis_words.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "report/text_table.h"

namespace selvedge::diagnose {

using report::short_number;

namespace {

constexpr size_t kGroupsForAnInterval = 4;

std::string with_blanks(std::string name) {
  std::replace(name.begin(), name.end(), '_', ' ');
  return name;
}

std::string late_in_words(const SizedParameter& p) {
  const bool is_early = p.value < 0;
  const double low = 1e3 * (is_early ? -p.high : p.low), high = 1e3 * (is_early ? -p.low : p.high);
  return fmt::format("the camera's clock is {} by {:.1f} ms ({:.1f} to {:.1f})", is_early ? "early" : "late",
                     1e3 * std::abs(p.value), low, high);
}

// What is small in metres or kilograms is told in their thousandths.
std::pair<std::string, double> unit_of_page(const SizedParameter& p) {
  constexpr double kSmall = 0.1;
  if (std::max({std::abs(p.value), std::abs(p.low), std::abs(p.high)}) < kSmall) {
    if (p.unit == "m") return {"mm", 1e3};
    if (p.unit == "kg") return {"g", 1e3};
  }
  return {p.unit, 1};
}

}  // namespace

std::string in_words(const SizedParameter& p) {
  if (p.name == "delay" && p.unit == "s") return late_in_words(p);
  const auto [unit, factor] = unit_of_page(p);
  return fmt::format("{} {}{}{} ({} to {})", with_blanks(p.name), short_number(factor * p.value, 3),
                     unit.empty() ? "" : " ", unit, short_number(factor * p.low, 3), short_number(factor * p.high, 3));
}

std::string in_words(const std::vector<SizedParameter>& parameters) {
  std::string out;
  for (const SizedParameter& p : parameters) out += (out.empty() ? "" : "; ") + in_words(p);
  return out;
}

std::string unseen_in_words(const EffectFinding& f) {
  std::string out;
  for (const SizedParameter& p : f.at_most) {
    const auto [unit, factor] = unit_of_page(p);
    out +=
        fmt::format("{}{} {} to {}{}{}", out.empty() ? "" : "; ", with_blanks(p.name), short_number(factor * p.low, 2),
                    short_number(factor * p.high, 2), unit.empty() ? "" : " ", unit);
  }
  return out.empty() ? "any" : out;
}

std::string interval_in_words(double low_mm, double high_mm, int decimals) {
  if (!std::isfinite(low_mm) || !std::isfinite(high_mm) || low_mm == high_mm) return "";
  return fmt::format(" (90 %: {:.{}f} to {:.{}f} mm)", low_mm, decimals, high_mm, decimals);
}

std::string gap_in_words(const Diagnosis& d) {
  const std::string gap = fmt::format(
      "The base model's error in trials that it was not fitted to is {:.2f} mm above "
      "the noise of the measurement",
      d.gap_mm);
  if (d.groups < 2)
    return gap +
           ". How sure that is cannot be told, nor whether a right model would leave as much: all trials repeat "
           "one motion.";
  const std::string rough =
      d.groups < kGroupsForAnInterval ? fmt::format(", a rough guess from {} motions", d.groups) : "";
  return fmt::format("{}{}{}. The chance that a right model would leave as much is {} (p).", gap,
                     interval_in_words(d.low_mm, d.high_mm, 2), rough,
                     d.p_value < 0.001 ? "below 0.001" : short_number(d.p_value, 2));
}

std::string motion_in_words(const std::string& motion, double moving_s) {
  return std::isfinite(moving_s) ? fmt::format("{}, the first {:.1f} s of motion", motion, moving_s) : motion;
}

std::string no_effect_in_words(const Diagnosis& d) {
  return fmt::format(
      "Probability that no effect is needed: {:.3f}. That the cause is something that is not in the "
      "library of effects: {:.3f}.",
      d.probability.at("none"), d.probability.at("unknown"));
}

std::string before_and_after(const GapReduction& s) { return fmt::format("{:.2f} → {:.2f}", s.before_mm, s.after_mm); }

std::string name_in_words(const EffectFinding& f) {
  return f.beside.empty() ? f.name : fmt::format("{}, with {}", f.name, fmt::join(f.beside, " and "));
}

std::string share_closed(const GapReduction& s) {
  return std::isfinite(s.low) ? fmt::format("{:.2f} ({:.2f} … {:.2f})", s.fraction, s.low, s.high)
                              : fmt::format("{:.2f}", s.fraction);
}

}  // namespace selvedge::diagnose
