// A V4L2 capture device at the level of its ioctls, under umockdev: GREY pictures in mapped buffers, streaming.
//
// The process must run under umockdev-wrapper. The node is a regular file that holds the buffers, so that a client's
// mmap at the offsets of QUERYBUF works. poll() always says ready there; a DQBUF without a picture waits some
// milliseconds and says EAGAIN. Frames are stamped with the start of their exposure on CLOCK_MONOTONIC; the sequence
// counts every period, also those for which no buffer was queued.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

namespace selvedge::hardware_sim {

struct V4l2CameraOptions {
  std::string node = "/dev/video0";
  int width_px = 320, height_px = 240;
  double rate_hz = 30;        // a client may set it
  double exposure_s = 0.002;  // likewise, in steps of 0.1 ms
  bool stamps_end_of_frame = false;
};

class V4l2Camera {
 public:
  // Fills width_px·height_px bytes; exposure_mid_host_s on CLOCK_MONOTONIC.
  using ImageSource = std::function<void(double exposure_mid_host_s, uint8_t* pixels)>;

  // Throws std::runtime_error outside umockdev-wrapper.
  V4l2Camera(const V4l2CameraOptions& options, ImageSource image_at);
  ~V4l2Camera();

  void drop_next(int frames);   // they are counted and never delivered
  void spoil_next(int frames);  // they are delivered with the error flag
  void unplug();                // every call fails from now on

 private:
  class Device;
  std::unique_ptr<Device> device_;
};

}  // namespace selvedge::hardware_sim
