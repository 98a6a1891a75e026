// What the window back-end and its program say to each other over a socket of packets on one host.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <type_traits>

#include "rig/projector/pattern.h"

namespace selvedge::projector::window {

struct Request {
  bool show = false;  // else: how are you?
  Pattern pattern;
};

enum class Outcome : std::int32_t { done, refused, fault, lost };

struct Answer {
  Outcome outcome = Outcome::done;
  char text[508] = {};  // the first one: the window's description; or what is wrong; ends with a zero
};

static_assert(std::is_trivially_copyable_v<Request> && std::is_trivially_copyable_v<Answer>);

inline Answer answer(Outcome outcome, const std::string& text) {
  Answer out{outcome, {}};
  std::copy_n(text.begin(), std::min(text.size(), sizeof out.text - 1), out.text);
  return out;
}

}  // namespace selvedge::projector::window
