// OptiTrack NatNet over UDP as a corner tracker: unicast to the command socket, or the multicast group that the server
// announces. Capture times are the server's mid-exposure ticks, mapped by echoes that bracket the server's clock.
#include <cmath>

#include "rig/clock.h"
#include "rig/tracker/backends/natnet_packets.h"
#include "rig/wire/socket.h"

namespace selvedge::tracker {
namespace {

using namespace natnet;

constexpr int kNatnetPort = 1510;
constexpr double kKeepAlive_s = 1, kEcho_s = 0.2, kModelRetry_s = 0.5;
constexpr double kSilence_s = 3;  // UDP has no end of a connection; echoes unanswered for so long are one

class NatNet final : public Tracker {
 public:
  explicit NatNet(const TrackerOptions& options)
      : options_(options), commands_(wire::connect_udp(options.host, options.port == 0 ? kNatnetPort : options.port)) {
    const double end_s = rig::host_now_s() + options.connect_timeout_s;
    while (!server_) {
      if (rig::host_now_s() > end_s)
        throw wire::Disconnected(
            fmt::format("natnet: {} does not answer within {} s", options.host, options.connect_timeout_s));
      commands_.send(encode(natnet::connect, connect_payload()));
      if (commands_.readable(0.1)) receive(commands_);
    }
    heard_s_ = rig::host_now_s();
    if (server_->multicast) data_ = wire::join_multicast(server_->group, server_->data_port);
    clock_ = rig::PassiveClock({.ticks_per_s = server_->ticks_per_s});
    commands_.send(encode(natnet::request, wire::LittleWriter().text("FrameRate").number<std::uint8_t>(0)));
  }

  std::optional<TrackerFrame> next(double timeout_s) override {
    const double end_s = rig::host_now_s() + timeout_s;
    for (;;) {
      talk();
      const double left_s = std::min(0.05, end_s - rig::host_now_s());
      const wire::Socket* ready = readable(std::max(0.0, left_s));
      if (ready != nullptr) {
        if (auto frame = receive(*ready)) return frame;
      } else if (left_s <= 0) {
        return std::nullopt;
      }
      if (rig::host_now_s() - heard_s_ > kSilence_s)
        throw wire::Disconnected(fmt::format("natnet: nothing from the server for {} s", kSilence_s));
    }
  }

  std::int64_t refused() const override { return refused_; }

 private:
  const wire::Socket* readable(double timeout_s) const {
    if (data_.is_open() && data_.readable(0)) return &data_;
    if (commands_.readable(data_.is_open() ? std::min(timeout_s, 0.002) : timeout_s)) return &commands_;
    return data_.is_open() && data_.readable(0) ? &data_ : nullptr;
  }

  // What has to be said from time to time.
  void talk() {
    const double now_s = rig::host_now_s();
    if (now_s - kept_alive_s_ > kKeepAlive_s) {
      commands_.send(encode(keep_alive, {}));
      kept_alive_s_ = now_s;
    }
    if (now_s - echoed_s_ > kEcho_s) {
      echoed_s_ = now_s;
      commands_.send(encode(
          echo_request, wire::LittleWriter().number<std::uint64_t>(static_cast<std::uint64_t>(rig::host_now_us()))));
    }
    if (!model_ && now_s - model_asked_s_ > kModelRetry_s) {
      commands_.send(encode(request_model, {}));
      model_asked_s_ = now_s;
    }
  }

  // One datagram; the frame where it holds one. A damaged datagram is dropped and counted: over UDP anybody can send
  // one.
  std::optional<TrackerFrame> receive(const wire::Socket& socket) {
    const auto datagram = wire::receive_datagram(socket);
    const std::int64_t arrival_us = rig::host_now_us();
    try {
      const Message message = take_message(datagram.bytes);
      heard_s_ = 1e-6 * static_cast<double>(arrival_us);
      return handle(message, arrival_us);
    } catch (const wire::WireError&) {
      ++refused_;
      return std::nullopt;
    }
  }

  std::optional<TrackerFrame> handle(const Message& message, std::int64_t arrival_us) {
    wire::LittleReader reader(message.payload);
    if (message.id == server_info && !server_) {
      server_ = decode_server_info(message.payload);
    } else if (message.id == response && message.payload.size() == 4) {
      const double rate_hz = static_cast<double>(reader.number<float>());
      if (rate_hz > 1 && rate_hz < 10000) rate_hz_ = rate_hz;
    } else if (message.id == model_definition && server_) {
      model_ = decode_model(message.payload, *server_);
    } else if (message.id == echo_response) {
      const auto sent_us = static_cast<std::int64_t>(reader.number<std::uint64_t>());
      const auto ticks = static_cast<std::int64_t>(reader.number<std::uint64_t>());
      // An answer to something we never asked, or asked long ago, brackets nothing.
      if (sent_us <= arrival_us && arrival_us - sent_us < 1000000) clock_.add_bracket(ticks, sent_us, arrival_us);
    } else if (message.id == frame_of_data && server_ && model_) {
      return to_tracker_frame(decode_frame(message.payload, *server_, *model_), arrival_us);
    }
    return std::nullopt;
  }

  std::optional<TrackerFrame> to_tracker_frame(const Frame& frame, std::int64_t arrival_us) {
    if (frame.model_changed) model_asked_s_ = 0, model_stale_ = true;
    if (model_stale_ && rig::host_now_s() - model_asked_s_ > kModelRetry_s) {
      commands_.send(encode(request_model, {}));
      model_asked_s_ = rig::host_now_s();
      model_stale_ = false;
    }
    TrackerFrame result;
    result.frame_number = frame.number;
    result.arrival_s = 1e-6 * static_cast<double>(arrival_us);
    result.rate_hz = rate_hz_;
    const double latency_s =
        (static_cast<double>(frame.transmit_ticks) - static_cast<double>(frame.exposure_ticks)) / server_->ticks_per_s;
    if (!(latency_s >= 0 && latency_s < 10)) throw wire::WireError(fmt::format("natnet: a latency of {} s", latency_s));
    result.latency_s = latency_s;
    result.capture_s = result.arrival_s - latency_s;
    // A mapping can be wrong by half an echo's way; never later than the frame itself allows.
    if (clock_.map()) {
      result.capture_s =
          std::min(result.capture_s, clock_.map()->host_s(static_cast<std::int64_t>(frame.exposure_ticks)));
      result.capture_sd_s = clock_.map()->uncertainty_s;
    }
    result.markers = frame.markers;
    if (options_.y_up)
      for (auto& marker : result.markers)
        marker.position_m = Eigen::Vector3d(marker.position_m.x(), -marker.position_m.z(), marker.position_m.y());
    return result;
  }

  TrackerOptions options_;
  wire::Socket commands_, data_;
  std::optional<ServerInfo> server_;
  std::optional<Model> model_;
  rig::PassiveClock clock_;
  double rate_hz_ = 0;
  double kept_alive_s_ = 0, echoed_s_ = 0, model_asked_s_ = 0, heard_s_ = 0;
  bool model_stale_ = false;
  std::int64_t refused_ = 0;
};

}  // namespace

std::unique_ptr<Tracker> connect_natnet(const TrackerOptions& options) { return std::make_unique<NatNet>(options); }

}  // namespace selvedge::tracker
