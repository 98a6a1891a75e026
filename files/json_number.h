// A number in JSON, which has no word for infinity and none for not-a-number.
#pragma once

#include <cmath>

#include <nlohmann/json.hpp>

namespace selvedge::files {

inline nlohmann::json finite_or_null(double value) {
  return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(nullptr);
}

}  // namespace selvedge::files
