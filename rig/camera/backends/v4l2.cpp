// Cameras with a V4L2 driver (USB webcams, MIPI sensors, frame grabbers): mapped buffers, streaming.
//
// address is the node, /dev/video0. The picture's size is the one the driver stands at (v4l2-ctl --set-fmt-video); its
// pixels are GREY, or the luma of YUYV. Drivers stamp frames on CLOCK_MONOTONIC, which is the host's clock, so reading
// the device's clock is exact. What a stamp means is less so: a driver that stamps the end of the frame leaves the
// read-out open, and minimum_delay_s with its deviation is taken for that.
// Source: The Linux Kernel, Video for Linux API, "Streaming I/O (Memory Mapping)" and struct v4l2_buffer.
#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <optional>
#include <vector>

#include <fcntl.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <spdlog/spdlog.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include "files/bad_input.h"
#include "rig/camera/camera.h"
#include "rig/clock.h"

namespace selvedge::camera {

namespace {

constexpr double kExposureUnit_s = 1e-4;  // of V4L2_CID_EXPOSURE_ABSOLUTE
constexpr double kRateTolerance = 0.02;   // a driver may round a rate by so much
constexpr int64_t kSequences = int64_t{1} << 32;

class Mapping {
 public:
  Mapping(int descriptor, const v4l2_buffer& buffer) : bytes_(buffer.length) {
    address_ = ::mmap(nullptr, bytes_, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, buffer.m.offset);
  }
  Mapping(Mapping&& other) noexcept : address_(std::exchange(other.address_, MAP_FAILED)), bytes_(other.bytes_) {}
  Mapping& operator=(Mapping&&) = delete;
  ~Mapping() {
    if (address_ != MAP_FAILED) ::munmap(address_, bytes_);
  }
  const uint8_t* data() const { return address_ == MAP_FAILED ? nullptr : static_cast<const uint8_t*>(address_); }
  size_t bytes() const { return bytes_; }

 private:
  void* address_ = MAP_FAILED;
  size_t bytes_;
};

class V4l2Camera final : public Camera {
 public:
  explicit V4l2Camera(const CameraConfiguration& configuration)
      : where_("camera " + configuration.address), configuration_(configuration),
        descriptor_(::open(configuration.address.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC)) {
    if (descriptor_ < 0) throw CameraLost(where_ + ": " + std::strerror(errno));
    try {
      require_streaming();
      choose_format();
      set_trigger(configuration.trigger);
      set_rate(configuration.rate_hz);
      prepare_exposure();
    } catch (...) {
      ::close(descriptor_);
      throw;
    }
  }
  ~V4l2Camera() override {
    let_go();
    ::close(descriptor_);
  }

  const CameraInformation& information() const override { return information_; }

  void set_exposure(double exposure_s) override {
    if (!exposure_bounds_)
      refuse(where_ + " exposure_s", "found {}, but the driver has no control of the exposure", exposure_s);
    const double least_s = exposure_bounds_->minimum * kExposureUnit_s,
                 most_s = exposure_bounds_->maximum * kExposureUnit_s;
    if (!(exposure_s >= least_s && exposure_s <= most_s))
      refuse(where_ + " exposure_s", "found {}, expected {} to {} s", exposure_s, least_s, most_s);
    v4l2_control control{V4L2_CID_EXPOSURE_ABSOLUTE, static_cast<int>(std::lround(exposure_s / kExposureUnit_s))};
    require(VIDIOC_S_CTRL, &control, "exposure_s");
    configuration_.exposure_s = exposure_s;
  }

  void set_rate(double rate_hz) override {
    if (!(rate_hz > 0 && rate_hz <= 10000))
      refuse(where_ + " rate_hz", "found {}, expected more than 0 and at most 10000 Hz", rate_hz);
    v4l2_streamparm parameters{};
    parameters.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    parameters.parm.capture.timeperframe = {1000, static_cast<unsigned>(std::lround(1000 * rate_hz))};
    require(VIDIOC_S_PARM, &parameters, "rate_hz");
    const v4l2_fract& period = parameters.parm.capture.timeperframe;
    const double granted_hz = period.numerator == 0 ? 0 : static_cast<double>(period.denominator) / period.numerator;
    if (std::abs(granted_hz - rate_hz) > kRateTolerance * rate_hz)
      refuse(where_ + " rate_hz", "found {}; the driver's nearest is {} Hz", rate_hz, granted_hz);
  }

