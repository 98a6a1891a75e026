// GigE Vision and USB3 Vision cameras through Aravis 0.8.
//
// Settled here once, each for a reason that cost somebody frames: the device is opened by its address; the
// packet socket is off (as root on a host with another network card it delivers nothing); the socket buffer is
// fixed and holds four frames; lost packets are asked for again as often as it takes.
// Aravis converts GigE Vision time stamps to nanoseconds, so ticks here are nanoseconds.
#include <arv.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <thread>

#include <spdlog/spdlog.h>

#include "files/bad_input.h"
#include "rig/camera/camera.h"
#include "rig/clock.h"

namespace selvedge::camera {

namespace {

constexpr unsigned kPacketTimeout_us = 20000;    // a packet this late is asked for again
constexpr unsigned kFrameRetention_us = 200000;  // a frame this late is given up
constexpr double kResendRatio = 2;               // resend requests a frame, of its packets; the most Aravis takes
constexpr int kFramesInSocketBuffer = 4;
constexpr double kTransfer_s = 0.05;  // of a frame, at most, after its exposure
constexpr int64_t kBlockIds = 65535;  // GigE Vision block ids run from 1 to 65535; USB3 Vision's have 64 bits, from 0

struct Unref {
  void operator()(void* object) const { g_object_unref(object); }
};
template <class Object>
using Owned = std::unique_ptr<Object, Unref>;

// A GError as our exception: silence is the connection's fault, a refusal the configuration's.
class Error {
 public:
  Error() = default;
  ~Error() { g_clear_error(&error_); }
  Error(const Error&) = delete;
  Error& operator=(const Error&) = delete;
  GError** out() { return &error_; }
  bool set() const { return error_ != nullptr; }
  std::string text() const { return error_ ? error_->message : ""; }
  void check(const std::string& where) {
    if (!error_) return;
    if (error_->domain == ARV_DEVICE_ERROR && refusal(error_->code)) throw BadInput(where + ": " + error_->message);
    throw CameraLost(where + ": " + error_->message);
  }

 private:
  static bool refusal(int code) {
    switch (code) {
      case ARV_DEVICE_ERROR_INVALID_PARAMETER:
      case ARV_DEVICE_ERROR_PROTOCOL_ERROR_INVALID_PARAMETER:
      case ARV_DEVICE_ERROR_PROTOCOL_ERROR_INVALID_ADDRESS:
      case ARV_DEVICE_ERROR_PROTOCOL_ERROR_NOT_IMPLEMENTED:
      case ARV_DEVICE_ERROR_PROTOCOL_ERROR_WRITE_PROTECT:
      case ARV_DEVICE_ERROR_FEATURE_NOT_FOUND: return true;
      default: return false;
    }
  }
  GError* error_ = nullptr;
};

// Names of the features that latch the device's clock: SFNC of today, and the older one of GigE Vision.
struct ClockFeatures {
  const char* latch;
  const char* value;
};
constexpr ClockFeatures kClockFeatures[] = {{"TimestampLatch", "TimestampLatchValue"},
                                            {"GevTimestampControlLatch", "GevTimestampValue"}};

// The same for IEEE 1588.
struct PtpFeatures {
  const char* enable;
  const char* latch;
  const char* status;
};
constexpr PtpFeatures kPtpFeatures[] = {{"PtpEnable", "PtpDataSetLatch", "PtpStatus"},
                                        {"GevIEEE1588", "GevIEEE1588DataSetLatch", "GevIEEE1588Status"}};
constexpr const char* kFollows = "Slave";  // IEEE 1588's name of a clock that follows
constexpr double kPtpWait_s = 2;

class AravisCamera final : public Camera {
 public:
  explicit AravisCamera(const CameraConfiguration& configuration)
      : where_("camera " + configuration.address), configuration_(configuration) {
    Error error;
    camera_.reset(arv_camera_new(configuration.address.c_str(), error.out()));
    if (!camera_) throw CameraLost(where_ + ": does not answer" + (error.set() ? ": " + error.text() : ""));
    g_signal_connect(device(), "control-lost", G_CALLBACK(on_control_lost), &control_lost_);
    configure();
    open_stream();
  }

