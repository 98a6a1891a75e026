#include "hardware_sim/v4l2_camera/v4l2_camera.h"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <filesystem>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/mman.h>
#include <umockdev.h>
#include <unistd.h>

#include "rig/clock.h"

namespace selvedge::hardware_sim {

namespace {

namespace fs = std::filesystem;
constexpr size_t kPage_bytes = 4096;
constexpr unsigned kMostBuffers = 32;
constexpr auto kLongestWait = std::chrono::milliseconds(4);
constexpr double kLeastRate_hz = 1, kMostRate_hz = 200;
constexpr int kLeastExposure = 1, kMostExposure = 5000;  // 0.1 ms

// umockdev makes a node with content a regular file; clients find what it is by its numbers.
std::string description(const std::string& node) {
  const std::string name = node.substr(node.rfind('/') + 1);
  return "P: /devices/virtual/video4linux/" + name + "\nN: " + name +
         "=00\nE: SUBSYSTEM=video4linux\nE: DEVNAME=" + name + "\nE: MAJOR=81\nE: MINOR=0\nA: dev=81:0\\n\n";
}

timeval to_timeval(double host_s) {
  const double whole = std::floor(host_s);
  return {static_cast<time_t>(whole), static_cast<suseconds_t>((host_s - whole) * 1e6)};
}

}  // namespace

class V4l2Camera::Device {
 public:
  Device(const V4l2CameraOptions& options, ImageSource image_at)
      : options_(options), image_at_(std::move(image_at)), rate_hz_(options.rate_hz), exposure_s_(options.exposure_s) {
    const char* preload = std::getenv("LD_PRELOAD");
    if (preload == nullptr || std::strstr(preload, "umockdev-preload") == nullptr)
      throw std::runtime_error("the emulated V4L2 camera needs umockdev-wrapper");
    testbed_ = umockdev_testbed_new();
    handler_ = umockdev_ioctl_base_new();
    g_signal_connect_after(handler_, "handle-ioctl", G_CALLBACK(&Device::on_ioctl), this);
    GError* error = nullptr;
    umockdev_testbed_attach_ioctl(testbed_, options_.node.c_str(), handler_, &error);
    if (error == nullptr) umockdev_testbed_add_from_string(testbed_, description(options_.node).c_str(), &error);
    if (error != nullptr) {
      const std::string text = error->message;
      g_error_free(error);
      throw std::runtime_error("umockdev: " + text);
    }
    number_node();
    map_memory();
    thread_ = std::thread([this] { expose(); });
  }
  ~Device() {
    {
      const std::lock_guard lock(mutex_);
      ending_ = true;
    }
    changed_.notify_all();
    thread_.join();
    ::munmap(memory_, kMostBuffers * buffer_bytes());
    umockdev_testbed_detach_ioctl(testbed_, options_.node.c_str(), nullptr);
    g_object_unref(handler_);
    g_object_unref(testbed_);
  }

  std::atomic<int> drop_next = 0, spoil_next = 0;
  std::atomic<bool> unplugged = false;

 private:
  size_t picture_bytes() const {
    return static_cast<size_t>(options_.width_px) * static_cast<size_t>(options_.height_px);
  }
  size_t buffer_bytes() const { return (picture_bytes() + kPage_bytes - 1) / kPage_bytes * kPage_bytes; }

  // umockdev gives a regular file no device numbers, by which v4l2-ctl finds out what a node is.
  void number_node() {
    const fs::path root = umockdev_testbed_get_root_dir(testbed_);
    const std::string name = fs::path(options_.node).filename().string();
    fs::create_directories(root / "dev" / ".node");
    fs::create_directories(root / "sys" / "dev" / "char");
    fs::create_symlink("81:0", root / "dev" / ".node" / name);
    fs::create_symlink("../../devices/virtual/video4linux/" + name, root / "sys" / "dev" / "char" / "81:0");
  }

  void map_memory() {
    const int descriptor = ::open(options_.node.c_str(), O_RDWR | O_CLOEXEC);
    const bool grown =
        descriptor >= 0 && ::ftruncate(descriptor, static_cast<off_t>(kMostBuffers * buffer_bytes())) == 0;
    if (grown)
      memory_ = static_cast<uint8_t*>(
          ::mmap(nullptr, kMostBuffers * buffer_bytes(), PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0));
    if (descriptor >= 0) ::close(descriptor);
    if (!grown || memory_ == MAP_FAILED)
      throw std::runtime_error("umockdev: " + options_.node + " cannot hold the buffers: " + std::strerror(errno));
  }

  // On umockdev's own thread, one call at a time.
  static gboolean on_ioctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, Device* device) {
    const int error = device->unplugged ? ENODEV : device->handle(client);
    umockdev_ioctl_client_complete(client, error == 0 ? 0 : -1, error);
    return TRUE;
  }

