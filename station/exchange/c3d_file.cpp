#include "station/exchange/c3d_file.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>

#include "files/bad_input.h"
#include "files/whole_file.h"

namespace selvedge::station {

namespace {

constexpr size_t kBlock = 512;
constexpr unsigned char kMark = 80;

// The processor whose numbers a file holds, as it says it: 83 + 1, 2, 3.
enum class C3dNumbers { intel = 84, dec = 85, sgi = 86 };

class C3dBytes {
 public:
  C3dBytes(std::string_view bytes, std::string where) : bytes_(bytes), where_(std::move(where)) {}

  const std::string& where() const { return where_; }
  size_t size() const { return bytes_.size(); }
  void set_numbers(C3dNumbers numbers) { numbers_ = numbers; }

  uint8_t byte(size_t at) const {
    if (at >= bytes_.size()) refuse(where_, "ends at byte {}, expected more", bytes_.size());
    return static_cast<uint8_t>(bytes_[at]);
  }
  uint16_t word(size_t at) const {
    const unsigned a = byte(at), b = byte(at + 1);
    return static_cast<uint16_t>(numbers_ == C3dNumbers::sgi ? a << 8 | b : b << 8 | a);
  }
  float real(size_t at) const {
    const uint32_t first = word(at), second = word(at + 2);
    if (numbers_ == C3dNumbers::intel) return std::bit_cast<float>(second << 16 | first);
    const auto value = std::bit_cast<float>(first << 16 | second);
    return numbers_ == C3dNumbers::dec ? value / 4 : value;
  }
  std::string text(size_t at, size_t length) const {
    if (length > 0) byte(at + length - 1);
    std::string out(bytes_.substr(at, length));
    while (!out.empty() && (out.back() == ' ' || out.back() == '\0')) out.pop_back();
    return out;
  }

