// The simulated DLPC350 itself: it must be as strict as the real one, or the driver's tests mean nothing.
#include <gtest/gtest.h>

#include <random>

#include "hardware_sim/dlpc350/device.h"

namespace selvedge::hardware_sim {
namespace {

using Bytes = std::vector<std::uint8_t>;

// Sends one message and returns {rejected, payload}.
struct Answer {
  bool rejected = true;
  Bytes payload;
};
Answer ask(Dlpc350Device& device, std::uint8_t flags, std::uint16_t code, const Bytes& data, double now_s) {
  const size_t length = 2 + data.size();
  Bytes message{flags,
                1,
                static_cast<std::uint8_t>(length),
                static_cast<std::uint8_t>(length >> 8),
                static_cast<std::uint8_t>(code),
                static_cast<std::uint8_t>(code >> 8)};
  message.insert(message.end(), data.begin(), data.end());
  std::vector<projector::Report> replies;
  for (size_t at = 0; at < message.size(); at += 64) {
    projector::Report report{};
    std::copy_n(message.begin() + static_cast<long>(at), std::min<size_t>(64, message.size() - at), report.begin());
    replies = device.on_report(report, now_s);
  }
  EXPECT_EQ(replies.size(), 1u);
  if (replies.empty()) return {};
  const auto& reply = replies[0];
  return {(reply[0] & 0x20) != 0, Bytes(reply.begin() + 4, reply.begin() + 4 + reply[2])};
}
bool write(Dlpc350Device& device, std::uint16_t code, const Bytes& data, double now_s = 0) {
  return !ask(device, 0x40, code, data, now_s).rejected;
}

// A sequence of the stripes of period 16 (image 2, plane 6), configured at t = 1.
void configure(Dlpc350Device& device, const Bytes& times = {0x10, 0x27, 0, 0, 0x10, 0x27, 0, 0}) {
  EXPECT_TRUE(write(device, 0x1A1B, {1}, 0));
  EXPECT_TRUE(write(device, 0x1A22, {3}, 1));
  EXPECT_TRUE(write(device, 0x1A31, {0, 1, 0, 0}, 1));
  EXPECT_TRUE(write(device, 0x1A29, times, 1));
  EXPECT_TRUE(write(device, 0x1A23, {1}, 1));
  EXPECT_TRUE(write(device, 0x1A07, {8}, 1));
  EXPECT_TRUE(write(device, 0x1A33, {2}, 1));
  EXPECT_TRUE(write(device, 0x1A34, {6 << 2, 0x71, 4}, 1));
  EXPECT_TRUE(write(device, 0x1A33, {1}, 1));
  EXPECT_TRUE(write(device, 0x1A34, {2}, 1));
  EXPECT_TRUE(write(device, 0x1A33, {0}, 1));
}

TEST(Dlpc350Device, StartsOnlyWhatWasValidated) {
  Dlpc350Device device({});
  configure(device);
  EXPECT_FALSE(write(device, 0x1A24, {2}, 2));
  EXPECT_TRUE(write(device, 0x1A1A, {0}, 2));
  EXPECT_EQ(ask(device, 0xC0, 0x1A1A, {}, 2.001).payload, Bytes{0x80});
  EXPECT_EQ(ask(device, 0xC0, 0x1A1A, {}, 2.1).payload, Bytes{0});
  EXPECT_TRUE(write(device, 0x1A24, {2}, 2.1));
  EXPECT_EQ(device.pattern_at(2.2), (projector::Pattern{.kind = projector::PatternKind::stripes, .period_px = 16}));
  EXPECT_EQ(device.pattern_at(2.0).kind, projector::PatternKind::off);
}

TEST(Dlpc350Device, NothingIsConfiguredWhileItRuns) {
  Dlpc350Device device({});
  configure(device);
  EXPECT_TRUE(write(device, 0x1A1A, {0}, 2));
  EXPECT_TRUE(write(device, 0x1A24, {2}, 3));
  for (const std::uint16_t code : {0x1A1B, 0x1A22, 0x1A33, 0x1A1A}) EXPECT_FALSE(write(device, code, {1}, 3));
  EXPECT_TRUE(write(device, 0x1A24, {0}, 3));
  EXPECT_TRUE(write(device, 0x1A22, {3}, 3));
  EXPECT_FALSE(write(device, 0x1A24, {2}, 4));  // the validation no longer holds
}

TEST(Dlpc350Device, ValidationFindsWhatIsWrong) {
  const auto verdict = [](const Bytes& times) {
    Dlpc350Device device({});
    configure(device, times);
    EXPECT_TRUE(write(device, 0x1A1A, {0}, 2));
    return ask(device, 0xC0, 0x1A1A, {}, 3).payload.at(0);
  };
  EXPECT_EQ(verdict({0x10, 0x27, 0, 0, 0x10, 0x27, 0, 0}), 0);
  EXPECT_EQ(verdict({0x10, 0x27, 0, 0, 0x74, 0x27, 0, 0}) & 0x10, 0x10);  // period 100 us above the exposure
  EXPECT_EQ(verdict({100, 0, 0, 0, 100, 0, 0, 0}) & 0x01, 0x01);          // 100 us is too short
}

TEST(Dlpc350Device, UnknownCommandsAndWrongLengthsAreRejected) {
  Dlpc350Device device({});
  EXPECT_FALSE(write(device, 0x7777, {1}));
  EXPECT_FALSE(write(device, 0x1A07, {1, 2}));
  EXPECT_FALSE(write(device, 0x1A1B, {7}));
  EXPECT_TRUE(ask(device, 0xC0, 0x7777, {}, 0).rejected);
  EXPECT_TRUE(write(device, 0x0200, {1}));
  EXPECT_FALSE(write(device, 0x1A07, {7}));  // standby
  EXPECT_EQ(device.rejected(), 5);
}

TEST(Dlpc350Device, SurvivesRandomReports) {
  Dlpc350Device device({});
  std::mt19937 random(9);
  double now_s = 0;
  for (int round = 0; round < 300000; ++round) {
    projector::Report report{};
    for (auto& byte : report) byte = static_cast<std::uint8_t>(random() % 4 == 0 ? random() : random() % 4);
    if (round % 2 == 0) {  // well-formed around random data, so that it gets beyond the header
      report[0] = 0x40 | (random() % 2 ? 0x80 : 0);
      report[2] = static_cast<std::uint8_t>(2 + random() % 14);
      report[3] = 0;
      report[4] = static_cast<std::uint8_t>(random() % 0x40);
      report[5] = 0x1A;
    }
    device.on_report(report, now_s += 0.001);
    if (round % 100 == 0) projector::brightness(device.pattern_at(now_s), 3, 4);
  }
  EXPECT_GT(device.rejected(), 1000);
}

}  // namespace
}  // namespace selvedge::hardware_sim
