#include "station/exchange/mcap_export.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include <Eigen/Geometry>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "files/bad_input.h"
#include "files/part_file.h"
#include "files/whole_file.h"
#include "report/base64.h"
#include "station/exchange/mcap_file.h"
#include "station/exchange/mcap_types.h"

namespace selvedge::station {

namespace {

namespace fs = std::filesystem;
using Eigen::Index;
using nlohmann::json;

constexpr const char* kFrame = "mocap";

struct Event {
  double time_s = 0;
  uint16_t channel = 0;
  std::function<json(const json& stamp)> said;
};

json xyz(const Eigen::Vector3d& v) { return {{"x", v.x()}, {"y", v.y()}, {"z", v.z()}}; }
json xyzw(const Eigen::Quaterniond& q) { return {{"x", q.x()}, {"y", q.y()}, {"z", q.z()}, {"w", q.w()}}; }
json pose_at(const Eigen::Vector3d& v) {
  return {{"position", xyz(v)}, {"orientation", xyzw(Eigen::Quaterniond::Identity())}};
}

// A point each, with its number where there are any.
json cloud(const json& stamp, const Eigen::Matrix3Xd& points, const std::vector<int>& numbers = {}) {
  constexpr int kUint32 = 5, kFloat32 = 7;  // foxglove.NumericType
  constexpr size_t kBytes = 4;
  std::string data;
  for (Index i = 0; i < points.cols(); ++i) {
    const Eigen::Vector3f x = points.col(i).cast<float>();
    data.append(reinterpret_cast<const char*>(x.data()), 3 * kBytes);
    if (!numbers.empty()) data.append(reinterpret_cast<const char*>(&numbers[static_cast<size_t>(i)]), kBytes);
  }
  json fields;
  for (const char* axis : {"x", "y", "z"})
    fields.push_back({{"name", axis}, {"offset", kBytes * fields.size()}, {"type", kFloat32}});
  if (!numbers.empty()) fields.push_back({{"name", "marker"}, {"offset", 3 * kBytes}, {"type", kUint32}});
  return {{"timestamp", stamp},
          {"frame_id", kFrame},
          {"pose", pose_at(Eigen::Vector3d::Zero())},
          {"point_stride", kBytes * fields.size()},
          {"fields", fields},
          {"data", report::base64(data)}};
}

json fabric(const json& stamp, const SimulatedMotion& motion, size_t at) {
  json points = json::array(), indices = json::array();
  const Eigen::Matrix3Xf& x = motion.position[at];
  const auto rounded = [](float m) { return std::round(1e5 * static_cast<double>(m)) / 1e5; };
  for (Index i = 0; i < x.cols(); ++i)
    points.push_back({{"x", rounded(x(0, i))}, {"y", rounded(x(1, i))}, {"z", rounded(x(2, i))}});
  for (const auto& triangle : motion.triangles)
    for (const int corner : triangle) indices.push_back(corner);
  const json color = {{"r", 0.3}, {"g", 0.5}, {"b", 0.8}, {"a", 0.9}},
             triangles = {{"pose", pose_at(Eigen::Vector3d::Zero())},
                          {"points", points},
                          {"color", color},
                          {"colors", json::array()},
                          {"indices", indices}};
  json entity = {{"timestamp", stamp},
                 {"frame_id", kFrame},
                 {"id", "fabric"},
                 {"lifetime", {{"sec", 0}, {"nsec", 0}}},
                 {"frame_locked", true},
                 {"metadata", json::array()},
                 {"triangles", json::array({triangles})}};
  for (const char* other : {"arrows", "cubes", "spheres", "cylinders", "lines", "texts", "models"})
    entity[other] = json::array();
  return {{"deletions", json::array()}, {"entities", json::array({entity})}};
}

json calibration(const json& stamp, const geometry::Projection& camera, const geometry::Decomposition& parts) {
  const auto row_major = [](const auto& matrix) {
    json out;
    for (Index r = 0; r < matrix.rows(); ++r)
      for (Index c = 0; c < matrix.cols(); ++c) out.push_back(matrix(r, c));
    return out;
  };
  Eigen::Matrix<double, 3, 4> projection = Eigen::Matrix<double, 3, 4>::Zero();
  projection.leftCols<3>() = parts.intrinsics;
  return {{"timestamp", stamp},
          {"frame_id", "camera"},
          {"width", camera.width_px},
          {"height", camera.height_px},
          {"distortion_model", "plumb_bob"},
          {"D", camera.distortion},
          {"K", row_major(parts.intrinsics)},
          {"R", row_major(Eigen::Matrix3d(Eigen::Matrix3d::Identity()))},
          {"P", row_major(projection)}};
}

// Where each run of samples of one time begins, and the end.
std::vector<size_t> moments_of(const std::vector<double>& time_s) {
  std::vector<size_t> out;
  for (size_t i = 0; i < time_s.size(); ++i)
    if (i == 0 || time_s[i] != time_s[i - 1]) out.push_back(i);
  out.push_back(time_s.size());
  return out;
}

// All that a trial has to say, in no order.
class Events {
 public:
  Events(McapFile& file, const trial::Trial& trial) : file_(file), trial_(trial) {}