  void set_trigger(CameraTrigger trigger) override {
    if (trigger != CameraTrigger::off) refuse(where_ + " trigger", "V4L2 knows no trigger; expected \"off\"");
  }

  void start() override {
    v4l2_requestbuffers request{};
    request.count = static_cast<unsigned>(std::min(configuration_.buffers, 32));
    request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    request.memory = V4L2_MEMORY_MMAP;
    require(VIDIOC_REQBUFS, &request, "buffers");
    if (request.count < 2) refuse(where_ + " buffers", "the driver grants {}, expected 2 or more", request.count);
    for (unsigned i = 0; i < request.count; ++i) {
      v4l2_buffer buffer = numbered(i);
      require(VIDIOC_QUERYBUF, &buffer, "buffers");
      buffers_.emplace_back(descriptor_, buffer);
      if (!buffers_.back().data())
        refuse(where_ + " buffers", "buffer {} cannot be mapped: {}", i, std::strerror(errno));
      require(VIDIOC_QBUF, &buffer, "buffers");
    }
    last_sequence_.reset();
    int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    require(VIDIOC_STREAMON, &type, "start");
    running_ = true;
  }

  void stop() override { let_go(); }

  bool next_frame(double timeout_s, const std::function<void(const CameraFrame&)>& use) override {
    const double until_s = rig::host_now_s() + timeout_s;
    v4l2_buffer buffer = numbered(0);
    while (true) {
      const double left_s = std::max(0.0, until_s - rig::host_now_s());
      pollfd ready{descriptor_, POLLIN, 0};
      if (::poll(&ready, 1, static_cast<int>(std::ceil(1e3 * left_s))) > 0 && try_ioctl(VIDIOC_DQBUF, &buffer)) break;
      if (left_s <= 0) return false;
    }
    // Whatever `use` throws, the buffer goes back.
    const auto give_back = [this](v4l2_buffer* b) { try_ioctl(VIDIOC_QBUF, b); };
    const std::unique_ptr<v4l2_buffer, decltype(give_back)> owned(&buffer, give_back);
    use(frame_of(buffer));
    return true;
  }

  void software_trigger() override { refuse(where_, "V4L2 knows no software trigger"); }

  // Drivers stamp on the host's own clock.
  bool read_clock(ClockReading& reading) override {
    reading.before_us = reading.after_us = rig::host_now_us();
    reading.ticks = reading.before_us * 1000;
    return true;
  }
  bool read_temperature(double&) override { return false; }

 private:
  static v4l2_buffer numbered(unsigned index) {
    v4l2_buffer buffer{};
    buffer.index = index;
    buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    buffer.memory = V4L2_MEMORY_MMAP;
    return buffer;
  }

  // False: not now, or the driver refuses (errno). Throws CameraLost where the device is gone.
  bool try_ioctl(unsigned long request, void* argument) {
    int result = -1;
    do result = ::ioctl(descriptor_, request, argument);
    while (result != 0 && errno == EINTR);
    if (result == 0) return true;
    if (errno == ENODEV || errno == EIO || errno == ENXIO) throw CameraLost(where_ + ": " + std::strerror(errno));
    return false;
  }
  void require(unsigned long request, void* argument, const char* what) {
    if (!try_ioctl(request, argument)) refuse(where_ + " " + what, "the driver refuses: {}", std::strerror(errno));
  }

  void require_streaming() {
    v4l2_capability capability{};
    require(VIDIOC_QUERYCAP, &capability, "address");
    const unsigned offered =
        capability.capabilities & V4L2_CAP_DEVICE_CAPS ? capability.device_caps : capability.capabilities;
    if (!(offered & V4L2_CAP_VIDEO_CAPTURE) || !(offered & V4L2_CAP_STREAMING))
      refuse(where_ + " address", "found a node that does not stream pictures, expected a capture device");
    information_.description = fmt::format("{} ({})", reinterpret_cast<const char*>(capability.card),
                                           reinterpret_cast<const char*>(capability.driver));
    information_.ticks_per_s = 1e9;
  }

