// What a piece of code says when it refuses its input.
#pragma once

#include <string>

#include "files/bad_input.h"

namespace selvedge {

// The refusal's text; empty where nothing was refused.
template <class Action>
std::string refusal_of(Action action) {
  try {
    action();
  } catch (const BadInput& error) { return error.what(); }
  return "";
}

}  // namespace selvedge