  template <class Argument, class Action>
  static int with(UMockdevIoctlClient* client, Action action) {
    UMockdevIoctlData* pointer = umockdev_ioctl_client_get_arg(client);
    UMockdevIoctlData* data = umockdev_ioctl_data_resolve(pointer, 0, sizeof(Argument), nullptr);
    if (data == nullptr) return EFAULT;
    Argument argument{};
    std::memcpy(&argument, data->data, sizeof argument);
    const int error = action(argument);
    std::memcpy(data->data, &argument, sizeof argument);
    umockdev_ioctl_data_unref(data);
    return error;
  }

  int handle(UMockdevIoctlClient* client) {
    const auto request = static_cast<unsigned>(umockdev_ioctl_client_get_request(client));
    switch (request) {
      case VIDIOC_QUERYCAP: return with<v4l2_capability>(client, [](v4l2_capability& c) { return tell(c); });
      case VIDIOC_ENUM_FMT:
        return with<v4l2_fmtdesc>(
            client, [](v4l2_fmtdesc& f) { return f.index == 0 ? (f.pixelformat = V4L2_PIX_FMT_GREY, 0) : EINVAL; });
      case VIDIOC_G_FMT:
      case VIDIOC_TRY_FMT:
      case VIDIOC_S_FMT: return with<v4l2_format>(client, [this](v4l2_format& f) { return tell(f); });
      case VIDIOC_G_PARM:
      case VIDIOC_S_PARM:
        return with<v4l2_streamparm>(client, [&](v4l2_streamparm& p) { return rate(p, request == VIDIOC_S_PARM); });
      case VIDIOC_QUERYCTRL: return with<v4l2_queryctrl>(client, [](v4l2_queryctrl& q) { return tell(q); });
      case VIDIOC_S_CTRL: return with<v4l2_control>(client, [this](v4l2_control& c) { return set(c); });
      case VIDIOC_REQBUFS:
        return with<v4l2_requestbuffers>(client, [this](v4l2_requestbuffers& r) { return grant(r); });
      case VIDIOC_QUERYBUF: return with<v4l2_buffer>(client, [this](v4l2_buffer& b) { return place(b); });
      case VIDIOC_QBUF: return with<v4l2_buffer>(client, [this](v4l2_buffer& b) { return queue(b); });
      case VIDIOC_DQBUF: return with<v4l2_buffer>(client, [this](v4l2_buffer& b) { return dequeue(b); });
      case VIDIOC_STREAMON: return stream(true);
      case VIDIOC_STREAMOFF: return stream(false);
      default: return ENOTTY;
    }
  }

  static int tell(v4l2_capability& capability) {
    capability = {};
    std::strcpy(reinterpret_cast<char*>(capability.driver), "simulated");
    std::strcpy(reinterpret_cast<char*>(capability.card), "Simulated V4L2 camera");
    std::strcpy(reinterpret_cast<char*>(capability.bus_info), "platform:simulated");
    capability.device_caps = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
    capability.capabilities = capability.device_caps | V4L2_CAP_DEVICE_CAPS;
    return 0;
  }
  // One size and one format; whatever is asked for, that is the nearest.
  int tell(v4l2_format& format) const {
    if (format.type != V4L2_BUF_TYPE_VIDEO_CAPTURE) return EINVAL;
    v4l2_pix_format& pixels = format.fmt.pix;
    pixels.width = static_cast<unsigned>(options_.width_px);
    pixels.height = static_cast<unsigned>(options_.height_px);
    pixels.pixelformat = V4L2_PIX_FMT_GREY;
    pixels.field = V4L2_FIELD_NONE;
    pixels.bytesperline = pixels.width;
    pixels.sizeimage = static_cast<unsigned>(picture_bytes());
    return 0;
  }
  static int tell(v4l2_queryctrl& query) {
    if (query.id != V4L2_CID_EXPOSURE_ABSOLUTE) return EINVAL;
    query.type = V4L2_CTRL_TYPE_INTEGER;
    query.minimum = kLeastExposure;
    query.maximum = kMostExposure;
    query.step = 1;
    query.flags = 0;
    return 0;
  }

  int rate(v4l2_streamparm& parameters, bool set_it) {
    const std::lock_guard lock(mutex_);
    v4l2_captureparm& capture = parameters.parm.capture;
    if (set_it && capture.timeperframe.numerator > 0)
      rate_hz_ = std::clamp(static_cast<double>(capture.timeperframe.denominator) / capture.timeperframe.numerator,
                            kLeastRate_hz, kMostRate_hz);
    capture.capability = V4L2_CAP_TIMEPERFRAME;
    capture.timeperframe = {1000, static_cast<unsigned>(std::lround(1000 * rate_hz_))};
    return 0;
  }

