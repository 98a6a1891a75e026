#include "station/exchange/point_bytes.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstdint>
#include <sstream>

#include "files/bad_input.h"

namespace selvedge::station {

bool is_known(const NumberType& type) {
  if (type.kind == 'f') return type.bytes == 4 || type.bytes == 8;
  return (type.kind == 'i' || type.kind == 'u') && std::has_single_bit(type.bytes) && type.bytes <= 8;
}

double number_at(const char* bytes, const NumberType& type) {
  uint64_t value = 0;
  for (size_t i = 0; i < type.bytes; ++i) {
    const size_t at = type.is_big ? i : type.bytes - 1 - i;
    value = value << 8 | static_cast<unsigned char>(bytes[at]);
  }
  if (type.kind == 'u') return static_cast<double>(value);
  if (type.kind == 'f')
    return type.bytes == 4 ? static_cast<double>(std::bit_cast<float>(static_cast<uint32_t>(value)))
                           : std::bit_cast<double>(value);
  const auto unused = static_cast<int>(64 - 8 * type.bytes);
  return static_cast<double>(static_cast<int64_t>(value << unused) >> unused);
}

std::string PointBytes::line() {
  const size_t end = bytes_.find('\n', at_);
  if (end == std::string_view::npos) refuse(where_, "ends within its header");
  std::string out(bytes_.substr(at_, end - at_));
  at_ = end + 1;
  if (!out.empty() && out.back() == '\r') out.pop_back();
  return out;
}

std::string_view PointBytes::take(size_t count) {
  if (count > left()) refuse(where_, "is cut short: found {} bytes, expected {} or more", bytes_.size(), at_ + count);
  const std::string_view out = bytes_.substr(at_, count);
  at_ += count;
  return out;
}

double PointBytes::number(const NumberType& type) { return number_at(take(type.bytes).data(), type); }

double PointBytes::word() {
  constexpr std::string_view kSpace = " \t\r\n";
  const size_t from = bytes_.find_first_not_of(kSpace, at_);
  if (from == std::string_view::npos) refuse(where_, "is cut short: it ends before its last point");
  const size_t to = std::min(bytes_.find_first_of(kSpace, from), bytes_.size());
  at_ = to;
  double value = 0;
  const char* const end = bytes_.data() + to;
  const auto [stopped, error] = std::from_chars(bytes_.data() + from, end, value);
  if (stopped != end || error != std::errc())
    refuse(where_, "found {}, expected a number",
           in_quotes(std::string(bytes_.substr(from, std::min<size_t>(to - from, 40)))));
  return value;
}

std::vector<std::string> words_of(const std::string& line) {
  std::istringstream stream(line);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(std::move(word));
  return words;
}

size_t axis_of(const std::string& name) {
  const size_t axis = name.size() == 1 ? std::string_view("xyz").find(name[0]) : std::string_view::npos;
  return std::min(axis, size_t{3});
}

size_t count_of(const std::string& word, size_t least, const std::string& where, const std::string& what) {
  constexpr size_t kMost = 100'000'000;
  size_t value = 0;
  const char* const end = word.data() + word.size();
  const auto [stopped, error] = std::from_chars(word.data(), end, value);
  if (word.empty() || stopped != end || error != std::errc() || value < least || value > kMost)
    refuse(where, "found {} {}, expected {} to {}", what, in_quotes(word), least, kMost);
  return value;
}

}  // namespace selvedge::station
