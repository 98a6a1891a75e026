// What the window back-end and its program say to each other over a socket of packets on one host.
//
// Both are the same build, so a packet is the struct as it lies in memory; what arrives is checked field by field
// before it becomes one.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
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

// What a packet's bytes say. Throw wire::WireError where they are none: another size, a value that its field cannot
// have, a pattern that cannot be drawn (check_pattern).
struct Said {
  Outcome outcome = Outcome::done;
  std::string text;
};
Said decode_answer(std::span<const std::uint8_t> bytes);
Request decode_request(std::span<const std::uint8_t> bytes);

// Throws BadInput where a number is not finite, the level none of 0 to 1, a stripe's period not above 0, or a bit none
// of 0 to 31.
void check_pattern(const Pattern& pattern);

}  // namespace selvedge::projector::window
