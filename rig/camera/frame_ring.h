// Frames from one writer to any number of readers through POSIX shared memory, without a lock and without a
// loss that goes unnoticed.
//
// The ring has N slots. Frame n (1, 2, 3 …) goes to slot n mod N. Each slot carries the number of the frame it
// holds, 0 while it is being written (a sequence lock): a reader copies the frame out and looks at the number
// again. Whoever falls N frames behind is told how many it missed. The newest number is a futex, so readers
// sleep until there is more. The memory outlives its writer: after kill -9 readers finish what is there, and
// the next writer goes on with the numbers.
//
// Layout: a 4096-byte header, then N slots of a 256-byte head and width·height bytes of pixels.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace selvedge::camera {

struct RingHead {
  int64_t frame_number = 0;  // of the camera; a step above 1 is a frame lost before the ring
  int64_t device_ticks = 0;  // start of exposure, device clock
  int64_t arrival_us = 0;    // host clock
  int64_t utime = 0;         // us, host clock, mid-exposure, as mapped when the frame arrived
  double exposure_s = 0;
  double uncertainty_s = 0;  // one sd of utime; infinity before the clock map stands
  bool whole = false;
};

struct RingShape {
  int32_t width_px = 0, height_px = 0, slots = 0;
  bool operator==(const RingShape&) const = default;
};

struct RingFrame {
  int64_t ring_number = 0;  // 1 is the first ever written
  RingHead head;
  std::vector<uint8_t> pixels;
};

// "/selvedge-PORT-DEVICE": rigs on different bus ports do not meet.
std::string ring_name(int bus_port, const std::string& device);

class FrameRingWriter {
 public:
  // Waits for another writer of the ring to end: a station that was killed leaves one for a moment, for 13 s where its
  // camera is gone. Throws BadInput where it does not within predecessor_ends_s, or shared memory is short (with the
  // bytes wanted).
  FrameRingWriter(const std::string& name, int width_px, int height_px, int slots, double predecessor_ends_s = 20);
  ~FrameRingWriter();
  FrameRingWriter(const FrameRingWriter&) = delete;
  FrameRingWriter& operator=(const FrameRingWriter&) = delete;

  // Returns the frame's number in the ring.
  int64_t write(const RingHead& head, const uint8_t* pixels);
  // The camera's number of the newest frame, whichever writer wrote it; 0 in a new ring.
  int64_t newest_frame_number() const;

  // Removes the ring's name; readers that hold it keep what they have.
  static void remove(const std::string& name);

 private:
  struct Memory* memory_ = nullptr;
  size_t bytes_ = 0;
  int descriptor_ = -1;
};

class FrameRingReader {
 public:
  // Starts behind the newest frame. Throws BadInput where there is no such ring (yet), or its header is none: sides
  // and slots out of range or not of the memory's size, a number of frames that cannot be.
  explicit FrameRingReader(const std::string& name);
  ~FrameRingReader();
  FrameRingReader(const FrameRingReader&) = delete;
  FrameRingReader& operator=(const FrameRingReader&) = delete;

  int width_px() const { return shape_.width_px; }
  int height_px() const { return shape_.height_px; }

  // The next frame, in order. False: none came within timeout_s. Reuses the memory of frame.pixels. Throws BadInput
  // where the number of the newest frame cannot be.
  bool next(RingFrame& frame, double timeout_s);
  // Frames overwritten before they were read, so far.
  int64_t missed() const { return missed_; }
  // A new writer has made a new ring under the name (other size, or after remove); open it anew.
  bool replaced() const;

 private:
  std::string name_;
  const struct Memory* memory_ = nullptr;
  RingShape shape_;  // as it was when the ring was opened: what is in the memory may change
  size_t bytes_ = 0;
  int descriptor_ = -1;
  int64_t next_number_ = 1;
  int64_t missed_ = 0;
};

}  // namespace selvedge::camera
