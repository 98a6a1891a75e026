// Reading and writing packed wire formats, every read checked against the end of the buffer.
//
// Numbers are packed without alignment, in the byte order given as template argument. A read past the end
// throws WireError and says where; a count is checked against what is left before anything is allocated, so
// an absurd length from the wire costs nothing.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include <fmt/format.h>

namespace selvedge::wire {

// What came over the wire is not what its protocol allows. The connection it came by is to be closed.
class WireError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

template <std::endian order>
class Reader {
 public:
  explicit Reader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  size_t left() const { return bytes_.size() - at_; }
  size_t position() const { return at_; }

  template <class Number>
  Number number() {
    static_assert(std::is_arithmetic_v<Number>);
    const auto raw = take(sizeof(Number));
    std::uint8_t ordered[sizeof(Number)];
    std::copy(raw.begin(), raw.end(), ordered);
    if constexpr (order != std::endian::native) std::reverse(ordered, ordered + sizeof(Number));
    Number value;
    std::memcpy(&value, ordered, sizeof(Number));
    return value;
  }

  std::span<const std::uint8_t> take(size_t count) {
    if (count > left()) throw WireError(fmt::format("byte {}: {} bytes expected, {} left", at_, count, left()));
    const auto part = bytes_.subspan(at_, count);
    at_ += count;
    return part;
  }

  std::string text(size_t count) {
    const auto raw = take(count);
    return {raw.begin(), raw.end()};
  }

  // A u32 count of elements of at least element_bytes each, refused where they cannot all be there.
  std::uint32_t count(size_t element_bytes) {
    const auto elements = number<std::uint32_t>();
    if (element_bytes * static_cast<std::uint64_t>(elements) > left())
      throw WireError(fmt::format("byte {}: {} elements of {} bytes announced, {} bytes left", at_, elements,
                                  element_bytes, left()));
    return elements;
  }

  Reader part(size_t count) { return Reader(take(count)); }

 private:
  std::span<const std::uint8_t> bytes_;
  size_t at_ = 0;
};

template <std::endian order>
class Writer {
 public:
  template <class Number>
  Writer& number(std::type_identity_t<Number> value) {
    static_assert(std::is_arithmetic_v<Number>);
    std::uint8_t raw[sizeof(Number)];
    std::memcpy(raw, &value, sizeof(Number));
    if constexpr (order != std::endian::native) std::reverse(raw, raw + sizeof(Number));
    return append(raw, sizeof(Number));
  }
  Writer& text(std::string_view value) { return append(value.data(), value.size()); }
  Writer& raw(std::span<const std::uint8_t> value) { return append(value.data(), value.size()); }
  const std::vector<std::uint8_t>& bytes() const { return bytes_; }
  size_t size() const { return bytes_.size(); }

 private:
  Writer& append(const void* data, size_t count) {
    const size_t at = bytes_.size();
    bytes_.resize(at + count);
    if (count > 0) std::memcpy(bytes_.data() + at, data, count);
    return *this;
  }
  std::vector<std::uint8_t> bytes_;
};

using LittleReader = Reader<std::endian::little>;
using LittleWriter = Writer<std::endian::little>;
using BigReader = Reader<std::endian::big>;
using BigWriter = Writer<std::endian::big>;

}  // namespace selvedge::wire
