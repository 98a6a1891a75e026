// Vicon DataStream over TCP as a corner tracker: the client's side of the handshake, and frames pushed by the
// server. The capture time is the arrival less the latency that the system states. The way from there to here is half
// of the shortest echo of the last minute, where the server echoes pings; how an echo splits into its two ways is
// unknown, so half of it may be all or nothing.
#include <algorithm>
#include <array>
#include <cmath>
#include <deque>

#include "rig/clock.h"
#include "rig/tracker/backends/datastream_packets.h"
#include "rig/wire/socket.h"

namespace selvedge::tracker {
namespace {

using namespace datastream;

constexpr int kDatastreamPort = 801;
constexpr double kPing_s = 0.25, kPingsKept_s = 60;
constexpr double kWakeUp_s = 4e-5, kWakeUpSd_s = 3e-5;  // of this process by a frame; an echo mostly finds it awake

void put_object(wire::LittleWriter& objects, std::uint32_t id, const wire::LittleWriter& body) {
  objects.number<std::uint32_t>(id).number<std::uint32_t>(body.size()).raw(body.bytes());
}

class DataStream final : public Tracker {
 public:
  explicit DataStream(const TrackerOptions& options)
      : socket_(wire::connect_tcp(options.host, options.port == 0 ? kDatastreamPort : options.port,
                                  options.connect_timeout_s)) {}

  std::optional<TrackerFrame> next(double timeout_s) override {
    const double end_s = rig::host_now_s() + timeout_s;
    for (;;) {
      while (const auto body = whole_packet()) {
        auto packet = decoder_.decode(*body);
        received_.erase(received_.begin(), received_.begin() + static_cast<long>(header_bytes + body->size()));
        if (packet.supported) ask_for_frames(*packet.supported);
        if (packet.ping) note_echo(*packet.ping);
        if (!packet.frame) continue;
        packet.frame->arrival_s = arrival_s_;
        packet.frame->capture_s = arrival_s_ - packet.frame->latency_s;
        if (!echoes_.empty()) {
          packet.frame->network_s = 0.5 * shortest_echo_s_ + kWakeUp_s;
          packet.frame->capture_sd_s = std::hypot(0.5 * shortest_echo_s_ / std::sqrt(3.0), kWakeUpSd_s);
        }
        return packet.frame;
      }
      send_ping();
      const double left_s = end_s - rig::host_now_s();
      if (left_s <= 0 || !socket_.readable(left_s)) return std::nullopt;
      std::array<std::uint8_t, 65536> part;
      const size_t got = socket_.receive(part);
      arrival_s_ = rig::host_now_s();
      received_.insert(received_.end(), part.begin(), part.begin() + static_cast<long>(got));
    }
  }

  std::int64_t refused() const override { return 0; }  // on a byte stream one bad packet ends the connection

 private:
  std::optional<std::span<const std::uint8_t>> whole_packet() const {
    if (received_.size() < header_bytes) return std::nullopt;
    const size_t length = packet_length(std::span(received_).first(header_bytes));
    if (received_.size() < header_bytes + length) return std::nullopt;
    return std::span(received_).subspan(header_bytes, length);
  }

  // Wanted ids that the server supports, then RequestFrame{true}: the server pushes every frame from now on.
  void ask_for_frames(const std::set<std::uint32_t>& supported) {
    for (const auto needed : {frame_info, labelled_recons, subject_info})
      if (!supported.contains(needed))
        throw wire::WireError(fmt::format("the server does not offer object {}", needed));
    std::vector<std::uint32_t> wanted;
    for (const auto id :
         {stream_info, subject_info, frame_info, labelled_recons, unlabelled_recons, latency_info, ping, contents})
      if (supported.contains(id)) wanted.push_back(id);
    echoes_pings_ = supported.contains(ping);
    wire::LittleWriter enums, request, objects, packet;
    enums.number<std::uint32_t>(wanted.size());
    for (const auto id : wanted) enums.number<std::uint32_t>(id);
    request.number<std::uint8_t>(1);
    put_object(objects, object_enums, enums);
    put_object(objects, request_frame, request);
    put_object(packet, packet_id, objects);
    socket_.send(packet.bytes());
  }

  // Its number is the time at which it was sent.
  void send_ping() {
    const double now_s = rig::host_now_s();
    if (!echoes_pings_ || now_s - pinged_s_ < kPing_s) return;
    pinged_s_ = now_s;
    wire::LittleWriter number, objects, packet;
    number.number<std::uint64_t>(static_cast<std::uint64_t>(rig::host_now_us()));
    put_object(objects, ping, number);
    put_object(packet, packet_id, objects);
    socket_.send(packet.bytes());
  }

  void note_echo(std::uint64_t sent_us) {
    const double way_s = arrival_s_ - 1e-6 * static_cast<double>(sent_us);
    if (!(way_s > 0 && way_s < kPingsKept_s)) return;  // of nothing that was asked here
    echoes_.push_back({arrival_s_, way_s});
    while (echoes_.front().arrival_s < arrival_s_ - kPingsKept_s) echoes_.pop_front();
    shortest_echo_s_ = std::ranges::min(echoes_, {}, &Echo::way_s).way_s;
  }

  struct Echo {
    double arrival_s, way_s;  // there and back
  };
  bool echoes_pings_ = false;
  double pinged_s_ = 0, shortest_echo_s_ = 0;
  std::deque<Echo> echoes_;
  wire::Socket socket_;
  Decoder decoder_;
  std::vector<std::uint8_t> received_;
  double arrival_s_ = 0;
};

}  // namespace

std::unique_ptr<Tracker> connect_datastream(const TrackerOptions& options) {
  return std::make_unique<DataStream>(options);
}

}  // namespace selvedge::tracker
