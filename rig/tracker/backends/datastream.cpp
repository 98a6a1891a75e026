// Vicon DataStream over TCP as a corner tracker: the client's side of the handshake, and frames pushed by the
// server. The capture time is the arrival less the latency that the system states.
#include <algorithm>
#include <array>

#include "rig/clock.h"
#include "rig/tracker/backends/datastream_packets.h"
#include "rig/wire/socket.h"

namespace selvedge::tracker {
namespace {

using namespace datastream;

constexpr int kDatastreamPort = 801;

void put_object(wire::LittleWriter& objects, std::uint32_t id, const wire::LittleWriter& body) {
  objects.number<std::uint32_t>(id).number<std::uint32_t>(body.size()).raw(body.bytes());
}

class DataStream final : public Tracker {
 public:
  explicit DataStream(const TrackerOptions& options)
      : socket_(wire::connect_tcp(options.host, options.port == 0 ? kDatastreamPort : options.port, options.connect_timeout_s)) {}

  std::optional<TrackerFrame> next(double timeout_s) override {
    const double end_s = rig::host_now_s() + timeout_s;
    for (;;) {
      while (const auto body = whole_packet()) {
        auto packet = decoder_.decode(*body);
        received_.erase(received_.begin(), received_.begin() + static_cast<long>(header_bytes + body->size()));
        if (packet.supported) ask_for_frames(*packet.supported);
        if (!packet.frame) continue;
        packet.frame->arrival_s = arrival_s_;
        packet.frame->capture_s = arrival_s_ - packet.frame->latency_s;
        return packet.frame;
      }
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
    for (const auto id : {stream_info, subject_info, frame_info, labelled_recons, unlabelled_recons, latency_info, contents})
      if (supported.contains(id)) wanted.push_back(id);
    wire::LittleWriter enums, request, objects, packet;
    enums.number<std::uint32_t>(wanted.size());
    for (const auto id : wanted) enums.number<std::uint32_t>(id);
    request.number<std::uint8_t>(1);
    put_object(objects, object_enums, enums);
    put_object(objects, request_frame, request);
    put_object(packet, packet_id, objects);
    socket_.send(packet.bytes());
  }

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
