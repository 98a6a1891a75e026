// What every projector back-end has to do; included by the test program of each way to reach a device.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <ostream>
#include <thread>

#include "files/bad_input.h"
#include "rig/projector/projector.h"
#include "rig/wire/socket.h"

namespace selvedge {

using projector::Pattern;
using projector::PatternKind;

using Picture = std::function<double(int column_px, int row_px)>;  // brightness, 0 to 1

// A simulated device: what it shows now, and how to reach and to disturb it.
struct Device {
  std::function<std::unique_ptr<projector::Projector>()> open;
  std::function<Picture()> shown;
  std::function<void()> disconnect;
  std::function<void()> reject_next;  // empty where such a device rejects nothing
  std::function<void()> hang;
  Pattern cannot_show = {.kind = PatternKind::stripes, .period_px = 16.5};
};

inline Picture picture_of(const Pattern& pattern) {
  return [pattern](int column_px, int row_px) { return projector::brightness(pattern, column_px, row_px); };
}

inline void expect_same(const Picture& shown, const Pattern& pattern) {
  for (int column = 0; column < 912; column += 7)
    for (int row = 0; row < 1140; row += 5)
      ASSERT_EQ(shown(column, row), projector::brightness(pattern, column, row))
          << "kind " << static_cast<int>(pattern.kind) << " bit " << pattern.bit << " at " << column << ", " << row;
}

struct Backend {
  std::string name;
  std::function<Device()> start;
};
inline void PrintTo(const Backend& backend, std::ostream* out) { *out << backend.name; }

class ProjectorContract : public testing::TestWithParam<Backend> {};

TEST_P(ProjectorContract, ShowsWhatItIsToldOnceItReturns) {
  const Device device = GetParam().start();
  const auto projector = device.open();
  std::vector<Pattern> patterns{{.kind = PatternKind::solid},
                                {.kind = PatternKind::solid, .inverted = true},
                                {.kind = PatternKind::stripes, .period_px = 16},
                                {.kind = PatternKind::stripes, .period_px = 24, .inverted = true},
                                {}};
  for (int bit = 0; bit < 11; ++bit) patterns.push_back({.kind = PatternKind::gray_code, .bit = bit});
  for (int bit = 0; bit < 10; ++bit)
    patterns.push_back({.kind = PatternKind::gray_code,
                        .orientation = projector::Orientation::vertical,
                        .bit = bit,
                        .inverted = bit % 2 == 1});
  for (const auto& pattern : patterns) {
    projector->show(pattern);
    projector->check();
    ASSERT_NO_FATAL_FAILURE(expect_same(device.shown(), pattern));
  }
}

TEST_P(ProjectorContract, PatternItCannotShowIsRefusedAndNothingChanges) {
  const Device device = GetParam().start();
  const auto projector = device.open();
  const Pattern stripes{.kind = PatternKind::stripes, .period_px = 16};
  projector->show(stripes);
  EXPECT_THROW(projector->show(device.cannot_show), BadInput);
  expect_same(device.shown(), stripes);
}

TEST_P(ProjectorContract, RejectedCommandIsAFaultAndTheNextOneWorks) {
  const Device device = GetParam().start();
  if (!device.reject_next) GTEST_SKIP() << "skipped: a device of this kind rejects no command";
  const auto projector = device.open();
  device.reject_next();
  EXPECT_THROW(projector->show({.kind = PatternKind::solid}), projector::ProjectorFault);
  projector->show({.kind = PatternKind::solid});
  expect_same(device.shown(), {.kind = PatternKind::solid});
}

TEST_P(ProjectorContract, PulledPlugIsSaidAndANewConnectionWorks) {
  const Device device = GetParam().start();
  auto projector = device.open();
  projector->show({.kind = PatternKind::solid});
  device.disconnect();
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_THROW(projector->check(), wire::Disconnected);
  projector.reset();
  projector = device.open();
  projector->show({.kind = PatternKind::solid});
  expect_same(device.shown(), {.kind = PatternKind::solid});
}

TEST_P(ProjectorContract, SilentDeviceIsSaidInTime) {
  const Device device = GetParam().start();
  const auto projector = device.open();
  for (int i = 0; i < 3; ++i) projector->check();  // what was left to be said from the start is said
  device.hang();
  EXPECT_THROW(projector->check(), wire::Disconnected);
}

}  // namespace selvedge