  ~AravisCamera() override {
    if (running_) arv_camera_stop_acquisition(camera_.get(), nullptr);
    stream_.reset();
    g_signal_handlers_disconnect_by_data(device(), &control_lost_);
  }

  const CameraInformation& information() const override { return information_; }

  void set_exposure(double exposure_s) override {
    double least_us = 0, most_us = 0;
    Error error;
    arv_camera_get_exposure_time_bounds(camera_.get(), &least_us, &most_us, error.out());
    error.check(where_);
    if (!(exposure_s * 1e6 >= least_us && exposure_s * 1e6 <= most_us))
      refuse(where_ + " exposure_s", "found {}, expected {} to {} s", exposure_s, least_us * 1e-6, most_us * 1e-6);
    arv_camera_set_exposure_time(camera_.get(), exposure_s * 1e6, error.out());
    error.check(where_ + " exposure_s");
    exposure_s_ = exposure_s;
  }

  void set_rate(double rate_hz) override {
    double least_hz = 0, most_hz = 0;
    Error error;
    arv_camera_get_frame_rate_bounds(camera_.get(), &least_hz, &most_hz, error.out());
    error.check(where_);
    if (!(rate_hz >= least_hz && rate_hz <= most_hz))
      refuse(where_ + " rate_hz", "found {}, expected {} to {} Hz", rate_hz, least_hz, most_hz);
    arv_camera_set_frame_rate(camera_.get(), rate_hz, error.out());
    error.check(where_ + " rate_hz");
  }

  void set_trigger(CameraTrigger trigger) override {
    Error error;
    switch (trigger) {
      case CameraTrigger::off: arv_camera_clear_triggers(camera_.get(), error.out()); break;
      case CameraTrigger::software: arv_camera_set_trigger(camera_.get(), "Software", error.out()); break;
      case CameraTrigger::hardware: arv_camera_set_trigger(camera_.get(), "Line0", error.out()); break;
    }
    error.check(where_ + " trigger");
  }

  void start() override {
    for (int i = 0; i < configuration_.buffers - buffers_; ++i)
      arv_stream_push_buffer(stream_.get(), arv_buffer_new(payload_bytes_, nullptr));
    buffers_ = configuration_.buffers;
    last_block_id_ = 0;
    if (clock_) latch_clock(), starts_at_ticks_ = latched_ticks();
    Error error;
    arv_camera_start_acquisition(camera_.get(), error.out());
    error.check(where_);
    running_ = true;
  }

  void stop() override {
    Error error;
    running_ = false;
    arv_camera_stop_acquisition(camera_.get(), error.out());
    error.check(where_);
    // A frame that was on its way belongs to a count that ends here. Where the device has a clock, next_frame() knows
    // it however late it comes.
    if (clock_) return;
    const double until_s = rig::host_now_s() + exposure_s_ + kTransfer_s;
    for (double left_s; (left_s = until_s - rig::host_now_s()) > 0;)
      if (ArvBuffer* late = arv_stream_timeout_pop_buffer(stream_.get(), static_cast<guint64>(left_s * 1e6)))
        arv_stream_push_buffer(stream_.get(), late);
  }

  bool next_frame(double timeout_s, const std::function<void(const CameraFrame&)>& use) override {
    if (control_lost_) throw CameraLost(where_ + ": control lost");
    // Whatever `use` throws, the buffer goes back.
    std::unique_ptr<ArvBuffer, GiveBack> owned(nullptr, GiveBack{stream_.get()});
    CameraFrame frame;
    do {
      owned.reset();
      owned.reset(arv_stream_timeout_pop_buffer(stream_.get(), static_cast<guint64>(timeout_s * 1e6)));
      if (!owned) return false;
      frame.ticks = static_cast<int64_t>(arv_buffer_get_timestamp(owned.get()));
    } while (frame.ticks < starts_at_ticks_);
    starts_at_ticks_ = 0;
    ArvBuffer* const buffer = owned.get();
    frame.arrival_us = rig::host_now_us();
    frame.number = widen(arv_buffer_get_frame_id(buffer));
    frame.whole = arv_buffer_get_status(buffer) == ARV_BUFFER_STATUS_SUCCESS && fits(buffer);
    size_t size = 0;
    frame.pixels = static_cast<const uint8_t*>(arv_buffer_get_data(buffer, &size));
    use(frame);
    return true;
  }

