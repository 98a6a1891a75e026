// The camera's register file: GigE Vision bootstrap registers, the camera's own features behind them, and the
// GenICam description that names those. Big-endian, byte addressed, 32-bit aligned.
//
// What a write sets off (a trigger, a latch, a test packet) is told to the caller as an Effect.
#pragma once

#include <cstdint>
#include <string>

#include "hardware_sim/genicam_camera/features.h"
#include "hardware_sim/genicam_camera/register_file.h"
#include "hardware_sim/gige_camera/gige_camera.h"

namespace selvedge::sim {

// Addresses that the device itself looks at, besides those of features.h.
namespace reg {
inline constexpr uint32_t kXmlUrl = 0x0200;
inline constexpr uint32_t kHeartbeatTimeout_ms = 0x0938;
inline constexpr uint32_t kTimestampControl = 0x0944;  // 1 reset, 2 latch
inline constexpr uint32_t kTimestampLatched = 0x0948;  // 64 bit
inline constexpr uint32_t kControlPrivilege = 0x0a00;  // 0 free, 1 exclusive, 2 control
inline constexpr uint32_t kStreamPort = 0x0d00;
inline constexpr uint32_t kPacketSize = 0x0d04;   // low 16 bits; bit 31 fires a test packet
inline constexpr uint32_t kPacketDelay = 0x0d08;  // ticks
inline constexpr uint32_t kStreamAddress = 0x0d18;
inline constexpr uint32_t kSourcePort = 0x0d1c;
inline constexpr uint32_t kPtpEnable = 0x10070;
inline constexpr uint32_t kPtpStatus = 0x10074;     // PtpState
inline constexpr uint32_t kPtpLatch = 0x10078;      // takes status and offset over
inline constexpr uint32_t kPtpOffset_ns = 0x10080;  // int64, of the camera from the master
}  // namespace reg

enum class PtpState : uint32_t { disabled = 3, listening = 4, slave = 9 };  // IEEE 1588-2008, table 8

enum class Effect { nothing, latch, reset_clock, ptp_switch, ptp_latch, test_packet, start, stop, software_trigger };

class Registers : public RegisterFile {
 public:
  explicit Registers(const GigeCameraOptions& options, uint32_t ip_address);

  // From the controlling client.
  AccessError write(uint32_t address, const uint8_t* bytes, size_t count, Effect& effect);
};

// The GenICam description of the features above.
std::string genicam_description(bool has_ptp);

}  // namespace selvedge::sim
