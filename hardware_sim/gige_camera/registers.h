// The camera's register file: GigE Vision bootstrap registers, the camera's own features behind them, and the
// GenICam description that names those. Big-endian, byte addressed, 32-bit aligned.
//
// Reads and writes are checked for address, alignment, permission and range; what a write sets off (a trigger,
// a latch, a test packet) is told to the caller as an Effect.
#pragma once

#include <cstdint>
#include <mutex>
#include <string>
#include <vector>

#include "hardware_sim/gige_camera/gige_camera.h"

namespace selvedge::sim {

// GVCP status codes (low byte of 0x80xx).
enum class GvcpError : uint8_t {
  none = 0x00,
  not_implemented = 0x01,
  invalid_parameter = 0x02,
  invalid_address = 0x03,
  write_protect = 0x04,
  bad_alignment = 0x05,
  access_denied = 0x06,
  invalid_header = 0x0e,
};

// Addresses that the device itself looks at.
namespace reg {
inline constexpr uint32_t kXmlUrl = 0x0200;
inline constexpr uint32_t kHeartbeatTimeout_ms = 0x0938;
inline constexpr uint32_t kTimestampControl = 0x0944;   // 1 reset, 2 latch
inline constexpr uint32_t kTimestampLatched = 0x0948;   // 64 bit
inline constexpr uint32_t kControlPrivilege = 0x0a00;   // 0 free, 1 exclusive, 2 control
inline constexpr uint32_t kStreamPort = 0x0d00;
inline constexpr uint32_t kPacketSize = 0x0d04;         // low 16 bits; bit 31 fires a test packet
inline constexpr uint32_t kPacketDelay = 0x0d08;        // ticks
inline constexpr uint32_t kStreamAddress = 0x0d18;
inline constexpr uint32_t kSourcePort = 0x0d1c;
inline constexpr uint32_t kAcquisitionMode = 0x10020;   // 0 continuous, 1 single frame
inline constexpr uint32_t kAcquisitionStart = 0x10024;
inline constexpr uint32_t kAcquisitionStop = 0x10028;
inline constexpr uint32_t kTriggerMode = 0x1002c;
inline constexpr uint32_t kTriggerSource = 0x10030;     // 0 Line0, 1 software
inline constexpr uint32_t kTriggerSoftware = 0x10038;
inline constexpr uint32_t kFrameRate_hz = 0x10048;      // float64
inline constexpr uint32_t kExposure_us = 0x10050;       // float64
inline constexpr uint32_t kTemperature_degc = 0x10060;  // float64
inline constexpr uint32_t kPtpEnable = 0x10070;
inline constexpr uint32_t kPtpStatus = 0x10074;         // PtpState
inline constexpr uint32_t kPtpLatch = 0x10078;          // takes status and offset over
inline constexpr uint32_t kPtpOffset_ns = 0x10080;      // int64, of the camera from the master
}  // namespace reg

enum class PtpState : uint32_t { disabled = 3, listening = 4, slave = 9 };  // IEEE 1588-2008, table 8

enum class Effect { nothing, latch, reset_clock, ptp_switch, ptp_latch, test_packet, start, stop, software_trigger };

class Registers {
 public:
  explicit Registers(const GigeCameraOptions& options, uint32_t ip_address);

  GvcpError read(uint32_t address, uint8_t* bytes, size_t count) const;
  // 4 bytes or 8 (a float64 feature), from the controlling client.
  GvcpError write(uint32_t address, const uint8_t* bytes, size_t count, Effect& effect);

  uint32_t word(uint32_t address) const;
  double real(uint32_t address) const;
  void set_word(uint32_t address, uint32_t value);
  void set_long(uint32_t address, uint64_t value);

 private:
  void set_text(uint32_t address, size_t size, const std::string& text);
  void set_real(uint32_t address, double value);
  uint32_t get(uint32_t address) const;
  void put(uint32_t address, uint32_t value);
  GvcpError check(uint32_t address, const uint8_t* bytes, size_t count) const;

  mutable std::mutex mutex_;
  std::vector<uint8_t> bytes_;
  uint32_t width_px_, height_px_;
  bool has_ptp_;
};

// The GenICam description of the features above.
std::string genicam_description(bool has_ptp);

}  // namespace selvedge::sim
