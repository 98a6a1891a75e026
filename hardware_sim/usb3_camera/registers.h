// The camera's register file: technology-agnostic bootstrap registers (ABRM), those of USB3 Vision (SBRM), of its
// stream (SIRM), the manifest, the features of features.h. Little-endian, byte addressed. Sources: GenCP 1.0, USB3
// Vision 1.0.
#pragma once

#include <cstdint>

#include "hardware_sim/genicam_camera/features.h"
#include "hardware_sim/usb3_camera/usb3_camera.h"

namespace selvedge::sim {

constexpr size_t kLargestCommand = 1024;  // bytes of a command or an acknowledge, header and all
constexpr size_t kLeaderBytes = 52, kTrailerBytes = 32;

// Addresses that the device itself looks at, besides those of features.h.
namespace reg {
inline constexpr uint32_t kTimestamp = 0x01f0;  // 64 bit
inline constexpr uint32_t kTimestampLatch = 0x01f8;
inline constexpr uint32_t kStreamControl = 0x18104;  // bit 0: enabled
inline constexpr uint32_t kPayloadSize = 0x1811c;    // bytes of a payload transfer
inline constexpr uint32_t kPayloadCount = 0x18120;   // of them in a frame
inline constexpr uint32_t kTransfer1 = 0x18124;      // bytes of the last ones
inline constexpr uint32_t kTransfer2 = 0x18128;
}  // namespace reg

class Usb3Registers : public RegisterFile {
 public:
  explicit Usb3Registers(const Usb3CameraOptions& options);
};

constexpr const char* kMaker = "Selvedge";
constexpr const char* kModel = "Simulated USB3 camera";

}  // namespace selvedge::sim