 private:
  std::string_view bytes_;
  std::string where_;
  C3dNumbers numbers_ = C3dNumbers::intel;
};

struct C3dParameter {
  int type = 0;  // -1 text, 1 byte, 2 whole number, 4 float
  std::vector<size_t> dimensions;
  size_t at = 0;  // of its data
};

// By "GROUP:NAME", in capitals.
using C3dParameters = std::map<std::string, C3dParameter>;

std::string capitals(std::string text) {
  for (char& c : text)
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
  return text;
}

C3dParameter parameter_at(const C3dBytes& file, size_t at) {
  C3dParameter p;
  p.type = static_cast<int8_t>(file.byte(at));
  const size_t dimensions = file.byte(at + 1);
  for (size_t i = 0; i < dimensions; ++i) p.dimensions.push_back(file.byte(at + 2 + i));
  p.at = at + 2 + dimensions;
  return p;
}

// The entries of the parameter section; each says how far the next one is.
C3dParameters parameters_of(C3dBytes& file) {
  const size_t begin = (static_cast<size_t>(file.byte(0)) - 1) * kBlock;
  const unsigned processor = file.byte(begin + 3);
  if (processor < 84 || processor > 86)
    refuse(file.where(), "found processor {}, expected 84 (Intel), 85 (DEC) or 86 (SGI)", processor);
  file.set_numbers(static_cast<C3dNumbers>(processor));
  std::map<int, std::string> groups;
  std::map<std::pair<int, std::string>, C3dParameter> found;
  for (size_t at = begin + 4;;) {
    const int length = std::abs(static_cast<int8_t>(file.byte(at))), group = static_cast<int8_t>(file.byte(at + 1));
    if (length == 0 || group == 0) break;
    const std::string name = capitals(file.text(at + 2, static_cast<size_t>(length)));
    const size_t next = at + 2 + static_cast<size_t>(length), offset = file.word(next);
    if (group < 0) groups[-group] = name;
    else found[{group, name}] = parameter_at(file, next + 2);
    if (offset == 0) break;
    at = next + offset;
  }
  C3dParameters out;
  for (const auto& [key, p] : found) out[groups[key.first] + ":" + key.second] = p;
  return out;
}

// Text of one dimension, or of two: a row a text.
std::vector<std::string> texts_of(const C3dBytes& file, const C3dParameters& all, const std::string& name) {
  std::vector<std::string> out;
  const auto p = all.find(name);
  if (p == all.end() || p->second.type != -1 || p->second.dimensions.empty()) return out;
  const size_t length = p->second.dimensions[0], rows = p->second.dimensions.size() > 1 ? p->second.dimensions[1] : 1;
  for (size_t i = 0; i < rows; ++i) out.push_back(file.text(p->second.at + i * length, length));
  return out;
}

// LABELS, and LABELS2 and so on behind the 255th; what has none is called by its place.
std::vector<std::string> labels_of(const C3dBytes& file, const C3dParameters& all, size_t points) {
  std::vector<std::string> labels;
  for (int part = 1; part == 1 || all.count("POINT:LABELS" + std::to_string(part)); ++part)
    for (std::string& label : texts_of(file, all, "POINT:LABELS" + (part == 1 ? "" : std::to_string(part))))
      labels.push_back(std::move(label));
  labels.resize(points);
  for (size_t i = 0; i < points; ++i)
    if (labels[i].empty()) labels[i] = "point " + std::to_string(i + 1);
  return labels;
}

// Of the header; where a parameter says it too, with a wider range, that counts.
size_t frames_of(const C3dBytes& file, const C3dParameters& all) {
  const auto long_number = [&](const char* name, size_t otherwise) -> size_t {
    const auto p = all.find(name);
    if (p == all.end() || p->second.type != 2) return otherwise;
    return file.word(p->second.at) | static_cast<size_t>(file.word(p->second.at + 2)) << 16;
  };
  const size_t first = long_number("TRIAL:ACTUAL_START_FIELD", file.word(6)),
               last = long_number("TRIAL:ACTUAL_END_FIELD", file.word(8));
  if (last < first) refuse(file.where(), "found frames {} to {}, expected at least one", first, last);
  return last - first + 1;
}

}  // namespace

C3dPoints parse_c3d(std::string_view bytes, const std::string& where) {
  C3dBytes file(bytes, where);
  if (bytes.size() < kBlock || file.byte(1) != kMark || file.byte(0) == 0)
    refuse(where, "found no header of a C3D file");
  const C3dParameters parameters = parameters_of(file);
  const size_t points = file.word(2), analogue = file.word(4), frames = frames_of(file, parameters);
  const double scale = file.real(12);
  const bool is_real = scale < 0;
  const size_t begin = (static_cast<size_t>(file.word(16)) - 1) * kBlock, width = is_real ? 4 : 2,
               a_frame = (4 * points + analogue) * width;
  if (points == 0) refuse(where, "found no points, expected tracked markers");
  if (file.word(16) == 0 || begin > file.size() || (file.size() - begin) / a_frame < frames)
    refuse(where, "is cut short: found {} bytes, expected {} frames of {} bytes from byte {}", file.size(), frames,
           a_frame, begin);
  C3dPoints out;
  out.rate_hz = file.real(20);
  if (!(out.rate_hz > 0) || !std::isfinite(out.rate_hz))
    refuse(where, "found a rate of {} Hz, expected one above 0", out.rate_hz);
  const std::vector<std::string> units = texts_of(file, parameters, "POINT:UNITS");
  if (!units.empty()) out.unit = units.front();
  out.labels = labels_of(file, parameters, points);
  out.position.assign(points, Eigen::Matrix3Xd::Constant(3, static_cast<Eigen::Index>(frames),
                                                         std::numeric_limits<double>::quiet_NaN()));
  for (size_t f = 0; f < frames; ++f)
    for (size_t p = 0; p < points; ++p) {
      const size_t at = begin + f * a_frame + 4 * p * width;
      const auto number = [&](size_t k) -> double {
        return is_real ? file.real(at + k * width) : static_cast<int16_t>(file.word(at + k * width));
      };
      if (!(number(3) >= 0)) continue;  // the residual of what was not seen is below 0
      Eigen::Vector3d x(number(0), number(1), number(2));
      if (!is_real) x *= scale;
      if (x.allFinite()) out.position[p].col(static_cast<Eigen::Index>(f)) = x;
    }
  return out;
}

C3dPoints read_c3d(const std::filesystem::path& path) { return parse_c3d(files::read_whole(path), path.string()); }

}  // namespace selvedge::station
