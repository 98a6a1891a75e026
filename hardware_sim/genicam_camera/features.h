// The features that every simulated GenICam camera has (SFNC names): picture, exposure, rate, trigger, temperature.
// Their registers lie from 0x10000 on, in whatever byte order the transport has.
#pragma once

#include <cstdint>
#include <string>

#include "hardware_sim/genicam_camera/nodes.h"
#include "hardware_sim/genicam_camera/register_file.h"

namespace selvedge::sim {

constexpr uint32_t kMono8 = 0x01080001;  // pixel format: 8 bit grey

// Addresses that the sensor itself looks at.
namespace reg {
inline constexpr uint32_t kAcquisitionMode = 0x10020;  // 0 continuous, 1 single frame
inline constexpr uint32_t kAcquisitionStart = 0x10024;
inline constexpr uint32_t kAcquisitionStop = 0x10028;
inline constexpr uint32_t kTriggerMode = 0x1002c;
inline constexpr uint32_t kTriggerSource = 0x10030;  // 0 Line0, 1 software
inline constexpr uint32_t kTriggerSoftware = 0x10038;
inline constexpr uint32_t kFrameRate_hz = 0x10048;      // float64
inline constexpr uint32_t kExposure_us = 0x10050;       // float64
inline constexpr uint32_t kTemperature_degc = 0x10060;  // float64
}  // namespace reg

struct FeatureValues {
  int width_px, height_px;
  double rate_hz, exposure_s, temperature_degc;
};

// Sets the registers to `values` and says what a client may write.
void add_features(RegisterFile& registers, const FeatureValues& values);

// Their nodes, and the categories that hold them: DeviceTemperature belongs to DeviceControl, PayloadSize and
// TLParamsLocked to TransportLayerControl, which the transport describes.
std::string feature_nodes(const Nodes& nodes);

}  // namespace selvedge::sim
