#include "hardware_sim/gige_camera/registers.h"

#include <algorithm>

#include <fmt/format.h>

namespace selvedge::sim {

namespace {

constexpr uint32_t kXmlAddress = 0x20000;
constexpr size_t kMemoryBytes = 0x30000, kAlignmentBytes = 4;
constexpr uint32_t kAny = 0xffffffff;

}  // namespace

Registers::Registers(const GigeCameraOptions& options, uint32_t ip_address)
    : RegisterFile(ByteOrder::big, kMemoryBytes, kAlignmentBytes) {
  set_word(0x0000, 0x00010002);  // GigE Vision 1.2
  set_word(0x0004, 0x80000001);  // big-endian, UTF-8
  set_word(0x0008, 0x00000200);  // MAC address, locally administered
  set_word(0x000c, ip_address);
  set_word(0x0010, 0x00000005);  // IP configuration: persistent, link-local
  set_word(0x0014, 0x00000001);
  set_word(0x0024, ip_address);
  set_word(0x0034, 0xff000000);
  set_text(0x0048, 32, "Selvedge");
  set_text(0x0068, 32, "Simulated GigE camera");
  set_text(0x0088, 32, "1.0");
  set_text(0x00a8, 48, "simulated device on a loopback address");
  set_text(0x00d8, 16, options.serial);
  const std::string xml = genicam_description(options.has_ptp);
  set_text(kXmlAddress, kMemoryBytes - kXmlAddress, xml);
  set_text(reg::kXmlUrl, 512, fmt::format("Local:selvedge.xml;{:X};{:X}", kXmlAddress, xml.size()));
  set_word(0x0600, 1);                                  // network interfaces
  set_word(0x0904, 1);                                  // stream channels
  set_word(0x0934, 1u << 30 | 1u << 2 | 1u << 1 | 1u);  // serial number, packet resend, write memory, concatenation
  set_word(reg::kHeartbeatTimeout_ms, 3000);
  set_word(0x0940, 1000000000);  // time-stamp ticks per second
  set_word(reg::kPacketSize, 1500);
  allow(reg::kHeartbeatTimeout_ms, 500, kAny);
  allow_command(reg::kTimestampControl, 1, 2);
  allow(reg::kControlPrivilege, 0, 3);
  allow(reg::kStreamPort, 0, 0xffff);
  allow(reg::kPacketSize, 0, kAny);
  allow(reg::kPacketDelay, 0, kAny);
  allow(reg::kStreamAddress, 0, kAny);

  add_features(*this,
               {options.width_px, options.height_px, options.rate_hz, options.exposure_s, options.temperature_degc});
  set_word(reg::kPtpStatus, static_cast<uint32_t>(PtpState::disabled));
  if (!options.has_ptp) return;
  allow(reg::kPtpEnable, 0, 1);
  allow_command(reg::kPtpLatch, 1, 1);
}

AccessError Registers::write(uint32_t address, const uint8_t* bytes, size_t count, Effect& effect) {
  effect = Effect::nothing;
  const uint32_t before = address == reg::kPtpEnable ? word(address) : 0;
  const AccessError error = RegisterFile::write(address, bytes, count);
  if (error != AccessError::none || count != 4) return error;
  const uint32_t value = word_of(bytes);
  switch (address) {
    case reg::kTimestampControl: effect = value == 2 ? Effect::latch : Effect::reset_clock; break;
    case reg::kAcquisitionStart: effect = Effect::start; break;
    case reg::kAcquisitionStop: effect = Effect::stop; break;
    case reg::kTriggerSoftware: effect = Effect::software_trigger; break;
    case reg::kPtpLatch: effect = Effect::ptp_latch; break;
    case reg::kPtpEnable:
      if (before != value) effect = Effect::ptp_switch;
      break;
    case reg::kPacketSize:
      // Bounds of a jumbo frame on loopback; the flags stay as written except for the command bit.
      set_word(address, (value & 0x60000000) | std::clamp<uint32_t>(value & 0xffff, 576, 16384));
      if (value & 0x80000000) effect = Effect::test_packet;
      break;
    default: break;
  }
  return AccessError::none;
}

std::string genicam_description(bool has_ptp) {
  const Nodes nodes(ByteOrder::big);
  std::string xml;
  xml +=
      Nodes::category("Root", {"DeviceControl", "ImageFormatControl", "AcquisitionControl", "TransportLayerControl"});
  xml += Nodes::category("DeviceControl", {"DeviceVendorName", "DeviceModelName", "DeviceVersion", "DeviceID",
                                           "DeviceSerialNumber", "DeviceTemperature"});
  if (has_ptp)
    xml += Nodes::category("PtpControl", {"PtpEnable", "PtpDataSetLatch", "PtpStatus", "PtpOffsetFromMaster"});
  xml += Nodes::category("TransportLayerControl",
                         {"PayloadSize", "TLParamsLocked", "GevSCPSPacketSize", "GevSCPSFireTestPacket", "GevSCPD",
                          "GevSCPHostPort", "GevSCDA", "GevHeartbeatTimeout", "GevTimestampTickFrequency",
                          "GevTimestampControlLatch", "GevTimestampControlReset", "GevTimestampValue"});
  xml += nodes.text("DeviceVendorName", 0x48, 32) + nodes.text("DeviceModelName", 0x68, 32) +
         nodes.text("DeviceVersion", 0x88, 32) + nodes.text("DeviceID", 0xd8, 16) +
         nodes.text("DeviceSerialNumber", 0xd8, 16);
  xml += feature_nodes(nodes);

  xml +=
      nodes.masked_integer("GevSCPSPacketSize", reg::kPacketSize, 31, 16, "<Min>576</Min><Max>16384</Max><Inc>4</Inc>");
  xml += nodes.masked_command("GevSCPSFireTestPacket", reg::kPacketSize, 0);
  xml += nodes.integer("GevSCPD", reg::kPacketDelay, "RW") + nodes.integer("GevSCPHostPort", reg::kStreamPort, "RW") +
         nodes.integer("GevSCDA", reg::kStreamAddress, "RW") +
         nodes.integer("GevHeartbeatTimeout", reg::kHeartbeatTimeout_ms, "RW");
  xml += nodes.integer("GevTimestampTickFrequency", 0x93c, "RO", "", 8);
  xml += nodes.command("GevTimestampControlLatch", reg::kTimestampControl, 2) +
         nodes.command("GevTimestampControlReset", reg::kTimestampControl, 1);
  xml += nodes.integer("GevTimestampValue", reg::kTimestampLatched, "RO", "", 8);
  if (has_ptp) {
    const auto entry = [](const char* name, PtpState state) { return std::pair(name, static_cast<uint32_t>(state)); };
    xml += nodes.boolean("PtpEnable", reg::kPtpEnable) + nodes.command("PtpDataSetLatch", reg::kPtpLatch, 1);
    xml += nodes.enumeration("PtpStatus", reg::kPtpStatus,
                             {{"Initializing", 1},
                              {"Faulty", 2},
                              entry("Disabled", PtpState::disabled),
                              entry("Listening", PtpState::listening),
                              {"PreMaster", 5},
                              {"Master", 6},
                              {"Passive", 7},
                              {"Uncalibrated", 8},
                              entry("Slave", PtpState::slave)},
                             "RO");
    xml += nodes.integer("PtpOffsetFromMaster", reg::kPtpOffset_ns, "RO", "<Unit>ns</Unit>", 8);
  }
  return Nodes::description("SimulatedGigE", "GEV", xml);
}

}  // namespace selvedge::sim
