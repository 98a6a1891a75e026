// Packets between the window back-end and its program: what they cannot say is refused before it is a value.
#include "rig/projector/backends/window_packets.h"

#include <cstring>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "rig/wire/bytes.h"

namespace selvedge::projector::window {
namespace {

template <class Packet>
std::vector<std::uint8_t> bytes_of(const Packet& packet) {
  std::vector<std::uint8_t> bytes(sizeof packet);
  std::memcpy(bytes.data(), &packet, sizeof packet);
  return bytes;
}

TEST(WindowPackets, SayWhatTheyWereMadeOf) {
  EXPECT_EQ(decode_answer(bytes_of(answer(Outcome::fault, "it is hidden"))).text, "it is hidden");
  EXPECT_EQ(decode_answer(bytes_of(answer(Outcome::fault, "it is hidden"))).outcome, Outcome::fault);
  const Request request{.show = true, .pattern = {.kind = PatternKind::stripes, .period_px = 16}};
  EXPECT_EQ(decode_request(bytes_of(request)).pattern, request.pattern);
}

TEST(WindowPackets, ATextWithoutItsZeroEndsWithThePacket) {
  Answer packet;
  std::memset(packet.text, 'x', sizeof packet.text);
  EXPECT_EQ(decode_answer(bytes_of(packet)).text, std::string(sizeof packet.text, 'x'));
}

TEST(WindowPackets, WhatCannotBeIsRefused) {
  std::vector<std::uint8_t> bytes = bytes_of(answer(Outcome::done, ""));
  bytes[0] = 4;
  EXPECT_THROW(decode_answer(bytes), wire::WireError);
  bytes.pop_back();
  EXPECT_THROW(decode_answer(bytes), wire::WireError);
  const std::vector<std::uint8_t> sound = bytes_of(Request{});
  for (const size_t at : {offsetof(Request, show), offsetof(Request, pattern) + offsetof(Pattern, kind),
                          offsetof(Request, pattern) + offsetof(Pattern, orientation),
                          offsetof(Request, pattern) + offsetof(Pattern, inverted)}) {
    bytes = sound;
    bytes[at] = 7;
    EXPECT_THROW(decode_request(bytes), wire::WireError) << at;
  }
  for (const Pattern& pattern :
       {Pattern{.kind = PatternKind::stripes, .period_px = 0}, Pattern{.kind = PatternKind::gray_code, .bit = 32},
        Pattern{.level = 1.5}, Pattern{.phase_rad = std::numeric_limits<double>::quiet_NaN()}})
    EXPECT_THROW(decode_request(bytes_of(Request{true, pattern})), wire::WireError);
}

}  // namespace
}  // namespace selvedge::projector::window