  std::vector<Event> all(const std::optional<SimulatedMotion>& simulated) {
    add_corners();
    if (trial_.markers)
      add_clouds("/markers", trial_.markers->time_s, trial_.markers->position, trial_.markers->marker);
    if (trial_.surface) add_clouds("/surface", trial_.surface->time_s, trial_.surface->position, {});
    if (trial_.frames && !trial_.frames->time_s.empty()) add_images();
    if (trial_.robot) {
      add_points("/arm/measured", trial_.robot->measured);
      add_points("/arm/commanded", trial_.robot->commanded);
    }
    if (simulated) add_fabric(*simulated);
    if (trial_.camera) add_camera();
    return std::move(events_);
  }

 private:
  uint16_t channel(const std::string& topic, const McapType& type) {
    return file_.channel(topic, type.name, type.schema);
  }

  void add_corners() {
    const uint16_t to = channel("/corners", point_cloud_type());
    const trial::Corners& c = trial_.corners;
    for (size_t i = 0; i < c.time_s.size(); ++i)
      events_.push_back({c.time_s[i], to, [&c, i](const json& stamp) {
                           Eigen::Matrix3Xd seen(3, 0);
                           for (const Eigen::Matrix3Xd* side : {&c.left, &c.right}) {
                             const Eigen::Vector3d x = side->col(static_cast<Index>(i));
                             if (!x.allFinite()) continue;
                             seen.conservativeResize(Eigen::NoChange, seen.cols() + 1);
                             seen.rightCols<1>() = x;
                           }
                           return cloud(stamp, seen);
                         }});
  }

  void add_clouds(const char* topic, const std::vector<double>& time_s, const Eigen::Matrix3Xd& position,
                  const std::vector<int>& numbers) {
    const uint16_t to = channel(topic, point_cloud_type());
    const std::vector<size_t> begins = moments_of(time_s);
    for (size_t k = 0; k + 1 < begins.size(); ++k) {
      const size_t first = begins[k], count = begins[k + 1] - first;
      events_.push_back({time_s[first], to, [&position, &numbers, first, count](const json& stamp) {
                           const auto at = numbers.begin() + static_cast<std::ptrdiff_t>(numbers.empty() ? 0 : first);
                           const size_t numbered = numbers.empty() ? 0 : count;
                           return cloud(stamp,
                                        position.middleCols(static_cast<Index>(first), static_cast<Index>(count)),
                                        {at, at + static_cast<std::ptrdiff_t>(numbered)});
                         }});
    }
  }

  void add_images() {
    const uint16_t to = channel("/camera/image", compressed_image_type());
    const trial::Frames& frames = *trial_.frames;
    for (size_t i = 0; i < frames.time_s.size(); ++i)
      events_.push_back({frames.time_s[i], to, [&frames, i](const json& stamp) {
                           return json{{"timestamp", stamp},
                                       {"frame_id", "camera"},
                                       {"data", report::base64(files::read_whole(frames.path[i]))},
                                       {"format", "png"}};
                         }});
  }

