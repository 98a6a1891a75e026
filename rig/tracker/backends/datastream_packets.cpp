#include "rig/tracker/backends/datastream_packets.h"

#include <cmath>

namespace selvedge::tracker::datastream {
namespace {

constexpr double stream_clock_hz = 135e6;  // StreamInfo's frame period counts these
constexpr size_t longest_name = 1024;

using wire::LittleReader;
using wire::WireError;

std::string read_name(LittleReader& body) {
  const auto length = body.count(1);
  if (length > longest_name) throw WireError(fmt::format("a name of {} bytes", length));
  return body.text(length);
}

Eigen::Vector3d read_position_m(LittleReader& body) {
  const double x = body.number<double>(), y = body.number<double>(), z = body.number<double>();
  return Eigen::Vector3d(x, y, z) * 1e-3;
}

// A position that cannot be a measurement: servers write zeros for what they did not see.
bool is_measurement(const Eigen::Vector3d& position_m) { return position_m.allFinite() && !position_m.isZero(0); }

void mark_seen(TrackedMarker& marker, const Eigen::Vector3d& position_m) {
  if (!is_measurement(position_m)) return;
  marker.position_m = position_m;
  marker.occluded = false;
}

using Seen = std::map<std::pair<std::uint32_t, std::uint32_t>, Eigen::Vector3d>;

void read_labelled(LittleReader body, Seen& seen) {
  const auto count = body.count(116);
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto subject = body.number<std::uint32_t>(), marker = body.number<std::uint32_t>();
    body.take(8);  // radius
    seen[{subject, marker}] = read_position_m(body);
    body.take(9 * 8 + 4);  // covariance, trajectory
  }
}

void read_unlabelled(LittleReader body, std::vector<TrackedMarker>& markers) {
  const auto count = body.count(108);
  for (std::uint32_t i = 0; i < count; ++i) {
    body.take(8);
    TrackedMarker marker;
    mark_seen(marker, read_position_m(body));
    body.take(9 * 8 + 4);
    if (!marker.occluded) markers.push_back(marker);
  }
}

double read_latency_s(LittleReader body) {
  double total_s = 0;
  const auto count = body.count(12);
  for (std::uint32_t i = 0; i < count; ++i) {
    read_name(body);
    total_s += body.number<double>();
  }
  // A latency that is negative, not finite or longer than any pipeline holds is no latency.
  if (!(total_s >= 0 && total_s < 10)) throw WireError(fmt::format("a latency of {} s", total_s));
  return total_s;
}

}  // namespace

size_t packet_length(std::span<const std::uint8_t> header) {
  LittleReader reader(header);
  const auto id = reader.number<std::uint32_t>(), length = reader.number<std::uint32_t>();
  if (id != packet_id) throw WireError(fmt::format("a packet begins with {:#x}, {:#x} expected", id, packet_id));
  if (length > largest_packet_bytes)
    throw WireError(fmt::format("a packet of {} bytes, at most {} expected", length, largest_packet_bytes));
  return length;
}

void Decoder::read_subject(LittleReader body, std::map<std::uint32_t, Subject>& subjects) const {
  const auto id = body.number<std::uint32_t>();
  Subject subject;
  subject.name = read_name(body);
  const auto segments = body.count(36);
  for (std::uint32_t i = 0; i < segments; ++i) {
    body.take(8 + 6 * 4);  // parent, segment, bounds
    read_name(body);
  }
  const auto markers = body.count(8);
  for (std::uint32_t i = 0; i < markers; ++i) {
    const auto marker = body.number<std::uint32_t>();
    subject.markers[marker] = read_name(body);
  }
  subjects[id] = std::move(subject);
}

Decoder::Packet Decoder::decode(std::span<const std::uint8_t> body) {
  Packet packet;
  TrackerFrame frame;
  Seen seen;
  std::map<std::uint32_t, Subject> new_subjects;
  bool has_frame = false;
  LittleReader objects(body);
  while (objects.left() > 0) {
    const auto id = objects.number<std::uint32_t>();
    LittleReader object = objects.part(objects.number<std::uint32_t>());
    if (id == object_enums) {
      packet.supported.emplace();
      const auto count = object.count(4);
      for (std::uint32_t i = 0; i < count; ++i) packet.supported->insert(object.number<std::uint32_t>());
    } else if (id == stream_info) {
      const auto period = object.number<std::int64_t>();
      if (period <= 0) throw WireError(fmt::format("a frame period of {} ticks", period));
      rate_hz_ = stream_clock_hz / static_cast<double>(period);
    } else if (id == subject_info) {
      read_subject(object, new_subjects);
    } else if (id == frame_info) {
      frame.frame_number = object.number<std::uint32_t>();
      has_frame = true;
    } else if (id == labelled_recons) {
      read_labelled(object, seen);
    } else if (id == unlabelled_recons) {
      read_unlabelled(object, frame.markers);
    } else if (id == latency_info) {
      frame.latency_s = read_latency_s(object);
    } else if (id == ping) {
      packet.ping = object.number<std::uint64_t>();
    }
  }
  // A packet that brings subjects brings all of them.
  if (!new_subjects.empty()) subjects_ = std::move(new_subjects);
  if (!has_frame) return packet;
  for (const auto& [subject_id, subject] : subjects_)
    for (const auto& [marker_id, name] : subject.markers) {
      TrackedMarker marker{.subject = subject.name, .name = name};
      if (const auto found = seen.find({subject_id, marker_id}); found != seen.end()) mark_seen(marker, found->second);
      frame.markers.push_back(std::move(marker));
    }
  frame.rate_hz = rate_hz_;
  packet.frame = std::move(frame);
  return packet;
}

}  // namespace selvedge::tracker::datastream
