#include "garment/bvh.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>

#include <fmt/ranges.h>

#include "files/bad_input.h"
#include "files/whole_file.h"
#include "geometry/cubic.h"

namespace selvedge::garment {

namespace {

constexpr double kPoseRunUp_s = 0.25;
constexpr int kDeepestJoint = 128;         // joints above one another
constexpr size_t kMostPoses = 10'000'000;  // joints times frames: over half a gigabyte in memory

// Words of the text with the line each stands in.
class Words {
 public:
  Words(std::string text, std::string where) : path_(std::move(where)), text_(std::move(text)) {}

  std::string where() const { return path_ + ":" + std::to_string(line_); }

  bool at_end() {
    skip();
    return at_ == text_.size();
  }

  std::string next(const char* expected) {
    if (at_end()) refuse(where(), "found the end of the file, expected {}", expected);
    const size_t start = at_;
    while (at_ < text_.size() && !is_space(text_[at_])) ++at_;
    return text_.substr(start, at_ - start);
  }

  void expect(const std::string& word) {
    const std::string found = next(("\"" + word + "\"").c_str());
    if (found != word) refuse(where(), "found {}, expected \"{}\"", in_quotes(found), word);
  }

  double number(const char* expected) {
    const std::string word = next(expected);
    double value = 0;
    const char* first = word.data() + (word.size() > 1 && word[0] == '+');
    const auto [end, error] = std::from_chars(first, word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size() || !std::isfinite(value))
      refuse(where(), "found {}, expected {}", in_quotes(word), expected);
    return value;
  }

  int whole(const char* expected, int most) {
    const double value = number(expected);
    if (value != std::floor(value) || value < 0 || value > most)
      refuse(where(), "found {}, expected {} up to {}", value, expected, most);
    return static_cast<int>(value);
  }

  // To end of the line: what is left on it.
  std::string rest_of_line() {
    const size_t end = std::min(text_.find('\n', at_), text_.size());
    std::string rest = text_.substr(at_, end - at_);
    at_ = end;
    while (!rest.empty() && is_space(rest.back())) rest.pop_back();
    rest.erase(0, std::min(rest.find_first_not_of(" \t"), rest.size()));
    return rest;
  }

 private:
  static bool is_space(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }
  void skip() {
    for (; at_ < text_.size() && is_space(text_[at_]); ++at_) line_ += text_[at_] == '\n';
  }

  std::string path_, text_;
  size_t at_ = 0;
  int line_ = 1;
};

Eigen::Vector3d read_offset(Words& words) {
  Eigen::Vector3d v;
  for (int a = 0; a < 3; ++a) v(a) = words.number("a number of the offset");
  return v;
}

int channel_of(const std::string& name, const std::string& where) {
  static const std::vector<std::string> names = {"Xposition", "Yposition", "Zposition",
                                                 "Xrotation", "Yrotation", "Zrotation"};
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end())
    refuse(where, "found the channel {}, expected one of {}", in_quotes(name), fmt::join(names, ", "));
  return static_cast<int>(found - names.begin());
}

void read_joint(Words& words, const std::string& name, int parent, Motion& motion, int depth = 1) {
  if (depth > kDeepestJoint)
    refuse(words.where(), "found joints nested deeper than {}, expected at most {}", kDeepestJoint, kDeepestJoint);
  const auto index = static_cast<int>(motion.joints.size());
  motion.joints.push_back({name, parent, Eigen::Vector3d::Zero(), {}});
  words.expect("{");
  for (;;) {
    const std::string word = words.next("OFFSET, CHANNELS, JOINT, End or \"}\"");
    if (word == "}") return;
    if (word == "OFFSET") {
      motion.joints[static_cast<size_t>(index)].offset = read_offset(words);
    } else if (word == "CHANNELS") {
      const int count = words.whole("a number of channels", 6);
      for (int i = 0; i < count; ++i) {
        const std::string channel = words.next("a channel");
        motion.joints[static_cast<size_t>(index)].channels.push_back(channel_of(channel, words.where()));
      }
    } else if (word == "JOINT") {
      const std::string child = words.rest_of_line();
      if (child.empty()) refuse(words.where(), "found JOINT without a name, expected one");
      read_joint(words, child, index, motion, depth + 1);
    } else if (word == "End") {
      words.expect("Site");
      read_joint(words, name + "-end", index, motion, depth + 1);
    } else {
      refuse(words.where(), "found {}, expected OFFSET, CHANNELS, JOINT, End or \"}}\"", in_quotes(word));
    }
  }
}

void read_frame(Words& words, Motion& motion) {
  std::vector<Eigen::Vector3d> translation;
  std::vector<Eigen::Quaterniond> rotation;
  for (const Joint& joint : motion.joints) {
    Eigen::Vector3d moved = joint.offset;
    Eigen::Quaterniond turned = Eigen::Quaterniond::Identity();
    for (const int channel : joint.channels) {
      const double value = words.number("the value of a channel");
      if (channel < 3) moved(channel) += value;
      else turned = turned * Eigen::AngleAxisd(value * std::numbers::pi / 180, Eigen::Vector3d::Unit(channel - 3));
    }
    translation.push_back(moved);
    rotation.push_back(turned);
  }
  motion.translation.push_back(std::move(translation));
  motion.rotation.push_back(std::move(rotation));
}

// From the file's units and axes to metres, z up.
void convert(Motion& motion, const BvhOptions& options) {
  for (auto& frame : motion.translation)
    for (Eigen::Vector3d& p : frame) p *= options.metres_per_unit;
  for (Joint& joint : motion.joints) joint.offset *= options.metres_per_unit;
  if (!options.y_up) return;
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitX()));
  for (size_t f = 0; f < motion.translation.size(); ++f) {
    motion.translation[f][0] = turn * motion.translation[f][0];
    motion.rotation[f][0] = turn * motion.rotation[f][0];
  }
}

