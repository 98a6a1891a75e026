#include "rig/projector/backends/window_packets.h"

#include <cmath>
#include <cstddef>
#include <cstring>

#include "files/bad_input.h"
#include "rig/wire/bytes.h"

namespace selvedge::projector::window {

namespace {

template <class Packet>
void check_size(std::span<const std::uint8_t> bytes) {
  if (bytes.size() != sizeof(Packet))
    throw wire::WireError(fmt::format("a packet of {} bytes, expected {}", bytes.size(), sizeof(Packet)));
}

// Looked at as a number before it is read as what it stands for: another value would be no such thing in C++.
template <class Number>
void check_number(std::span<const std::uint8_t> bytes, size_t at, Number most, const char* name) {
  Number value;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  if (value < 0 || value > most) throw wire::WireError(fmt::format("{} {}, expected 0 to {}", name, value, most));
}

void check_flag(std::span<const std::uint8_t> bytes, size_t at, const char* name) {
  static_assert(sizeof(bool) == 1);
  check_number<std::uint8_t>(bytes, at, 1, name);
}

}  // namespace

Said decode_answer(std::span<const std::uint8_t> bytes) {
  check_size<Answer>(bytes);
  check_number<std::int32_t>(bytes, offsetof(Answer, outcome), static_cast<std::int32_t>(Outcome::lost), "outcome");
  Answer answer;
  std::memcpy(&answer, bytes.data(), sizeof answer);
  // The text may lack its zero.
  return {answer.outcome, std::string(answer.text, ::strnlen(answer.text, sizeof answer.text))};
}

Request decode_request(std::span<const std::uint8_t> bytes) {
  check_size<Request>(bytes);
  constexpr size_t pattern = offsetof(Request, pattern);
  static_assert(sizeof(PatternKind) == sizeof(std::int32_t) && sizeof(Orientation) == sizeof(std::int32_t));
  check_flag(bytes, offsetof(Request, show), "show");
  check_flag(bytes, pattern + offsetof(Pattern, inverted), "inverted");
  check_number<std::int32_t>(bytes, pattern + offsetof(Pattern, kind),
                             static_cast<std::int32_t>(PatternKind::phase_shift), "kind");
  check_number<std::int32_t>(bytes, pattern + offsetof(Pattern, orientation),
                             static_cast<std::int32_t>(Orientation::vertical), "orientation");
  Request request;
  std::memcpy(&request, bytes.data(), sizeof request);
  try {
    check_pattern(request.pattern);
  } catch (const BadInput& error) { throw wire::WireError(error.what()); }
  return request;
}

void check_pattern(const Pattern& p) {
  for (const double value : {p.level, p.period_px, p.duty, p.first_bright_row_px, p.phase_rad})
    if (!std::isfinite(value)) refuse("projector", "a pattern with the number {}, expected finite ones", value);
  if (p.level < 0 || p.level > 1) refuse("projector", "a pattern of level {}, expected 0 to 1", p.level);
  const bool periodic = p.kind == PatternKind::stripes || p.kind == PatternKind::phase_shift;
  if (periodic && !(p.period_px > 0))
    refuse("projector", "a pattern with a period of {} px, expected above 0", p.period_px);
  if (p.kind == PatternKind::gray_code && (p.bit < 0 || p.bit > 31))
    refuse("projector", "Gray code's bit {}, expected 0 to 31", p.bit);
}

}  // namespace selvedge::projector::window
