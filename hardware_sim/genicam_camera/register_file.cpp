#include "hardware_sim/genicam_camera/register_file.h"

#include <algorithm>
#include <bit>
#include <cstring>

namespace selvedge::sim {

namespace {

uint64_t number(const uint8_t* bytes, size_t count, ByteOrder order) {
  uint64_t value = 0;
  for (size_t i = 0; i < count; ++i) value = value << 8 | bytes[order == ByteOrder::big ? i : count - 1 - i];
  return value;
}

}  // namespace

RegisterFile::RegisterFile(ByteOrder order, size_t size_bytes, size_t alignment_bytes)
    : order_(order), alignment_bytes_(alignment_bytes), bytes_(size_bytes, 0) {}

void RegisterFile::allow(uint32_t address, uint32_t least, uint32_t most) {
  allowed_[address] = {static_cast<double>(least), static_cast<double>(most), 4, false};
}
void RegisterFile::allow_real(uint32_t address, double least, double most) {
  allowed_[address] = {least, most, 8, false};
}
void RegisterFile::allow_command(uint32_t address, uint32_t least, uint32_t most) {
  allowed_[address] = {static_cast<double>(least), static_cast<double>(most), 4, true};
}

AccessError RegisterFile::read(uint64_t address, uint8_t* bytes, size_t count) const {
  if (address % alignment_bytes_ != 0 || count % alignment_bytes_ != 0) return AccessError::bad_alignment;
  if (address >= bytes_.size() || count > bytes_.size() - address) return AccessError::invalid_address;
  const std::lock_guard lock(mutex_);
  std::memcpy(bytes, bytes_.data() + address, count);
  return AccessError::none;
}

AccessError RegisterFile::write(uint64_t address, const uint8_t* bytes, size_t count) {
  if (address % alignment_bytes_ != 0) return AccessError::bad_alignment;
  if (address >= bytes_.size()) return AccessError::invalid_address;
  const auto found = allowed_.find(address);
  if (found == allowed_.end() || found->second.bytes != count) return AccessError::write_protect;
  const uint64_t bits = number(bytes, count, order_);
  const double value = count == 8 ? std::bit_cast<double>(bits) : static_cast<double>(bits);
  if (!(value >= found->second.least && value <= found->second.most)) return AccessError::invalid_parameter;
  if (found->second.command) return AccessError::none;
  const std::lock_guard lock(mutex_);
  std::memcpy(bytes_.data() + address, bytes, count);
  return AccessError::none;
}

uint32_t RegisterFile::word(uint32_t address) const {
  const std::lock_guard lock(mutex_);
  return static_cast<uint32_t>(get(address, 4));
}
double RegisterFile::real(uint32_t address) const {
  const std::lock_guard lock(mutex_);
  return std::bit_cast<double>(get(address, 8));
}
uint32_t RegisterFile::word_of(const uint8_t* bytes) const { return static_cast<uint32_t>(number(bytes, 4, order_)); }

void RegisterFile::set_word(uint32_t address, uint32_t value) {
  const std::lock_guard lock(mutex_);
  put(address, value, 4);
}
void RegisterFile::set_long(uint32_t address, uint64_t value) {
  const std::lock_guard lock(mutex_);
  put(address, value, 8);
}
void RegisterFile::set_real(uint32_t address, double value) { set_long(address, std::bit_cast<uint64_t>(value)); }
void RegisterFile::set_text(uint32_t address, size_t size, const std::string& text) {
  const std::lock_guard lock(mutex_);
  std::memcpy(bytes_.data() + address, text.data(), std::min(size, text.size()));
}

uint64_t RegisterFile::get(size_t address, size_t count) const {
  return number(bytes_.data() + address, count, order_);
}
void RegisterFile::put(size_t address, uint64_t value, size_t count) {
  for (size_t i = 0; i < count; ++i)
    bytes_[address + (order_ == ByteOrder::big ? count - 1 - i : i)] = static_cast<uint8_t>(value >> (8 * i));
}

}  // namespace selvedge::sim
