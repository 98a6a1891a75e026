#include "hardware_sim/gige_camera/registers.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include <fmt/format.h>

#include "hardware_sim/gige_camera/big_endian.h"

namespace selvedge::sim {

namespace {

constexpr uint32_t kXmlAddress = 0x20000;
constexpr size_t kMemoryBytes = 0x30000;

// What clients may write, and within which bounds. Everything else is read-only.
struct Writable {
  uint32_t address;
  uint32_t least, most;
};
constexpr Writable kWritable[] = {
    {reg::kHeartbeatTimeout_ms, 500, 0xffffffff},
    {reg::kTimestampControl, 1, 2},
    {reg::kControlPrivilege, 0, 3},
    {reg::kStreamPort, 0, 0xffff},
    {reg::kPacketSize, 0, 0xffffffff},
    {reg::kPacketDelay, 0, 0xffffffff},
    {reg::kStreamAddress, 0, 0xffffffff},
    {0x10010, 0, 0},            // OffsetX: the sensor is always read whole
    {0x10014, 0, 0},            // OffsetY
    {0x10018, kMono8, kMono8},  // PixelFormat
    {reg::kAcquisitionMode, 0, 1},
    {reg::kAcquisitionStart, 1, 1},
    {reg::kAcquisitionStop, 1, 1},
    {reg::kTriggerMode, 0, 1},
    {reg::kTriggerSource, 0, 1},
    {0x10034, 0, 0},            // TriggerActivation: rising edge
    {reg::kTriggerSoftware, 1, 1},
    {0x1003c, 0, 0},            // TriggerSelector: frame start
    {0x10040, 0, 1},            // AcquisitionFrameRateEnable
    {0x10068, 0, 1},            // TLParamsLocked
    {reg::kPtpEnable, 0, 1},
    {reg::kPtpLatch, 1, 1},
};
struct WritableReal {
  uint32_t address;
  double least, most;
};
constexpr WritableReal kWritableReal[] = {
    {reg::kFrameRate_hz, 0.1, 1000}, {reg::kExposure_us, 10, 1e6}, {0x10058, 0, 48}};

uint32_t word_of(const uint8_t* bytes) {
  return uint32_t{bytes[0]} << 24 | uint32_t{bytes[1]} << 16 | uint32_t{bytes[2]} << 8 | bytes[3];
}
double real_of(const uint8_t* bytes) {
  return std::bit_cast<double>(uint64_t{word_of(bytes)} << 32 | word_of(bytes + 4));
}

}  // namespace

Registers::Registers(const GigeCameraOptions& options, uint32_t ip_address)
    : bytes_(kMemoryBytes, 0),
      width_px_(static_cast<uint32_t>(options.width_px)),
      height_px_(static_cast<uint32_t>(options.height_px)),
      has_ptp_(options.has_ptp) {
  put(0x0000, 0x00010002);  // GigE Vision 1.2
  put(0x0004, 0x80000001);  // big-endian, UTF-8
  put(0x0008, 0x00000200);  // MAC address, locally administered
  put(0x000c, ip_address);
  put(0x0010, 0x00000005);  // IP configuration: persistent, link-local
  put(0x0014, 0x00000001);
  put(0x0024, ip_address);
  put(0x0034, 0xff000000);
  set_text(0x0048, 32, "Selvedge");
  set_text(0x0068, 32, "Simulated GigE camera");
  set_text(0x0088, 32, "1.0");
  set_text(0x00a8, 48, "simulated device on a loopback address");
  set_text(0x00d8, 16, options.serial);
  const std::string xml = genicam_description(options.has_ptp);
  set_text(kXmlAddress, kMemoryBytes - kXmlAddress, xml);
  set_text(reg::kXmlUrl, 512, fmt::format("Local:selvedge.xml;{:X};{:X}", kXmlAddress, xml.size()));
  put(0x0600, 1);           // network interfaces
  put(0x0904, 1);           // stream channels
  put(0x0934, 1u << 30 | 1u << 2 | 1u << 1 | 1u);  // serial number, packet resend, write memory, concatenation
  put(reg::kHeartbeatTimeout_ms, 3000);
  put(0x0940, 1000000000);  // time-stamp ticks per second
  put(reg::kPacketSize, 1500);

  put(0x10000, width_px_);  // SensorWidth
  put(0x10004, height_px_);
  put(0x10008, width_px_);  // Width
  put(0x1000c, height_px_);
  put(0x10018, kMono8);
  put(0x1001c, width_px_ * height_px_);  // PayloadSize
  put(0x10040, 1);
  put(reg::kPtpStatus, static_cast<uint32_t>(PtpState::disabled));
  put(reg::kTriggerSource, 1);
  set_real(reg::kFrameRate_hz, options.rate_hz);
  set_real(reg::kExposure_us, options.exposure_s * 1e6);
  set_real(reg::kTemperature_degc, options.temperature_degc);
}

GvcpError Registers::read(uint32_t address, uint8_t* bytes, size_t count) const {
  if (address % 4 != 0 || count % 4 != 0) return GvcpError::bad_alignment;
  if (address >= kMemoryBytes || count > kMemoryBytes - address) return GvcpError::invalid_address;
  const std::lock_guard lock(mutex_);
  std::memcpy(bytes, bytes_.data() + address, count);
  return GvcpError::none;
}

GvcpError Registers::check(uint32_t address, const uint8_t* bytes, size_t count) const {
  if (address % 4 != 0) return GvcpError::bad_alignment;
  if (address >= kMemoryBytes) return GvcpError::invalid_address;
  if (count == 4 && (address == 0x10008 || address == 0x1000c))
    return word_of(bytes) == (address == 0x10008 ? width_px_ : height_px_) ? GvcpError::none
                                                                           : GvcpError::invalid_parameter;
  if (!has_ptp_ && (address == reg::kPtpEnable || address == reg::kPtpLatch)) return GvcpError::invalid_address;
  for (const auto& entry : kWritable) {
    if (count != 4 || entry.address != address) continue;
    const uint32_t value = word_of(bytes);
    return value >= entry.least && value <= entry.most ? GvcpError::none : GvcpError::invalid_parameter;
  }
  for (const auto& entry : kWritableReal) {
    if (count != 8 || entry.address != address) continue;
    const double value = real_of(bytes);
    return value >= entry.least && value <= entry.most ? GvcpError::none : GvcpError::invalid_parameter;
  }
  return GvcpError::write_protect;
}

GvcpError Registers::write(uint32_t address, const uint8_t* bytes, size_t count, Effect& effect) {
  effect = Effect::nothing;
  const GvcpError error = check(address, bytes, count);
  if (error != GvcpError::none) return error;
  const std::lock_guard lock(mutex_);
  if (count == 8) {
    std::memcpy(bytes_.data() + address, bytes, 8);
    return GvcpError::none;
  }
  const uint32_t value = word_of(bytes);
  switch (address) {
    // Commands leave nothing behind in the register.
    case reg::kTimestampControl: effect = value == 2 ? Effect::latch : Effect::reset_clock; break;
    case reg::kAcquisitionStart: effect = Effect::start; break;
    case reg::kAcquisitionStop: effect = Effect::stop; break;
    case reg::kTriggerSoftware: effect = Effect::software_trigger; break;
    case reg::kPtpLatch: effect = Effect::ptp_latch; break;
    case reg::kPtpEnable:
      if (get(address) != value) effect = Effect::ptp_switch;
      put(address, value);
      break;
    case reg::kPacketSize:
      // Bounds of a jumbo frame on loopback; the flags stay as written except for the command bit.
      put(address, (value & 0x60000000) | std::clamp<uint32_t>(value & 0xffff, 576, 16384));
      if (value & 0x80000000) effect = Effect::test_packet;
      break;
    default: put(address, value);
  }
  return GvcpError::none;
}

uint32_t Registers::word(uint32_t address) const {
  const std::lock_guard lock(mutex_);
  return get(address);
}

double Registers::real(uint32_t address) const {
  const std::lock_guard lock(mutex_);
  return real_of(bytes_.data() + address);
}

void Registers::set_word(uint32_t address, uint32_t value) {
  const std::lock_guard lock(mutex_);
  put(address, value);
}

void Registers::set_long(uint32_t address, uint64_t value) {
  const std::lock_guard lock(mutex_);
  put(address, static_cast<uint32_t>(value >> 32));
  put(address + 4, static_cast<uint32_t>(value));
}

void Registers::set_text(uint32_t address, size_t size, const std::string& text) {
  std::memcpy(bytes_.data() + address, text.data(), std::min(size, text.size()));
}

void Registers::set_real(uint32_t address, double value) {
  const auto bits = std::bit_cast<uint64_t>(value);
  put(address, static_cast<uint32_t>(bits >> 32));
  put(address + 4, static_cast<uint32_t>(bits));
}

uint32_t Registers::get(uint32_t address) const { return word_of(bytes_.data() + address); }

void Registers::put(uint32_t address, uint32_t value) {
  for (uint32_t i = 0; i < 4; ++i) bytes_[address + i] = static_cast<uint8_t>(value >> (24 - 8 * i));
}

}  // namespace selvedge::sim
