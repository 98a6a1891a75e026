#include <array>
#include <limits>
#include <map>

#include "files/bad_input.h"
#include "station/exchange/point_bytes.h"
#include "station/exchange/points_file.h"

namespace selvedge::station {

using Eigen::Index;
using Eigen::Matrix3Xd;

namespace {

struct PlyProperty {
  std::string name;
  NumberType type, count;  // count: of a list's length
  bool is_list = false;
};

struct PlyElement {
  std::string name;
  size_t count = 0;
  std::vector<PlyProperty> properties;
};

enum class PlyFormat { ascii, little, big };

NumberType ply_type(const std::string& name, PlyFormat format, const std::string& where) {
  static const std::map<std::string, NumberType> known = {
      {"char", {'i', 1}},  {"int8", {'i', 1}},    {"uchar", {'u', 1}},  {"uint8", {'u', 1}},
      {"short", {'i', 2}}, {"int16", {'i', 2}},   {"ushort", {'u', 2}}, {"uint16", {'u', 2}},
      {"int", {'i', 4}},   {"int32", {'i', 4}},   {"uint", {'u', 4}},   {"uint32", {'u', 4}},
      {"float", {'f', 4}}, {"float32", {'f', 4}}, {"double", {'f', 8}}, {"float64", {'f', 8}}};
  const auto found = known.find(name);
  if (found == known.end()) refuse(where, "found a property of type {}, expected float, double, …", in_quotes(name));
  NumberType type = found->second;
  type.is_big = format == PlyFormat::big;
  return type;
}

PlyFormat ply_format(const std::vector<std::string>& words, const std::string& where) {
  static const std::map<std::string, PlyFormat> known = {
      {"ascii", PlyFormat::ascii}, {"binary_little_endian", PlyFormat::little}, {"binary_big_endian", PlyFormat::big}};
  const std::string name = words.size() > 1 ? words[1] : "";
  const auto found = known.find(name);
  if (found == known.end())
    refuse(where, "found format {}, expected ascii, binary_little_endian or binary_big_endian", in_quotes(name));
  return found->second;
}

// The header up to its end. The format stands in front of the elements.
std::vector<PlyElement> ply_elements(PointBytes& file, PlyFormat& format) {
  std::vector<PlyElement> elements;
  for (;;) {
    const std::vector<std::string> words = words_of(file.line());
    if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
    if (words[0] == "end_header") return elements;
    if (words[0] == "format") {
      format = ply_format(words, file.where());
    } else if (words[0] == "element" && words.size() == 3) {
      elements.push_back({words[1], count_of(words[2], 0, file.where(), "a count of " + words[1]), {}});
    } else if (words[0] == "property" && words.size() == 3 && !elements.empty()) {
      elements.back().properties.push_back({words[2], ply_type(words[1], format, file.where()), {}, false});
    } else if (words[0] == "property" && words.size() == 5 && words[1] == "list" && !elements.empty()) {
      elements.back().properties.push_back(
          {words[4], ply_type(words[3], format, file.where()), ply_type(words[2], format, file.where()), true});
    } else {
      refuse(file.where(), "found {} in its header, expected element or property", in_quotes(words[0]));
    }
  }
}

}  // namespace

std::vector<Matrix3Xd> parse_ply(std::string_view bytes, const std::string& where) {
  PointBytes file(bytes, where);
  PlyFormat format = PlyFormat::ascii;
  if (file.line() != "ply") refuse(where, "found no header of a PLY file");
  const std::vector<PlyElement> elements = ply_elements(file, format);
  const auto next = [&](const NumberType& type) {
    return format == PlyFormat::ascii ? file.word() : file.number(type);
  };
  for (const PlyElement& element : elements) {
    const bool is_wanted = element.name == "vertex";
    // A byte each at least, so that a header alone takes no memory.
    if (element.count > file.left() && (is_wanted || !element.properties.empty()))
      refuse(where, "is cut short: found {} bytes for {} of {}", file.left(), element.count, element.name);
    Matrix3Xd points = Matrix3Xd::Constant(3, is_wanted ? static_cast<Index>(element.count) : 0,
                                           std::numeric_limits<double>::quiet_NaN());
    std::array<bool, 3> has{};
    for (size_t i = 0; i < element.count && !element.properties.empty(); ++i)
      for (const PlyProperty& property : element.properties) {
        if (property.is_list) {
          const double length = next(property.count);
          for (double k = 0; k < length; ++k) next(property.type);
          continue;
        }
        const double value = next(property.type);
        const size_t axis = property.name.size() == 1 ? std::string("xyz").find(property.name[0]) : std::string::npos;
        if (!is_wanted || axis == std::string::npos) continue;
        points(static_cast<Index>(axis), static_cast<Index>(i)) = value;
        has[axis] = true;
      }
    if (!is_wanted) continue;
    if (!has[0] || !has[1] || !has[2]) refuse(where, "found no x, y and z of its vertices");
    return {points};
  }
  refuse(where, "found no element vertex");
}

}  // namespace selvedge::station
