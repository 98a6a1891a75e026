#include "rig/camera/frame_ring.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <thread>

#include <gtest/gtest.h>

#include "files/bad_input.h"
#include "tests/refusal.h"

namespace selvedge::camera {
namespace {

constexpr int kWidth = 64, kHeight = 48;

class FrameRingTest : public ::testing::Test {
 protected:
  FrameRingTest() : name_(ring_name(static_cast<int>(::getpid()), "test")) { FrameRingWriter::remove(name_); }
  ~FrameRingTest() override { FrameRingWriter::remove(name_); }

  static int64_t write(FrameRingWriter& writer, int64_t number) {
    RingHead head;
    head.frame_number = number;
    head.device_ticks = 1000 * number;
    head.whole = true;
    const std::vector<uint8_t> pixels(kWidth * kHeight, static_cast<uint8_t>(number));
    return writer.write(head, pixels.data());
  }
  static void expect_frame(const RingFrame& frame, int64_t number) {
    EXPECT_EQ(frame.head.frame_number, number);
    EXPECT_EQ(frame.head.device_ticks, 1000 * number);
    EXPECT_EQ(frame.pixels, std::vector<uint8_t>(kWidth * kHeight, static_cast<uint8_t>(number)));
  }
  const std::string name_;
};

TEST_F(FrameRingTest, EveryReaderGetsEveryFrameInOrder) {
  FrameRingWriter writer(name_, kWidth, kHeight, 8);
  FrameRingReader first(name_), second(name_);
  RingFrame frame;
  EXPECT_FALSE(first.next(frame, 0));
  for (int64_t number = 1; number <= 5; ++number) EXPECT_EQ(write(writer, number), number);
  for (FrameRingReader* reader : {&first, &second}) {
    for (int64_t number = 1; number <= 5; ++number) {
      ASSERT_TRUE(reader->next(frame, 0));
      EXPECT_EQ(frame.ring_number, number);
      expect_frame(frame, number);
    }
    EXPECT_FALSE(reader->next(frame, 0.01));
    EXPECT_EQ(reader->missed(), 0);
  }
}

TEST_F(FrameRingTest, CountsWhatItWasTooSlowFor) {
  FrameRingWriter writer(name_, kWidth, kHeight, 8);
  FrameRingReader reader(name_);
  for (int64_t number = 1; number <= 100; ++number) write(writer, number);
  RingFrame frame;
  int64_t read = 0, last = 0;
  while (reader.next(frame, 0)) {
    if (last != 0) { EXPECT_EQ(frame.ring_number, last + 1); }
    expect_frame(frame, frame.ring_number);
    last = frame.ring_number;
    ++read;
  }
  EXPECT_EQ(last, 100);
  EXPECT_EQ(read + reader.missed(), 100);
  EXPECT_GE(read, 7);
}

TEST_F(FrameRingTest, NoFrameIsTornWhileTheWriterRuns) {
  FrameRingWriter writer(name_, kWidth, kHeight, 4);
  FrameRingReader reader(name_);
  const int64_t frames = 20000;
  std::thread thread([&] {
    for (int64_t number = 1; number <= frames; ++number) write(writer, number);
  });
  RingFrame frame;
  int64_t read = 0, last = 0;
  while (last < frames && reader.next(frame, 10)) {
    ASSERT_GT(frame.ring_number, last);
    last = frame.ring_number;
    ++read;
    for (const uint8_t pixel : frame.pixels) ASSERT_EQ(pixel, static_cast<uint8_t>(last));
  }
  thread.join();
  EXPECT_EQ(last, frames);
  EXPECT_EQ(read + reader.missed(), frames);
}

TEST_F(FrameRingTest, OutlivesAKilledWriter) {
  const pid_t child = ::fork();
  if (child == 0) {
    FrameRingWriter writer(name_, kWidth, kHeight, 8);
    for (int64_t number = 1; number <= 3; ++number) write(writer, number);
    ::kill(::getpid(), SIGKILL);
  }
  ::waitpid(child, nullptr, 0);
  FrameRingReader reader(name_);
  FrameRingWriter writer(name_, kWidth, kHeight, 8);
  EXPECT_EQ(write(writer, 4), 4);
  RingFrame frame;
  ASSERT_TRUE(reader.next(frame, 0));
  expect_frame(frame, 4);
  EXPECT_EQ(reader.missed(), 0);
  EXPECT_FALSE(reader.replaced());
}

TEST_F(FrameRingTest, RefusesASecondWriterAndAMissingRing) {
  EXPECT_THROW(FrameRingReader reader(name_), BadInput);
  FrameRingWriter writer(name_, kWidth, kHeight, 8);
  EXPECT_THROW(FrameRingWriter second(name_, kWidth, kHeight, 8, 0), BadInput);
}

TEST_F(FrameRingTest, AnotherSizeMakesANewRing) {
  auto writer = std::make_unique<FrameRingWriter>(name_, kWidth, kHeight, 8);
  FrameRingReader reader(name_);
  write(*writer, 1);
  writer.reset();
  FrameRingWriter bigger(name_, 2 * kWidth, kHeight, 8);
  RingFrame frame;
  ASSERT_TRUE(reader.next(frame, 0));  // what it holds stays readable
  expect_frame(frame, 1);
  EXPECT_TRUE(reader.replaced());
}

// A station that was killed leaves a daemon that takes a moment to end: the next one's waits for it.
TEST_F(FrameRingTest, AWriterWaitsForTheOneBeforeItToEnd) {
  auto before = std::make_unique<FrameRingWriter>(name_, kWidth, kHeight, 8);
  write(*before, 1);
  std::jthread ends([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    before.reset();
  });
  FrameRingWriter next(name_, kWidth, kHeight, 8);
  EXPECT_EQ(next.newest_frame_number(), 1);
}

TEST_F(FrameRingTest, AWriterThatDoesNotEndIsNotJoined) {
  const FrameRingWriter before(name_, kWidth, kHeight, 8);
  EXPECT_THROW(FrameRingWriter(name_, kWidth, kHeight, 8, 0.3), BadInput);
}

// Numbers of another process: none of them may lead out of the memory.
TEST_F(FrameRingTest, AHeaderThatCannotBeIsRefused) {
  const auto refused_with = [&](off_t at, auto value) {
    FrameRingWriter::remove(name_);
    { FrameRingWriter writer(name_, kWidth, kHeight, 8); }
    const int descriptor = ::shm_open(name_.c_str(), O_RDWR | O_CLOEXEC, 0);
    EXPECT_EQ(::pwrite(descriptor, &value, sizeof value, at), static_cast<ssize_t>(sizeof value));
    ::close(descriptor);
    return refusal_of([&] { FrameRingReader reader(name_); });
  };
  constexpr off_t width_at = 8, slots_at = 16, newest_at = 24;
  EXPECT_EQ(refused_with(width_at, int32_t{kWidth}), "");
  for (const int32_t value : {0, -1, kWidth + 1, INT32_MIN}) {
    EXPECT_NE(refused_with(width_at, value).find("no frame ring"), std::string::npos) << value;
    EXPECT_NE(refused_with(slots_at, value).find("no frame ring"), std::string::npos) << value;
  }
  for (const int64_t value : {int64_t{-1}, INT64_MAX, INT64_MIN})
    EXPECT_NE(refused_with(newest_at, value).find("no frame ring"), std::string::npos) << value;
  // A writer does not go on with such a ring: it makes a new one.
  EXPECT_EQ(FrameRingWriter(name_, kWidth, kHeight, 8).newest_frame_number(), 0);
}

TEST_F(FrameRingTest, ANewestFrameThatCannotBeIsRefusedWhileReading) {
  FrameRingWriter writer(name_, kWidth, kHeight, 8);
  FrameRingReader reader(name_);
  const int descriptor = ::shm_open(name_.c_str(), O_RDWR | O_CLOEXEC, 0);
  const int64_t newest = INT64_MAX;
  ASSERT_EQ(::pwrite(descriptor, &newest, sizeof newest, 24), 8);
  ::close(descriptor);
  RingFrame frame;
  EXPECT_NE(refusal_of([&] { reader.next(frame, 0); }).find("as its newest"), std::string::npos);
}

}  // namespace
}  // namespace selvedge::camera
