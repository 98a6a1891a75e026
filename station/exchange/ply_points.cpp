#include <algorithm>
#include <map>
#include <optional>

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

// The numbers behind the header, one after another.
class PlyNumbers {
 public:
  PlyNumbers(PointBytes& file, PlyFormat format) : file_(file), is_text_(format == PlyFormat::ascii) {}

  // Of a property that is no list; lists are passed over.
  std::optional<double> next(const PlyProperty& property) {
    if (!property.is_list) return next(property.type);
    const double length = next(property.count);
    for (double k = 0; k < length; ++k) next(property.type);
    return {};
  }

 private:
  double next(const NumberType& type) { return is_text_ ? file_.word() : file_.number(type); }

  PointBytes& file_;
  bool is_text_;
};

void pass_over(const PlyElement& element, PlyNumbers& numbers) {
  if (element.properties.empty()) return;
  for (size_t i = 0; i < element.count; ++i)
    for (const PlyProperty& property : element.properties) numbers.next(property);
}

Matrix3Xd ply_vertices(const PlyElement& element, PlyNumbers& numbers, const std::string& where) {
  std::vector<size_t> axes;  // of each property
  for (const PlyProperty& p : element.properties) axes.push_back(p.is_list ? 3 : axis_of(p.name));
  for (size_t axis = 0; axis < 3; ++axis)
    if (std::find(axes.begin(), axes.end(), axis) == axes.end()) refuse(where, "found no x, y and z of its vertices");
  Matrix3Xd points(3, static_cast<Index>(element.count));
  for (Index i = 0; i < points.cols(); ++i)
    for (size_t p = 0; p < axes.size(); ++p)
      if (const std::optional<double> value = numbers.next(element.properties[p]); axes[p] < 3)
        points(static_cast<Index>(axes[p]), i) = *value;
  return points;
}

}  // namespace

std::vector<Matrix3Xd> parse_ply(std::string_view bytes, const std::string& where) {
  PointBytes file(bytes, where);
  PlyFormat format = PlyFormat::ascii;
  if (file.line() != "ply") refuse(where, "found no header of a PLY file");
  const std::vector<PlyElement> elements = ply_elements(file, format);
  PlyNumbers numbers(file, format);
  for (const PlyElement& element : elements) {
    const bool is_wanted = element.name == "vertex";
    // A byte each at least, so that a header alone takes no memory.
    if (element.count > file.left() && (is_wanted || !element.properties.empty()))
      refuse(where, "is cut short: found {} bytes for {} of {}", file.left(), element.count, element.name);
    if (is_wanted) return {ply_vertices(element, numbers, where)};
    pass_over(element, numbers);
  }
  refuse(where, "found no element vertex");
}

}  // namespace selvedge::station
