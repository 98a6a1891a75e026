// Weighing sets of effects where they stand: about the base with what is negligible of every effect, then once more
// about the likeliest set.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "diagnose/effect_sets.h"
#include "report/progress.h"

namespace selvedge::diagnose {

struct Weighing {
  Linearisation none;                  // about the base
  std::vector<size_t> first;           // the set that was likeliest there
  std::optional<Linearisation> there;  // about that set, where it has effects
  std::optional<Evidence> evidence;    // of all sets: always there
  std::vector<EffectSet> sets;
  Verdict verdict;

  // Where a set was weighed.
  const Linearisation& about(const std::vector<size_t>& effects) const;
  const EffectSet& set_of(const std::vector<size_t>& effects) const;
};

struct WeighingOptions {
  std::function<void(double done, const std::string& what)> begins = [](double, const std::string&) {};  // 0 to 1
  std::function<void(const std::string& stage)> ends = [](const std::string&) {};
};

// Throws std::runtime_error where the base diverges.
Weighing weigh(Study& study, const Windows& windows, const WeighingOptions& options);

}  // namespace selvedge::diagnose
