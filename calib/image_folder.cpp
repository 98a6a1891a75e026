#include "calib/image_folder.h"

#include <map>

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>

#include "files/bad_input.h"
#include "files/csv_table.h"
#include "files/whole_file.h"

namespace selvedge::calib {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using Kind = PatternStep::Kind;

const std::map<Kind, std::string>& kind_names() {
  static const std::map<Kind, std::string> names{
      {Kind::off, "off"}, {Kind::solid, "solid"}, {Kind::gray_code, "gray_code"}, {Kind::phase_shift, "phase_shift"}};
  return names;
}

// Empty where the bytes are none. OpenCV throws over sizes that it does not take.
cv::Mat decoded_image(const std::string& bytes) {
  if (bytes.empty()) return {};
  try {
    return cv::imdecode(cv::Mat(1, static_cast<int>(bytes.size()), CV_8U, const_cast<char*>(bytes.data())),
                        cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception&) { return {}; }
}

GreyImage read_image(const fs::path& path, const ImageSize& size) {
  const std::string bytes = files::read_whole(path);
  const cv::Mat decoded = decoded_image(bytes);
  if (decoded.empty()) refuse(path.string(), "expected an image, found {} bytes that are none", bytes.size());
  if (decoded.type() != CV_8UC1) refuse(path.string(), "expected an 8-bit grey image, found another depth or colours");
  if (decoded.cols != size.width_px || decoded.rows != size.height_px)
    refuse(path.string(), "expected {} x {} px as the camera's, found {} x {}", size.width_px, size.height_px,
           decoded.cols, decoded.rows);
  GreyImage image(decoded.rows, decoded.cols);
  for (int row = 0; row < decoded.rows; ++row) std::copy_n(decoded.ptr(row), decoded.cols, image.row(row).data());
  return image;
}

void write_image(const GreyImage& image, const fs::path& path) {
  std::vector<unsigned char> bytes;
  const cv::Mat pixels(static_cast<int>(image.rows()), static_cast<int>(image.cols()), CV_8U,
                       const_cast<unsigned char*>(image.data()));
  cv::imencode(".png", pixels, bytes, {cv::IMWRITE_PNG_COMPRESSION, 1});
  files::write_whole(path, std::string(bytes.begin(), bytes.end()));
}

const json& member(const json& object, const std::string& key, const std::string& where) {
  if (!object.is_object() || !object.contains(key)) refuse(where, "key \"{}\" is missing", key);
  return object.at(key);
}

std::string file_name(const json& value, const std::string& where) {
  if (!value.is_string() || value.get<std::string>().empty())
    refuse(where, "expected a file name, found {}", value.dump());
  return value.get<std::string>();
}

double number_or(const json& step, const char* key, double otherwise, const std::string& where) {
  if (!step.contains(key)) return otherwise;
  if (!step[key].is_number()) refuse(where + "." + key, "expected a number, found {}", step[key].dump());
  return step[key].get<double>();
}

PatternStep step_from_json(const json& value, const std::string& where) {
  PatternStep step;
  const json& kind = member(value, "kind", where);
  bool known = false;
  for (const auto& [candidate, name] : kind_names())
    if (kind == name) {
      step.kind = candidate;
      known = true;
    }
  if (!known) refuse(where + ".kind", "expected off, solid, gray_code or phase_shift, found {}", kind.dump());
  if (step.kind == Kind::gray_code || step.kind == Kind::phase_shift) {
    const json& orientation = member(value, "orientation", where);
    if (orientation != "horizontal" && orientation != "vertical")
      refuse(where + ".orientation", "expected horizontal or vertical, found {}", orientation.dump());
    step.horizontal = orientation == "horizontal";
  }
  step.level = number_or(value, "level", 1, where);
  if (step.kind == Kind::gray_code) {
    const double bit = number_or(value, "bit", -1, where);
    if (bit < 0 || bit > 20 || bit != static_cast<int>(bit))
      refuse(where + ".bit", "expected a whole number from 0 to 20, found {}", bit);
    step.bit = static_cast<int>(bit);
    if (value.contains("inverted") && !value["inverted"].is_boolean())
      refuse(where + ".inverted", "expected true or false, found {}", value["inverted"].dump());
    step.inverted = value.value("inverted", false);
  }
  if (step.kind == Kind::phase_shift) {
    step.period_px = number_or(value, "period_px", 0, where);
    if (!(step.period_px >= 2)) refuse(where + ".period_px", "expected 2 or more, found {}", step.period_px);
    step.first_px = number_or(value, "first_px", 0, where);
    member(value, "phase_rad", where);
    step.phase_rad = number_or(value, "phase_rad", 0, where);
  }
  return step;
}

json step_to_json(const PatternStep& step, const std::string& file) {
  json value{{"file", file}, {"kind", kind_names().at(step.kind)}, {"level", step.level}};
  if (step.kind == Kind::gray_code || step.kind == Kind::phase_shift)
    value["orientation"] = step.horizontal ? "horizontal" : "vertical";
  if (step.kind == Kind::gray_code) {
    value["bit"] = step.bit;
    value["inverted"] = step.inverted;
  }
  if (step.kind == Kind::phase_shift) {
    value["period_px"] = step.period_px;
    value["first_px"] = step.first_px;
    value["phase_rad"] = step.phase_rad;
  }
  return value;
}

std::string pose_folder(int pose) { return "pose-" + std::to_string(pose); }
std::string step_file(size_t index) { return fmt::format("{:03d}.png", index); }

}  // namespace

ImageFolder read_image_folder(const fs::path& folder) {
  ImageFolder result;
  const fs::path header_path = folder / "poses.json";
  result.header = read_poses_header(header_path);
  const json header = files::read_json(header_path);
  const std::string where = header_path.string() + ": images";
  const json& images = member(header, "images", header_path.string());
  const std::string marker_file = file_name(member(images, "markers", where), where + ".markers");
  std::vector<std::pair<std::string, PatternStep>> steps;
  const json& sequence = member(images, "sequence", where);
  if (!sequence.is_array()) refuse(where + ".sequence", "expected a list, found {}", sequence.dump());
  for (size_t i = 0; i < sequence.size(); ++i) {
    const std::string step_where = fmt::format("{}.sequence[{}]", where, i);
    steps.emplace_back(file_name(member(sequence[i], "file", step_where), step_where + ".file"),
                       step_from_json(sequence[i], step_where));
  }
  const files::CsvTable tracker = files::read_csv(folder / "tracker.csv", {{"pose"}, {"marker"}, {"x"}, {"y"}, {"z"}});
  std::map<int, PoseImages> by_pose;
  for (size_t i = 0; i < tracker.rows(); ++i) {
    PoseImages& pose = by_pose[files::whole_number(tracker, i, 0, "pose")];
    const int marker = files::whole_number(tracker, i, 1, "marker");
    for (const TrackedMarker& other : pose.markers)
      if (other.marker == marker)
        refuse(tracker.where(i), "marker {} stands in this pose for the second time, expected once", marker);
    pose.markers.push_back({marker, Eigen::Vector3d(tracker(i, 2), tracker(i, 3), tracker(i, 4))});
  }
  if (by_pose.empty()) refuse(tracker.path.string(), "expected at least one row below the header, found none");
  for (auto& [number, pose] : by_pose) {
    pose.pose = number;
    const fs::path at = folder / pose_folder(number);
    pose.marker_image = read_image(at / marker_file, result.header.camera);
    for (const auto& [file, step] : steps) pose.sequence.push_back({step, read_image(at / file, result.header.camera)});
    result.poses.push_back(std::move(pose));
  }
  return result;
}

void write_image_folder(const ImageFolder& images, const fs::path& folder) {
  json header = header_to_json(images.header);
  json sequence = json::array();
  std::string tracker = "pose,marker,x,y,z\n";
  for (const PoseImages& pose : images.poses) {
    const fs::path at = folder / pose_folder(pose.pose);
    fs::create_directories(at);
    write_image(pose.marker_image, at / "markers.png");
    for (size_t i = 0; i < pose.sequence.size(); ++i) write_image(pose.sequence[i].image, at / step_file(i));
    for (const TrackedMarker& marker : pose.markers)
      tracker += fmt::format("{},{},{},{},{}\n", pose.pose, marker.marker, marker.position.x(), marker.position.y(),
                             marker.position.z());
  }
  if (!images.poses.empty())
    for (size_t i = 0; i < images.poses.front().sequence.size(); ++i)
      sequence.push_back(step_to_json(images.poses.front().sequence[i].step, step_file(i)));
  header["images"] = {{"markers", "markers.png"}, {"sequence", sequence}};
  files::write_whole(folder / "tracker.csv", tracker);
  files::write_json(folder / "poses.json", header);
}

}  // namespace selvedge::calib
