#include <algorithm>

#include "files/bad_input.h"
#include "station/exchange/point_bytes.h"
#include "station/exchange/points_file.h"

namespace selvedge::station {

using Eigen::Index;
using Eigen::Matrix3Xd;

namespace {

struct NpyHeader {
  NumberType type;
  bool columns_first = false;  // Fortran's order
  std::vector<size_t> shape;
};

NpyHeader npy_header(PointBytes& file) {
  if (file.take(6) != "\x93NUMPY") refuse(file.where(), "found no header of an NPY file");
  const double version = file.number({'u', 1});
  file.take(1);
  const std::string text(file.take(static_cast<size_t>(file.number({'u', version < 2 ? size_t{2} : size_t{4}}))));
  // What stands between two characters behind a key.
  const auto behind = [&](const std::string& key, char from, char to) -> std::string {
    const size_t at = text.find("'" + key + "':"),
                 begin = text.find(from, at == std::string::npos ? at : at + key.size() + 3),
                 end = begin == std::string::npos ? begin : text.find(to, begin + 1);
    if (end == std::string::npos)
      refuse(file.where(), "found no {} in its header, expected points × 3 or frames × points × 3", key);
    return text.substr(begin + 1, end - begin - 1);
  };
  const std::string descr = behind("descr", '\'', '\'');
  if (descr.size() < 3) refuse(file.where(), "found type {}, expected floats or whole numbers", in_quotes(descr));
  NpyHeader out;
  out.type = {descr[1], count_of(descr.substr(2), 1, file.where(), "a type of bytes"), descr[0] == '>'};
  if (!is_known(out.type)) refuse(file.where(), "found type {}, expected floats or whole numbers", in_quotes(descr));
  out.columns_first = behind("fortran_order", ' ', ',') == "True";
  std::string numbers = behind("shape", '(', ')');
  std::replace(numbers.begin(), numbers.end(), ',', ' ');
  for (const std::string& word : words_of(numbers)) out.shape.push_back(count_of(word, 0, file.where(), "a shape of"));
  return out;
}

// How many numbers apart neighbours along each axis of an array lie.
std::vector<size_t> strides_of(const NpyHeader& header) {
  const size_t n = header.shape.size();
  std::vector<size_t> out(n, 1);
  for (size_t i = 1; i < n; ++i) {
    if (header.columns_first) out[i] = out[i - 1] * header.shape[i - 1];
    else out[n - 1 - i] = out[n - i] * header.shape[n - i];
  }
  return out;
}

// The points of one frame; those of a grid row by row.
Matrix3Xd npy_frame(const NpyHeader& header, std::string_view numbers, size_t frame, size_t points) {
  const std::vector<size_t>& shape = header.shape;
  const std::vector<size_t> stride = strides_of(header);
  const size_t first = shape.size() > 2 ? frame * stride[0] : 0;
  const auto place_of = [&](size_t point) {
    if (shape.size() < 4) return first + point * stride[shape.size() - 2];
    return first + point / shape[2] * stride[1] + point % shape[2] * stride[2];
  };
  Matrix3Xd out(3, static_cast<Index>(points));
  for (size_t p = 0; p < points; ++p)
    for (size_t axis = 0; axis < 3; ++axis)
      out(static_cast<Index>(axis), static_cast<Index>(p)) =
          number_at(numbers.data() + (place_of(p) + axis * stride.back()) * header.type.bytes, header.type);
  return out;
}

}  // namespace

std::vector<Matrix3Xd> parse_npy(std::string_view all, const std::string& where) {
  PointBytes file(all, where);
  const NpyHeader header = npy_header(file);
  const std::vector<size_t>& shape = header.shape;
  if (shape.size() < 2 || shape.size() > 4 || shape.back() != 3)
    refuse(where, "found an array of {} axes, the last of {}, expected points × 3 or frames × points × 3", shape.size(),
           shape.empty() ? 0 : shape.back());
  size_t numbers = 1;
  for (const size_t length : shape) {
    numbers *= length;
    if (numbers > file.left()) refuse(where, "is cut short: found {} bytes of numbers", file.left());
  }
  if (numbers == 0) refuse(where, "found no points");
  const std::string_view bytes = file.take(numbers * header.type.bytes);
  const size_t frames = shape.size() == 2 ? 1 : shape[0], points = numbers / 3 / frames;
  std::vector<Matrix3Xd> out;
  for (size_t f = 0; f < frames; ++f) out.push_back(npy_frame(header, bytes, f, points));
  return out;
}

}  // namespace selvedge::station