  void software_trigger() override {
    Error error;
    arv_camera_software_trigger(camera_.get(), error.out());
    error.check(where_ + " software trigger");
  }

  bool read_clock(ClockReading& reading) override {
    if (!clock_) return false;
    reading.before_us = rig::host_now_us();
    latch_clock();
    reading.after_us = rig::host_now_us();
    reading.ticks = latched_ticks();
    if (ptp_) {
      const std::string status = ptp_status();
      if ((status == kFollows) != follows_) spdlog::warn("{}: ptp status {}", where_, status);
      follows_ = status == kFollows;
    }
    return true;
  }

  bool read_temperature(double& temperature_degc) override {
    if (!has_temperature_) return false;
    Error error;
    temperature_degc = arv_camera_get_float(camera_.get(), "DeviceTemperature", error.out());
    error.check(where_ + " temperature");
    return true;
  }

 private:
  struct GiveBack {
    ArvStream* stream;
    void operator()(ArvBuffer* buffer) const { arv_stream_push_buffer(stream, buffer); }
  };

  void latch_clock() {
    Error error;
    arv_camera_execute_command(camera_.get(), clock_->latch, error.out());
    error.check(where_ + " clock");
  }
  int64_t latched_ticks() {
    Error error;
    const int64_t value = arv_camera_get_integer(camera_.get(), clock_->value, error.out());
    error.check(where_ + " clock");
    if (clock_ticks_per_s_ == 1e9) return value;
    return std::llround(static_cast<long double>(value) * 1e9L / clock_ticks_per_s_);
  }

  // Called by Aravis's heartbeat thread.
  static void on_control_lost(ArvDevice*, std::atomic<bool>* lost) { *lost = true; }

  ArvDevice* device() const { return arv_camera_get_device(camera_.get()); }
  bool has(const char* feature) const { return arv_device_is_feature_available(device(), feature, nullptr); }
  std::string text(const char* (*get)(ArvCamera*, GError**)) const {
    const char* value = get(camera_.get(), nullptr);
    return value ? value : "?";
  }

