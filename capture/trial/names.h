// What people call things: names that become folders, and the kinds of trial, as session files, mappings and pages say
// them.
#pragma once

#include <optional>
#include <string>

#include "capture/trial/trial.h"

namespace selvedge::trial {

// Small letters, digits, - and _, at least one.
inline bool is_plain_name(const std::string& name) {
  return !name.empty() && name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-_") == std::string::npos;
}

// "static", "waving", "robot"; none for any other word: a rig records no material tests.
inline std::optional<Experiment> experiment_named(const std::string& text) {
  for (const Experiment kind : {Experiment::static_hang, Experiment::waving, Experiment::robot})
    if (text == to_text(kind)) return kind;
  return std::nullopt;
}

}  // namespace selvedge::trial
