#include "hardware_sim/datastream_server/frame_packet.h"

#include <algorithm>
#include <cmath>

#include "rig/wire/bytes.h"

namespace selvedge::hardware_sim::datastream {
namespace {

using wire::LittleWriter;

void put_text(LittleWriter& out, const std::string& text) { out.number<std::uint32_t>(text.size()).text(text); }

void put_block(LittleWriter& out, std::uint32_t id, const LittleWriter& body) {
  out.number<std::uint32_t>(id).number<std::uint32_t>(body.size()).raw(body.bytes());
}

std::vector<std::uint8_t> packet(const LittleWriter& objects) {
  LittleWriter out;
  put_block(out, 0x1a2b0001, objects);
  return out.bytes();
}

LittleWriter subject_body(std::uint32_t id, const std::string& name, const std::vector<std::string>& markers) {
  LittleWriter body;
  body.number<std::uint32_t>(id);
  put_text(body, name);
  body.number<std::uint32_t>(1);  // one segment, the root
  body.number<std::uint32_t>(0).number<std::uint32_t>(1);
  for (int i = 0; i < 6; ++i) body.number<float>(0);
  put_text(body, "root");
  body.number<std::uint32_t>(markers.size());
  for (size_t i = 0; i < markers.size(); ++i) {
    body.number<std::uint32_t>(i + 1);
    put_text(body, markers[i]);
  }
  body.number<std::uint32_t>(markers.size());
  for (size_t i = 0; i < markers.size(); ++i) body.number<std::uint32_t>(i + 1).number<std::uint32_t>(1);
  return body;
}

void put_recon(LittleWriter& out, const Eigen::Vector3d& position_m, std::uint32_t trajectory) {
  out.number<double>(7);  // marker radius, mm
  for (int axis = 0; axis < 3; ++axis) out.number<double>(position_m[axis] * 1e3);
  for (int i = 0; i < 9; ++i) out.number<double>(i % 4 == 0 ? 0.04 : 0);  // covariance, mm²
  out.number<std::uint32_t>(trajectory);
}

}  // namespace

std::pair<std::uint32_t, std::uint32_t> Declared::ids(const std::string& subject, const std::string& name) {
  const auto s = std::find(subjects.begin(), subjects.end(), subject) - subjects.begin();
  if (s == static_cast<long>(subjects.size())) {
    subjects.push_back(subject);
    markers.emplace_back();
  }
  auto& names = markers[static_cast<size_t>(s)];
  const auto m = std::find(names.begin(), names.end(), name) - names.begin();
  if (m == static_cast<long>(names.size())) {
    names.push_back(name);
    ++generation;
  }
  return {static_cast<std::uint32_t>(s + 1), static_cast<std::uint32_t>(m + 1)};
}

std::vector<std::uint8_t> supported_packet() {
  const std::vector<std::uint32_t> ids{1, 2, 5, 6, 7, 26, 36, 42, 100001, 100002, 100004};
  LittleWriter body, objects;
  body.number<std::uint32_t>(ids.size());
  for (const auto id : ids) body.number<std::uint32_t>(id);
  put_block(objects, 100001, body);
  return packet(objects);
}

std::vector<std::uint8_t> frame_packet(const Frame& frame, Declared& declared, bool with_static) {
  LittleWriter labelled_list, unlabelled_list;
  std::uint32_t labelled_count = 0, unlabelled_count = 0;
  for (const auto& point : frame.seen) {
    if (point.name.empty()) {
      put_recon(unlabelled_list, point.position_m, 1000 + unlabelled_count++);
      continue;
    }
    const auto [subject, marker] = declared.ids(point.subject, point.name);
    labelled_list.number<std::uint32_t>(subject).number<std::uint32_t>(marker);
    put_recon(labelled_list, point.position_m, ++labelled_count);
  }
  std::map<std::uint32_t, std::uint32_t> present{{5, 1}, {6, 1}, {7, 1}, {26, 1}, {36, 1}};
  LittleWriter statics;
  if (with_static) {
    LittleWriter info;
    info.number<std::int64_t>(std::llround(135e6 / frame.rate_hz));
    put_block(statics, 1, info);
    for (size_t s = 0; s < declared.subjects.size(); ++s)
      put_block(statics, 2, subject_body(static_cast<std::uint32_t>(s + 1), declared.subjects[s], declared.markers[s]));
    present[1] = 1;
    present[2] = static_cast<std::uint32_t>(declared.subjects.size());
  }
  LittleWriter contents;
  contents.number<std::uint32_t>(present.size());
  for (const auto& [id, count] : present) contents.number<std::uint32_t>(id).number<std::uint32_t>(count);
  contents.number<std::uint32_t>(with_static ? 0 : 2);  // ids that the client keeps from before
  if (!with_static) contents.number<std::uint32_t>(1).number<std::uint32_t>(2);

  LittleWriter number, labelled, unlabelled, latency, objects;
  number.number<std::uint32_t>(frame.number);
  labelled.number<std::uint32_t>(labelled_count).raw(labelled_list.bytes());
  unlabelled.number<std::uint32_t>(unlabelled_count).raw(unlabelled_list.bytes());
  latency.number<std::uint32_t>(2);
  put_text(latency, "Camera Exposure");
  latency.number<double>(0.2 * frame.latency_s);
  put_text(latency, "Data Processing");
  latency.number<double>(0.8 * frame.latency_s);

  put_block(objects, 100004, contents);
  objects.raw(statics.bytes());
  put_block(objects, 5, number);
  put_block(objects, 36, number);
  put_block(objects, 6, labelled);
  put_block(objects, 7, unlabelled);
  put_block(objects, 26, latency);
  return packet(objects);
}

std::vector<std::uint8_t> ping_packet(std::uint64_t id) {
  LittleWriter body, objects;
  body.number<std::uint64_t>(id);
  put_block(objects, 42, body);
  return packet(objects);
}

}  // namespace selvedge::hardware_sim::datastream