  void configure() {
    Error error;
    if (arv_camera_is_gv_device(camera_.get())) {
      arv_camera_gv_set_stream_options(camera_.get(), ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
      arv_camera_gv_set_packet_size_adjustment(camera_.get(), ARV_GV_PACKET_SIZE_ADJUSTMENT_NEVER);
      arv_camera_gv_set_packet_size(camera_.get(), configuration_.packet_size_bytes, error.out());
      error.check(where_ + " packet_size_bytes");
    }
    arv_camera_set_pixel_format(camera_.get(), ARV_PIXEL_FORMAT_MONO_8, error.out());
    error.check(where_ + " 8-bit grey");
    arv_camera_set_acquisition_mode(camera_.get(), ARV_ACQUISITION_MODE_CONTINUOUS, error.out());
    error.check(where_);
    if (configuration_.trigger == CameraTrigger::off) set_rate(configuration_.rate_hz);  // clears the trigger
    set_trigger(configuration_.trigger);
    set_exposure(configuration_.exposure_s);

    gint x = 0, y = 0, width = 0, height = 0;
    arv_camera_get_region(camera_.get(), &x, &y, &width, &height, error.out());
    error.check(where_);
    payload_bytes_ = arv_camera_get_payload(camera_.get(), error.out());
    error.check(where_);
    information_.width_px = width;
    information_.height_px = height;
    information_.description = text(arv_camera_get_vendor_name) + " " + text(arv_camera_get_model_name) + " " +
                               text(arv_camera_get_device_serial_number);
    has_temperature_ = has("DeviceTemperature");
    for (const ClockFeatures& features : kClockFeatures)
      if (!clock_ && has(features.latch) && has(features.value)) clock_ = &features;
    if (configuration_.ptp) follow_ptp();
    if (has("GevTimestampTickFrequency")) {
      const int64_t rate = arv_camera_get_integer(camera_.get(), "GevTimestampTickFrequency", nullptr);
      if (rate > 0) clock_ticks_per_s_ = static_cast<double>(rate);
    }
  }

  // From now on the device's clock is that of the network's master, and steps no more once it follows. A device that
  // does not follow yet counts as lost until it does: its clock may still step.
  void follow_ptp() {
    for (const PtpFeatures& features : kPtpFeatures)
      if (!ptp_ && has(features.enable) && has(features.status)) ptp_ = &features;
    if (!ptp_)
      refuse(where_ + " ptp", "found a device without IEEE 1588, expected {} and {}", kPtpFeatures[0].enable,
             kPtpFeatures[0].status);
    Error error;
    arv_camera_set_boolean(camera_.get(), ptp_->enable, TRUE, error.out());
    error.check(where_ + " ptp");
    const double until_s = rig::host_now_s() + kPtpWait_s;
    std::string status;
    while ((status = ptp_status()) != kFollows) {
      if (rig::host_now_s() > until_s)
        throw CameraLost(where_ + " ptp: " + status + ", expected " + kFollows + ": is there a master on its network?");
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
  }

  std::string ptp_status() {
    Error error;
    if (has(ptp_->latch)) arv_camera_execute_command(camera_.get(), ptp_->latch, error.out());
    error.check(where_ + " ptp");
    const char* status = arv_camera_get_string(camera_.get(), ptp_->status, error.out());
    error.check(where_ + " ptp");
    return status ? status : "?";
  }

  void open_stream() {
    Error error;
    // Nothing tells a USB camera that its last client was killed: it may be exposing still, and count from then.
    arv_camera_stop_acquisition(camera_.get(), error.out());
    error.check(where_);
    stream_.reset(arv_camera_create_stream(camera_.get(), nullptr, nullptr, error.out()));
    error.check(where_);
    ids_wrap_ = ARV_IS_GV_STREAM(stream_.get());
    if (!ids_wrap_) return;
    g_object_set(stream_.get(), "socket-buffer", ARV_GV_STREAM_SOCKET_BUFFER_FIXED, "socket-buffer-size",
                 static_cast<int>(payload_bytes_) * kFramesInSocketBuffer, "packet-resend",
                 ARV_GV_STREAM_PACKET_RESEND_ALWAYS, "packet-request-ratio", kResendRatio, "packet-timeout",
                 kPacketTimeout_us, "frame-retention", kFrameRetention_us, nullptr);
  }

  // Frames count from 1.
  int64_t widen(guint64 id) {
    const auto now = static_cast<int64_t>(id);
    if (!ids_wrap_) return now + 1;
    if (last_block_id_ != 0) number_ += now >= last_block_id_ ? now - last_block_id_ : now - last_block_id_ + kBlockIds;
    else number_ = now;
    last_block_id_ = now;
    return number_;
  }

  bool fits(ArvBuffer* buffer) const {
    size_t size = 0;
    arv_buffer_get_data(buffer, &size);
    return size == static_cast<size_t>(information_.width_px) * static_cast<size_t>(information_.height_px) &&
           arv_buffer_get_image_width(buffer) == information_.width_px &&
           arv_buffer_get_image_height(buffer) == information_.height_px;
  }

  const std::string where_;
  const CameraConfiguration configuration_;
  std::atomic<bool> control_lost_{false};  // outlives camera_, whose heartbeat writes to it
  Owned<ArvCamera> camera_;
  Owned<ArvStream> stream_;
  CameraInformation information_;
  double exposure_s_ = 0;
  size_t payload_bytes_ = 0;
  int buffers_ = 0;
  bool running_ = false;
  bool has_temperature_ = false;
  const ClockFeatures* clock_ = nullptr;
  const PtpFeatures* ptp_ = nullptr;  // where the clock is to follow a master
  bool follows_ = true;               // as last seen
  double clock_ticks_per_s_ = 1e9;
  bool ids_wrap_ = true;
  int64_t last_block_id_ = 0, number_ = 0;
  int64_t starts_at_ticks_ = 0;  // what is stamped before it was on its way at the last stop; 0: all that was is gone
};

}  // namespace

std::unique_ptr<Camera> open_aravis_camera(const CameraConfiguration& configuration) {
  return std::make_unique<AravisCamera>(configuration);
}

}  // namespace selvedge::camera
