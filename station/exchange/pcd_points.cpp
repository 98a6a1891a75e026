#include <array>
#include <map>

#include <liblzf/lzf.h>

#include "files/bad_input.h"
#include "station/exchange/point_bytes.h"
#include "station/exchange/points_file.h"

namespace selvedge::station {

using Eigen::Index;
using Eigen::Matrix3Xd;

namespace {

struct PcdField {
  std::string name;
  NumberType type;
  size_t count = 1;
};

struct PcdHeader {
  std::vector<PcdField> fields;
  size_t points = 0;
  std::string data;

  size_t bytes_a_point() const {
    size_t sum = 0;
    for (const PcdField& f : fields) sum += f.type.bytes * f.count;
    return sum;
  }
};

PcdHeader pcd_header(PointBytes& file) {
  std::map<std::string, std::vector<std::string>> said;
  while (said.count("DATA") == 0) {
    std::vector<std::string> words = words_of(file.line());
    if (words.empty() || words[0][0] == '#') continue;
    const std::string key = words[0];
    words.erase(words.begin());
    said[key] = std::move(words);
  }
  const auto of = [&](const std::string& key, size_t count) -> const std::vector<std::string>& {
    const std::vector<std::string>& words = said[key];
    if (words.size() != count) refuse(file.where(), "found {} words behind {}, expected {}", words.size(), key, count);
    return words;
  };
  PcdHeader out;
  const std::vector<std::string> names = said["FIELDS"], sizes = of("SIZE", names.size()),
                                 types = of("TYPE", names.size());
  if (names.empty()) refuse(file.where(), "found no FIELDS, expected x y z");
  const std::vector<std::string> counts =
      said.count("COUNT") ? of("COUNT", names.size()) : std::vector<std::string>(names.size(), "1");
  for (size_t i = 0; i < names.size(); ++i) {
    static const std::map<std::string, char> kinds = {{"F", 'f'}, {"I", 'i'}, {"U", 'u'}};
    const auto kind = kinds.find(types[i]);
    PcdField field{names[i],
                   {kind == kinds.end() ? '?' : kind->second, count_of(sizes[i], 1, file.where(), "SIZE"), false},
                   count_of(counts[i], 0, file.where(), "COUNT")};
    if (!is_known(field.type)) refuse(file.where(), "found {} of type {}{}", names[i], types[i], sizes[i]);
    out.fields.push_back(field);
  }
  out.points = count_of(of("POINTS", 1)[0], 0, file.where(), "POINTS");
  out.data = of("DATA", 1)[0];
  return out;
}

// Fields one after another, each of all points.
std::string unpacked(PointBytes& file, size_t bytes) {
  const NumberType size{'u', 4, false};
  const auto packed = static_cast<size_t>(file.number(size)), whole = static_cast<size_t>(file.number(size));
  if (whole != bytes) refuse(file.where(), "found {} bytes packed, expected {}", whole, bytes);
  const std::string_view in = file.take(packed);
  // A byte of three says 264 at most.
  if (bytes > 264 * (packed + 1)) refuse(file.where(), "is damaged: found {} bytes packed in {}", bytes, packed);
  std::string out(bytes, '\0');
  if (bytes > 0 &&
      ::lzf_decompress(in.data(), static_cast<unsigned>(packed), out.data(), static_cast<unsigned>(bytes)) != bytes)
    refuse(file.where(), "is damaged: it cannot be unpacked");
  return out;
}

}  // namespace

std::vector<Matrix3Xd> parse_pcd(std::string_view bytes, const std::string& where) {
  PointBytes file(bytes, where);
  const PcdHeader header = pcd_header(file);
  if (header.data != "ascii" && header.data != "binary" && header.data != "binary_compressed")
    refuse(where, "found DATA {}, expected ascii, binary or binary_compressed", in_quotes(header.data));
  constexpr size_t kWidest = 1'000'000;
  const size_t n = header.points, a_point = header.bytes_a_point();
  if (a_point > kWidest) refuse(where, "found points of {} bytes, expected {} at most", a_point, kWidest);
  const bool is_text = header.data == "ascii", is_packed = header.data == "binary_compressed";
  if (is_text && n > file.left()) refuse(where, "is cut short: found {} bytes for {} points", file.left(), n);
  const std::string columns = is_packed ? unpacked(file, n * a_point) : "";
  const std::string_view rows = is_text || is_packed ? std::string_view() : file.take(n * a_point);
  std::array<std::vector<double>, 3> axes;
  for (size_t i = 0; i < n && is_text; ++i)
    for (const PcdField& field : header.fields)
      for (size_t k = 0; k < field.count; ++k)
        if (const double value = file.word(); axis_of(field.name) < 3 && k == 0)
          axes[axis_of(field.name)].push_back(value);
  size_t before = 0;  // bytes of a point in front of the field
  for (const PcdField& field : header.fields) {
    const size_t width = field.type.bytes * field.count;
    for (size_t i = 0; i < n && !is_text && axis_of(field.name) < 3 && field.count > 0; ++i)
      axes[axis_of(field.name)].push_back(number_at(
          is_packed ? columns.data() + n * before + i * width : rows.data() + i * a_point + before, field.type));
    before += width;
  }
  for (size_t axis = 0; axis < 3; ++axis)
    if (axes[axis].size() != n) refuse(where, "found no field {}, expected x, y and z", "xyz"[axis]);
  Matrix3Xd points(3, static_cast<Index>(n));
  for (size_t axis = 0; axis < 3; ++axis)
    for (size_t i = 0; i < n; ++i) points(static_cast<Index>(axis), static_cast<Index>(i)) = axes[axis][i];
  return {points};
}

}  // namespace selvedge::station