  int set(const v4l2_control& control) {
    if (control.id == V4L2_CID_EXPOSURE_AUTO) return control.value == V4L2_EXPOSURE_MANUAL ? 0 : EINVAL;
    if (control.id != V4L2_CID_EXPOSURE_ABSOLUTE) return EINVAL;
    if (control.value < kLeastExposure || control.value > kMostExposure) return ERANGE;
    const std::lock_guard lock(mutex_);
    exposure_s_ = control.value * 1e-4;
    return 0;
  }

  int grant(v4l2_requestbuffers& request) {
    const std::lock_guard lock(mutex_);
    if (streaming_) return EBUSY;
    request.count = std::min(request.count, kMostBuffers);
    buffers_ = request.count;
    queued_.clear();
    filled_.clear();
    return 0;
  }
  int place(v4l2_buffer& buffer) {
    const std::lock_guard lock(mutex_);
    if (buffer.index >= buffers_) return EINVAL;
    buffer.length = static_cast<unsigned>(buffer_bytes());
    buffer.m.offset = static_cast<unsigned>(buffer.index * buffer_bytes());
    return 0;
  }
  int queue(const v4l2_buffer& buffer) {
    const std::lock_guard lock(mutex_);
    if (buffer.index >= buffers_) return EINVAL;
    queued_.push_back(buffer.index);
    return 0;
  }
  int dequeue(v4l2_buffer& buffer) {
    std::unique_lock lock(mutex_);
    if (!streaming_) return EINVAL;
    if (!changed_.wait_for(lock, kLongestWait, [this] { return !filled_.empty(); })) return EAGAIN;
    buffer = filled_.front();
    filled_.pop_front();
    return 0;
  }
  int stream(bool on) {
    const std::lock_guard lock(mutex_);
    streaming_ = on;
    sequence_ = 0;
    next_start_s_ = rig::host_now_s();
    if (!on) {
      queued_.clear();
      filled_.clear();
    }
    changed_.notify_all();
    return 0;
  }

  void expose() {
    std::unique_lock lock(mutex_);
    while (!ending_) {
      if (!streaming_) {
        changed_.wait(lock, [this] { return streaming_ || ending_; });
        continue;
      }
      const double start_s = next_start_s_, exposure_s = exposure_s_;
      const auto due = std::chrono::duration<double>(start_s + exposure_s - rig::host_now_s());
      if (changed_.wait_for(lock, due, [this] { return !streaming_ || ending_; })) continue;
      next_start_s_ = start_s + 1 / rate_hz_;
      deliver(start_s, exposure_s);
    }
  }

  // A client's pixels are written with the lock held: nobody else fills buffers.
  void deliver(double start_s, double exposure_s) {
    const unsigned sequence = sequence_++;
    if (queued_.empty()) return;
    if (drop_next > 0) {
      --drop_next;
      return;
    }
    v4l2_buffer buffer{};
    buffer.index = queued_.front();
    queued_.pop_front();
    buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    buffer.memory = V4L2_MEMORY_MMAP;
    buffer.bytesused = static_cast<unsigned>(picture_bytes());
    buffer.length = static_cast<unsigned>(buffer_bytes());
    buffer.sequence = sequence;
    buffer.field = V4L2_FIELD_NONE;
    buffer.timestamp = to_timeval(options_.stamps_end_of_frame ? start_s + exposure_s : start_s);
    buffer.flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_MAPPED | V4L2_BUF_FLAG_DONE;
    buffer.flags |= options_.stamps_end_of_frame ? V4L2_BUF_FLAG_TSTAMP_SRC_EOF : V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
    if (spoil_next > 0) {
      --spoil_next;
      buffer.flags |= V4L2_BUF_FLAG_ERROR;
    }
    image_at_(start_s + 0.5 * exposure_s, memory_ + buffer.index * buffer_bytes());
    filled_.push_back(buffer);
    changed_.notify_all();
  }

  const V4l2CameraOptions options_;
  const ImageSource image_at_;
  UMockdevTestbed* testbed_ = nullptr;
  UMockdevIoctlBase* handler_ = nullptr;
  uint8_t* memory_ = nullptr;
  std::mutex mutex_;  // guards all below
  std::condition_variable changed_;
  double rate_hz_, exposure_s_, next_start_s_ = 0;
  unsigned buffers_ = 0, sequence_ = 0;
  std::deque<unsigned> queued_;
  std::deque<v4l2_buffer> filled_;
  bool streaming_ = false, ending_ = false;
  std::thread thread_;
};

V4l2Camera::V4l2Camera(const V4l2CameraOptions& options, ImageSource image_at)
    : device_(std::make_unique<Device>(options, std::move(image_at))) {}
V4l2Camera::~V4l2Camera() = default;
void V4l2Camera::drop_next(int frames) { device_->drop_next = frames; }
void V4l2Camera::spoil_next(int frames) { device_->spoil_next = frames; }
void V4l2Camera::unplug() { device_->unplugged = true; }

}  // namespace selvedge::hardware_sim
