// C3D files as the three kinds of processors write them, for tests. Source: The C3D File Format User Guide.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace selvedge::station {

struct C3dTake {
  int processor = 84;  // 84 Intel, 85 DEC, 86 SGI
  double scale = -1;   // below 0: floats
  double rate_hz = 100;
  std::string unit = "mm";
  std::vector<std::string> labels;
  std::vector<Eigen::Matrix3Xd> position;  // one a label; NaN: not seen
  int analogue = 0;                        // numbers a frame behind the points
  int first_frame = 1;
};

class C3dWriter {
 public:
  explicit C3dWriter(const C3dTake& take) : take_(take) {}

  std::string bytes() {
    const auto points = take_.labels.size();
    const auto frames = static_cast<size_t>(take_.position.front().cols());
    const std::string parameters = parameter_section();
    std::string out;
    byte(out, 2);
    byte(out, 80);
    word(out, static_cast<int>(points));
    word(out, take_.analogue);
    word(out, take_.first_frame);
    word(out, take_.first_frame + static_cast<int>(frames) - 1);
    word(out, 0);
    real(out, take_.scale);
    word(out, 2 + static_cast<int>(parameters.size() / 512));
    word(out, 1);
    real(out, take_.rate_hz);
    out.resize(512, '\0');
    out += parameters;
    for (size_t f = 0; f < frames; ++f) {
      for (size_t p = 0; p < points; ++p) {
        const Eigen::Vector3d x = take_.position[p].col(static_cast<Eigen::Index>(f));
        for (int axis = 0; axis < 3; ++axis) number(out, x.hasNaN() ? 0 : x(axis));
        if (take_.scale < 0) real(out, x.hasNaN() ? -1 : 0.5);
        else word(out, x.hasNaN() ? -1 : 0x0101);
      }
      for (int i = 0; i < take_.analogue; ++i) number(out, 7);
    }
    return out;
  }

 private:
  static void byte(std::string& out, int value) { out += static_cast<char>(value); }
  void word(std::string& out, int value) const {
    const int low = value & 0xff, high = value >> 8 & 0xff;
    byte(out, take_.processor == 86 ? high : low);
    byte(out, take_.processor == 86 ? low : high);
  }
  void real(std::string& out, double value) const {
    const auto bits = std::bit_cast<uint32_t>(static_cast<float>(take_.processor == 85 ? 4 * value : value));
    const int low = static_cast<int>(bits & 0xffff), high = static_cast<int>(bits >> 16);
    word(out, take_.processor == 84 ? low : high);
    word(out, take_.processor == 84 ? high : low);
  }
  void number(std::string& out, double value) const {
    if (take_.scale < 0) real(out, value);
    else word(out, static_cast<int>(std::lround(value / take_.scale)));
  }

  void entry(std::string& out, const std::string& name, int group, const std::string& data) const {
    byte(out, static_cast<int>(name.size()));
    byte(out, group);
    out += name;
    word(out, static_cast<int>(data.size()) + 3);
    out += data;
    byte(out, 0);  // no description
  }

  std::string parameter_section() const {
    size_t longest = 1;
    for (const std::string& label : take_.labels) longest = std::max(longest, label.size());
    std::string labels = {'\xff', 2, static_cast<char>(longest), static_cast<char>(take_.labels.size())};
    for (std::string label : take_.labels) {
      label.resize(longest, ' ');
      labels += label;
    }
    std::string out = {1, 80, 1, static_cast<char>(take_.processor)};
    entry(out, "POINT", -1, "");
    entry(out, "UNITS", 1, std::string{'\xff', 1, static_cast<char>(take_.unit.size())} + take_.unit);
    entry(out, "labels", 1, labels);
    out.resize((out.size() + 511) / 512 * 512 + 512, '\0');
    return out;
  }

  const C3dTake take_;
};

inline std::string c3d_of(const C3dTake& take) { return C3dWriter(take).bytes(); }

}  // namespace selvedge::station