  void choose_format() {
    v4l2_format format{};
    format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    require(VIDIOC_G_FMT, &format, "format");
    for (const unsigned wanted : {V4L2_PIX_FMT_GREY, V4L2_PIX_FMT_YUYV}) {
      format.fmt.pix.pixelformat = wanted;
      if (!try_ioctl(VIDIOC_S_FMT, &format) || format.fmt.pix.pixelformat != wanted) continue;
      bytes_per_pixel_ = wanted == V4L2_PIX_FMT_GREY ? 1 : 2;
      information_.width_px = static_cast<int>(format.fmt.pix.width);
      information_.height_px = static_cast<int>(format.fmt.pix.height);
      bytes_per_line_ = std::max<size_t>(format.fmt.pix.bytesperline, bytes_per_pixel_ * format.fmt.pix.width);
      grey_.resize(static_cast<size_t>(information_.width_px) * static_cast<size_t>(information_.height_px));
      return;
    }
    refuse(where_ + " format", "the driver offers neither GREY nor YUYV");
  }

  void prepare_exposure() {
    v4l2_queryctrl query{};
    query.id = V4L2_CID_EXPOSURE_ABSOLUTE;
    if (!try_ioctl(VIDIOC_QUERYCTRL, &query) || (query.flags & V4L2_CTRL_FLAG_DISABLED)) {
      spdlog::warn("{}: its driver has no control of the exposure; {} s is taken on trust", where_,
                   configuration_.exposure_s);
      return;
    }
    exposure_bounds_ = query;
    v4l2_control manual{V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL};
    try_ioctl(VIDIOC_S_CTRL, &manual);  // some have manual exposure alone
    set_exposure(configuration_.exposure_s);
  }

  CameraFrame frame_of(const v4l2_buffer& buffer) {
    CameraFrame frame;
    frame.arrival_us = rig::host_now_us();
    frame.number = widen(buffer.sequence);
    frame.ticks = exposure_start_ns(buffer);
    const size_t bytes = bytes_per_line_ * static_cast<size_t>(information_.height_px);
    const bool has_place = buffer.index < buffers_.size();
    frame.whole = has_place && !(buffer.flags & V4L2_BUF_FLAG_ERROR) && buffer.bytesused >= bytes &&
                  bytes <= buffers_[buffer.index].bytes();
    if (frame.whole) take_luma(buffers_[buffer.index].data());
    frame.pixels = grey_.data();
    return frame;
  }

  int64_t exposure_start_ns(const v4l2_buffer& buffer) {
    if ((buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) != V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC)
      refuse(where_, "the driver does not stamp frames on CLOCK_MONOTONIC, so nobody knows when they were taken");
    const int64_t stamp_ns = int64_t{buffer.timestamp.tv_sec} * 1000000000 + int64_t{buffer.timestamp.tv_usec} * 1000;
    if ((buffer.flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE) return stamp_ns;
    information_.stamp_sd_s = configuration_.minimum_delay_sd_s;
    return stamp_ns - std::llround(1e9 * (configuration_.exposure_s + configuration_.minimum_delay_s));
  }

  void take_luma(const uint8_t* lines) {
    const auto width = static_cast<size_t>(information_.width_px);
    for (size_t row = 0; row < static_cast<size_t>(information_.height_px); ++row)
      for (size_t column = 0; column < width; ++column)
        grey_[row * width + column] = lines[row * bytes_per_line_ + column * bytes_per_pixel_];
  }

  // The driver counts frames from 0 in 32 bits; a frame that it had no buffer for is counted too.
  int64_t widen(unsigned sequence) {
    if (!last_sequence_) number_ = int64_t{sequence} + 1;
    else number_ += (int64_t{sequence} - *last_sequence_ + kSequences) % kSequences;
    last_sequence_ = sequence;
    return number_;
  }

  // Also where the device is gone.
  void let_go() {
    const bool ran = std::exchange(running_, false);
    try {
      int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
      if (ran) try_ioctl(VIDIOC_STREAMOFF, &type);
      buffers_.clear();
      v4l2_requestbuffers none{};
      none.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
      none.memory = V4L2_MEMORY_MMAP;
      if (ran) try_ioctl(VIDIOC_REQBUFS, &none);
    } catch (const CameraLost&) { buffers_.clear(); }
  }

  const std::string where_;
  CameraConfiguration configuration_;
  const int descriptor_;
  CameraInformation information_;
  std::optional<v4l2_queryctrl> exposure_bounds_;
  size_t bytes_per_pixel_ = 1, bytes_per_line_ = 0;
  std::vector<Mapping> buffers_;
  std::vector<uint8_t> grey_;
  bool running_ = false;
  std::optional<int64_t> last_sequence_;
  int64_t number_ = 0;
};

}  // namespace

std::unique_ptr<Camera> open_v4l2_camera(const CameraConfiguration& configuration) {
  return std::make_unique<V4l2Camera>(configuration);
}

}  // namespace selvedge::camera