  void add_points(const char* topic, const Eigen::Matrix3Xd& position) {
    const uint16_t to = channel(topic, pose_type());
    for (size_t i = 0; i < trial_.robot->time_s.size(); ++i)
      events_.push_back({trial_.robot->time_s[i], to,
                         [&position, i](const json& stamp) {
        return json{{"timestamp", stamp}, {"frame_id", kFrame}, {"pose", pose_at(position.col(static_cast<Index>(i)))}};
                         }});
  }

  void add_fabric(const SimulatedMotion& motion) {
    const uint16_t to = channel("/fabric/simulated", scene_update_type());
    for (size_t i = 0; i < motion.time_s.size(); ++i)
      events_.push_back({motion.time_s[i], to, [&motion, i](const json& stamp) { return fabric(stamp, motion, i); }});
  }

  void add_camera() {
    const auto first = std::min_element(events_.begin(), events_.end(),
                                        [](const Event& a, const Event& b) { return a.time_s < b.time_s; });
    const double time_s = first == events_.end() ? 0 : first->time_s;
    const geometry::Decomposition parts = geometry::decompose(*trial_.camera);
    const auto matrices = channel("/camera/calibration", camera_calibration_type());
    const auto place = channel("/tf", frame_transform_type());
    events_.push_back({time_s, matrices, [camera = *trial_.camera, parts](const json& stamp) {
                         return calibration(stamp, camera, parts);
                       }});
    events_.push_back({time_s, place, [at = geometry::centre(*trial_.camera), parts](const json& stamp) {
                         const Eigen::Quaterniond turned(Eigen::Matrix3d(parts.rotation_camera_from_world.transpose()));
                         return json{{"timestamp", stamp},
                                     {"parent_frame_id", kFrame},
                                     {"child_frame_id", "camera"},
                                     {"translation", xyz(at)},
                                     {"rotation", xyzw(turned)}};
                       }});
  }

  McapFile& file_;
  const trial::Trial& trial_;
  std::vector<Event> events_;
};

McapExported write_events(const trial::Trial& trial, const std::optional<SimulatedMotion>& simulated,
                          const fs::path& path) {
  McapFile file(path, "selvedge");
  std::vector<Event> events = Events(file, trial).all(simulated);
  std::stable_sort(events.begin(), events.end(), [](const Event& a, const Event& b) { return a.time_s < b.time_s; });
  const double first_s = events.empty() ? 0 : events.front().time_s, origin_s = std::min(0.0, first_s);
  constexpr double kMost_s = 4294967296.0;  // a stamp's seconds are 32 bits
  if (!events.empty() && !(events.back().time_s - origin_s < kMost_s))
    refuse(trial.folder.string(), "found a sample at {:g} s, expected less than {:g} s for MCAP", events.back().time_s,
           kMost_s);
  file.metadata("selvedge", {{"trial", trial.name},
                             {"fabric", trial.fabric.name},
                             {"first_s", fmt::format("{:.9f}", first_s)},
                             {"simulated", simulated ? "yes" : "no"}});
  for (const Event& e : events) {
    constexpr uint64_t kSecond_ns = 1'000'000'000;
    const auto ns = static_cast<uint64_t>(std::llround(1e9 * (e.time_s - origin_s)));
    file.message(e.channel, ns, e.said({{"sec", ns / kSecond_ns}, {"nsec", ns % kSecond_ns}}).dump());
  }
  return {file.finish(), events.empty() ? 0 : events.back().time_s - first_s};
}

}  // namespace

McapExported export_mcap(const trial::Trial& trial, const std::optional<SimulatedMotion>& simulated,
                         const fs::path& path) {
  McapExported out;
  files::write_in_part(path, [&](const fs::path& part) { out = write_events(trial, simulated, part); });
  return out;
}

}  // namespace selvedge::station