// Catmull–Rom through the root's positions.
Eigen::Vector3d root_at(const Motion& m, size_t frame, double share) {
  const auto p = [&](long i) {
    return m.translation[static_cast<size_t>(std::clamp<long>(i, 0, static_cast<long>(m.translation.size()) - 1))][0];
  };
  const auto i = static_cast<long>(frame);
  const Eigen::Vector3d here = p(i), there = p(i + 1);
  const Eigen::Vector3d out = i > 0 ? Eigen::Vector3d((there - p(i - 1)) / 2) : Eigen::Vector3d(there - here);
  const Eigen::Vector3d in = i + 2 < static_cast<long>(m.translation.size()) ? Eigen::Vector3d((p(i + 2) - here) / 2)
                                                                             : Eigen::Vector3d(there - here);
  return geometry::hermite(share, 1, here, out, there, in);
}

// Where a motion from rest that has unit speed at 0 is at a time before it.
double from_rest(double time_s, double over_s) {
  if (over_s <= 0) return 0;
  const double t = std::max(time_s, -over_s);
  return t + t * t / (2 * over_s);
}

// Share of the first pose that is taken up from the skeleton's own at a time before 0.
double taken_up(double time_s, double over_s) {
  const double x = over_s > 0 ? std::clamp(1 + time_s / over_s, 0.0, 1.0) : 1;
  return x * x * (3 - 2 * x);
}

}  // namespace

Motion read_bvh(const std::filesystem::path& path, const BvhOptions& options) {
  return parse_bvh(files::read_whole(path), path.string(), options);
}

Motion parse_bvh(const std::string& text, const std::string& where, const BvhOptions& options) {
  Words words(text, where);
  Motion motion;
  words.expect("HIERARCHY");
  words.expect("ROOT");
  const std::string root = words.rest_of_line();
  if (root.empty()) refuse(words.where(), "found ROOT without a name, expected one");
  read_joint(words, root, -1, motion);
  // So a frame has numbers, and there are no more frames than the text has words.
  if (std::all_of(motion.joints.begin(), motion.joints.end(), [](const Joint& j) { return j.channels.empty(); }))
    refuse(words.where(), "found no CHANNELS at any joint, expected some that move");
  words.expect("MOTION");
  words.expect("Frames:");
  const int frames = words.whole("a number of frames", 10'000'000);
  if (frames < 2) refuse(words.where(), "found {} frames, expected at least 2", frames);
  if (static_cast<size_t>(frames) > kMostPoses / motion.joints.size())
    refuse(words.where(), "found {} frames of {} joints, expected at most {} poses of a joint", frames,
           motion.joints.size(), kMostPoses);
  words.expect("Frame");
  words.expect("Time:");
  motion.frame_s = words.number("the time of a frame, s");
  if (!(motion.frame_s > 0)) refuse(words.where(), "found a frame time of {}, expected one above 0", motion.frame_s);
  for (int f = 0; f < frames; ++f) read_frame(words, motion);
  if (!words.at_end()) refuse(words.where(), "found more values after {} frames, expected the end of the file", frames);
  convert(motion, options);
  return motion;
}

int joint_index(const Motion& motion, const std::string& name, const std::string& where) {
  std::vector<std::string> names;
  for (size_t i = 0; i < motion.joints.size(); ++i) {
    if (motion.joints[i].name == name) return static_cast<int>(i);
    names.push_back(motion.joints[i].name);
  }
  refuse(where, "found the joint {}, expected one of {}", in_quotes(name), fmt::join(names, ", "));
}

std::vector<Eigen::Isometry3d> pose_at(const Motion& motion, double time_s, double run_up_s) {
  const size_t last = motion.translation.size() - 1;
  const double in_frames = std::clamp(time_s / motion.frame_s, 0.0, static_cast<double>(last));
  const size_t frame = std::min(static_cast<size_t>(in_frames), last - 1);
  const double share =
      time_s < 0 ? from_rest(time_s, kPoseRunUp_s) / motion.frame_s : in_frames - static_cast<double>(frame);
  std::vector<Eigen::Isometry3d> world(motion.joints.size());
  for (size_t j = 0; j < motion.joints.size(); ++j) {
    Eigen::Isometry3d local = Eigen::Isometry3d::Identity();
    Eigen::Quaterniond turned = motion.rotation[frame][j].slerp(share, motion.rotation[frame + 1][j]);
    if (j > 0 && time_s < 0) turned = Eigen::Quaterniond::Identity().slerp(taken_up(time_s, run_up_s), turned);
    local.linear() = turned.normalized().toRotationMatrix();
    if (j > 0) {
      local.translation() = motion.translation[frame][j];
    } else if (time_s < 0) {
      local.translation() = motion.translation[0][0] + from_rest(time_s, run_up_s) / motion.frame_s *
                                                           (motion.translation[1][0] - motion.translation[0][0]);
    } else {
      local.translation() = root_at(motion, frame, share);
    }
    world[j] = motion.joints[j].parent < 0 ? local : world[static_cast<size_t>(motion.joints[j].parent)] * local;
  }
  return world;
}

}  // namespace selvedge::garment
