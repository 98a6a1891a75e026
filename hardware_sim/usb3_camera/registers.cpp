#include "hardware_sim/usb3_camera/registers.h"

namespace selvedge::sim {

namespace {

constexpr uint32_t kSbrm = 0x18000, kSirm = 0x18100, kManifest = 0x19000, kXml = 0x20000;
constexpr size_t kMemoryBytes = 0x30000, kAlignmentBytes = 1;
constexpr uint32_t kAny = 0xffffffff, kVersion1_0 = 0x00010000, kSuperSpeed = 8;
constexpr uint64_t kHasTimestamp = 1u << 3, kHasSbrm = 1u << 9;

std::string description() {
  const Nodes nodes(ByteOrder::little);
  std::string xml;
  xml +=
      Nodes::category("Root", {"DeviceControl", "ImageFormatControl", "AcquisitionControl", "TransportLayerControl"});
  xml += Nodes::category("DeviceControl", {"DeviceVendorName", "DeviceModelName", "DeviceVersion", "DeviceSerialNumber",
                                           "DeviceTemperature", "TimestampLatch", "TimestampLatchValue"});
  xml += Nodes::category("TransportLayerControl", {"PayloadSize", "TLParamsLocked"});
  xml += nodes.text("DeviceVendorName", 0x04, 64) + nodes.text("DeviceModelName", 0x44, 64) +
         nodes.text("DeviceVersion", 0xc4, 64) + nodes.text("DeviceSerialNumber", 0x144, 64);
  xml += nodes.command("TimestampLatch", reg::kTimestampLatch, 1) +
         nodes.integer("TimestampLatchValue", reg::kTimestamp, "RO", "<Unit>ns</Unit>", 8);
  return Nodes::description("SimulatedUSB3", "U3V", xml + feature_nodes(nodes));
}

}  // namespace

Usb3Registers::Usb3Registers(const Usb3CameraOptions& options)
    : RegisterFile(ByteOrder::little, kMemoryBytes, kAlignmentBytes) {
  set_word(0x0000, kVersion1_0);  // GenCP
  set_text(0x0004, 64, kMaker);
  set_text(0x0044, 64, kModel);
  set_text(0x00c4, 64, "1.0");
  set_text(0x0104, 64, "simulated device on an emulated bus");
  set_text(0x0144, 64, options.serial);
  set_long(0x01c4, kHasTimestamp | kHasSbrm);
  set_word(0x01cc, 1000);  // the longest response, ms
  set_long(0x01d0, kManifest);
  set_long(0x01d8, kSbrm);
  set_long(0x01fc, 1);  // ns of a time stamp's increment
  allow_command(reg::kTimestampLatch, 1, 1);

  set_word(kSbrm + 0x00, kVersion1_0);  // USB3 Vision
  set_long(kSbrm + 0x04, 1);            // there is a SIRM
  set_word(kSbrm + 0x14, kLargestCommand);
  set_word(kSbrm + 0x18, kLargestCommand);
  set_word(kSbrm + 0x1c, 1);  // stream channels
  set_long(kSbrm + 0x20, kSirm);
  set_word(kSbrm + 0x28, 0x30);  // bytes of the SIRM
  set_word(kSbrm + 0x40, kSuperSpeed);

  const auto payload = static_cast<uint64_t>(options.width_px) * static_cast<uint64_t>(options.height_px);
  set_word(kSirm + 0x00, 0);        // payload transfers need no alignment
  set_long(kSirm + 0x08, payload);  // what the stream requires: payload, leader, trailer
  set_word(kSirm + 0x10, kLeaderBytes);
  set_word(kSirm + 0x14, kTrailerBytes);
  allow(reg::kStreamControl, 0, 1);
  for (uint32_t size = kSirm + 0x18; size <= kSirm + 0x2c; size += 4) allow(size, 0, kAny);

  const std::string xml = description();
  set_long(kManifest, 1);  // entries: version, schema 1.1 uncompressed, address, size
  set_word(kManifest + 0x08, kVersion1_0);
  set_word(kManifest + 0x0c, 0x01010000);
  set_long(kManifest + 0x10, kXml);
  set_long(kManifest + 0x18, xml.size());
  set_text(kXml, kMemoryBytes - kXml, xml);

  add_features(*this,
               {options.width_px, options.height_px, options.rate_hz, options.exposure_s, options.temperature_degc});
}

}  // namespace selvedge::sim
