// The GenICam description that the simulated camera hands to its clients. Node types and their elements follow
// the GenICam standard 2.0, schema 1.0; addresses are those of registers.h.
#include <fmt/format.h>

#include "hardware_sim/gige_camera/registers.h"

namespace selvedge::sim {

namespace {

std::string register_body(uint32_t address, int length, const char* access) {
  return fmt::format("<Address>0x{:X}</Address><Length>{}</Length><AccessMode>{}</AccessMode><pPort>Device</pPort>",
                     address, length, access);
}

std::string integer_register(const char* name, uint32_t address, int length, const char* access) {
  return fmt::format("<IntReg Name=\"{}\">{}<Cachable>NoCache</Cachable><Sign>Unsigned</Sign><Endianess>BigEndian</Endianess></IntReg>\n", name,
                     register_body(address, length, access));
}

std::string text(const char* name, uint32_t address, int length) {
  return fmt::format("<StringReg Name=\"{}\">{}</StringReg>\n", name, register_body(address, length, "RO"));
}

std::string integer(const char* name, uint32_t address, const char* access, const std::string& bounds = "",
                    int length = 4) {
  const std::string value = fmt::format("{}Register", name);
  return fmt::format("<Integer Name=\"{}\" NameSpace=\"Standard\"><pValue>{}</pValue>{}</Integer>\n", name, value,
                     bounds) +
         integer_register(value.c_str(), address, length, access);
}

std::string real(const char* name, uint32_t address, const char* access, double least, double most,
                 const char* unit) {
  return fmt::format(
      "<Float Name=\"{0}\" NameSpace=\"Standard\"><Unit>{4}</Unit><pValue>{0}Register</pValue><Min>{2}</Min>"
      "<Max>{3}</Max></Float>\n"
      "<FloatReg Name=\"{0}Register\">{1}<Cachable>NoCache</Cachable><Endianess>BigEndian</Endianess></FloatReg>\n",
      name, register_body(address, 8, access), least, most, unit);
}

std::string boolean(const char* name, uint32_t address) {
  return fmt::format(
             "<Boolean Name=\"{0}\" NameSpace=\"Standard\"><pValue>{0}Register</pValue><OnValue>1</OnValue>"
             "<OffValue>0</OffValue></Boolean>\n",
             name) +
         integer_register(fmt::format("{}Register", name).c_str(), address, 4, "RW");
}

std::string command(const char* name, uint32_t address, int value) {
  return fmt::format(
             "<Command Name=\"{0}\" NameSpace=\"Standard\"><pValue>{0}Register</pValue>"
             "<CommandValue>{1}</CommandValue></Command>\n",
             name, value) +
         integer_register(fmt::format("{}Register", name).c_str(), address, 4, "WO");
}

struct Entry {
  const char* name;
  uint32_t value;
};

std::string enumeration(const char* name, uint32_t address, std::initializer_list<Entry> entries, const char* access = "RW") {
  std::string result = fmt::format("<Enumeration Name=\"{}\" NameSpace=\"Standard\">", name);
  for (const Entry& entry : entries)
    result += fmt::format("<EnumEntry Name=\"{}\"><Value>{}</Value></EnumEntry>", entry.name, entry.value);
  result += fmt::format("<pValue>{}Register</pValue></Enumeration>\n", name);
  return result + integer_register(fmt::format("{}Register", name).c_str(), address, 4, access);
}

std::string category(const char* name, std::initializer_list<const char*> features) {
  std::string result = fmt::format("<Category Name=\"{}\" NameSpace=\"Standard\">", name);
  for (const char* feature : features) result += fmt::format("<pFeature>{}</pFeature>", feature);
  return result + "</Category>\n";
}

}  // namespace

std::string genicam_description(bool has_ptp) {
  std::string xml =
      "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n"
      "<RegisterDescription ModelName=\"SimulatedGigE\" VendorName=\"Selvedge\" StandardNameSpace=\"GEV\" "
      "SchemaMajorVersion=\"1\" SchemaMinorVersion=\"0\" SchemaSubMinorVersion=\"1\" MajorVersion=\"1\" "
      "MinorVersion=\"0\" SubMinorVersion=\"0\" ProductGuid=\"0\" VersionGuid=\"0\" "
      "xmlns=\"http://www.genicam.org/GenApi/Version_1_0\">\n";
  xml += category("Root", {"DeviceControl", "ImageFormatControl", "AcquisitionControl", "TransportLayerControl"});
  xml += category("DeviceControl", {"DeviceVendorName", "DeviceModelName", "DeviceVersion", "DeviceID",
                                    "DeviceSerialNumber", "DeviceTemperature"});
  xml += category("ImageFormatControl", {"SensorWidth", "SensorHeight", "Width", "Height", "OffsetX", "OffsetY",
                                         "PixelFormat"});
  xml += category("AcquisitionControl",
                  {"AcquisitionMode", "AcquisitionStart", "AcquisitionStop", "AcquisitionFrameRateEnable",
                   "AcquisitionFrameRate", "TriggerSelector", "TriggerMode", "TriggerSource", "TriggerActivation",
                   "TriggerSoftware", "ExposureTime", "Gain"});
  if (has_ptp) xml += category("PtpControl", {"PtpEnable", "PtpDataSetLatch", "PtpStatus", "PtpOffsetFromMaster"});
  xml += category("TransportLayerControl",
                  {"PayloadSize", "TLParamsLocked", "GevSCPSPacketSize", "GevSCPSFireTestPacket", "GevSCPD",
                   "GevSCPHostPort", "GevSCDA", "GevHeartbeatTimeout", "GevTimestampTickFrequency",
                   "GevTimestampControlLatch", "GevTimestampControlReset", "GevTimestampValue"});

  xml += text("DeviceVendorName", 0x48, 32) + text("DeviceModelName", 0x68, 32) + text("DeviceVersion", 0x88, 32) +
         text("DeviceID", 0xd8, 16) + text("DeviceSerialNumber", 0xd8, 16);
  xml += real("DeviceTemperature", reg::kTemperature_degc, "RO", -40, 120, "C");

  xml += integer("SensorWidth", 0x10000, "RO") + integer("SensorHeight", 0x10004, "RO");
  xml += integer("Width", 0x10008, "RW", "<pMin>SensorWidth</pMin><pMax>SensorWidth</pMax><Inc>1</Inc>");
  xml += integer("Height", 0x1000c, "RW", "<pMin>SensorHeight</pMin><pMax>SensorHeight</pMax><Inc>1</Inc>");
  xml += integer("OffsetX", 0x10010, "RW", "<Min>0</Min><Max>0</Max>");
  xml += integer("OffsetY", 0x10014, "RW", "<Min>0</Min><Max>0</Max>");
  xml += enumeration("PixelFormat", 0x10018, {{"Mono8", 0x01080001}});

  xml += enumeration("AcquisitionMode", reg::kAcquisitionMode, {{"Continuous", 0}, {"SingleFrame", 1}});
  xml += command("AcquisitionStart", reg::kAcquisitionStart, 1) + command("AcquisitionStop", reg::kAcquisitionStop, 1);
  xml += boolean("AcquisitionFrameRateEnable", 0x10040);
  xml += real("AcquisitionFrameRate", reg::kFrameRate_hz, "RW", 0.1, 1000, "Hz");
  xml += enumeration("TriggerSelector", 0x1003c, {{"FrameStart", 0}});
  xml += enumeration("TriggerMode", reg::kTriggerMode, {{"Off", 0}, {"On", 1}});
  xml += enumeration("TriggerSource", reg::kTriggerSource, {{"Line0", 0}, {"Software", 1}});
  xml += enumeration("TriggerActivation", 0x10034, {{"RisingEdge", 0}});
  xml += command("TriggerSoftware", reg::kTriggerSoftware, 1);
  xml += real("ExposureTime", reg::kExposure_us, "RW", 10, 1e6, "us");
  xml += real("Gain", 0x10058, "RW", 0, 48, "dB");

  xml += integer("PayloadSize", 0x1001c, "RO") + integer("TLParamsLocked", 0x10068, "RW", "<Min>0</Min><Max>1</Max>");
  xml += fmt::format("<MaskedIntReg Name=\"GevSCPSPacketSizeRegister\">{}<Cachable>NoCache</Cachable><LSB>31</LSB><MSB>16</MSB>"
                     "<Sign>Unsigned</Sign><Endianess>BigEndian</Endianess></MaskedIntReg>\n"
                     "<Integer Name=\"GevSCPSPacketSize\"><pValue>GevSCPSPacketSizeRegister</pValue><Min>576</Min>"
                     "<Max>16384</Max><Inc>4</Inc></Integer>\n",
                     register_body(reg::kPacketSize, 4, "RW"));
  xml += fmt::format("<MaskedIntReg Name=\"GevSCPSFireTestPacketRegister\">{}<Cachable>NoCache</Cachable><Bit>0</Bit><Sign>Unsigned</Sign>"
                     "<Endianess>BigEndian</Endianess></MaskedIntReg>\n"
                     "<Command Name=\"GevSCPSFireTestPacket\"><pValue>GevSCPSFireTestPacketRegister</pValue>"
                     "<CommandValue>1</CommandValue></Command>\n",
                     register_body(reg::kPacketSize, 4, "RW"));
  xml += integer("GevSCPD", reg::kPacketDelay, "RW") + integer("GevSCPHostPort", reg::kStreamPort, "RW") +
         integer("GevSCDA", reg::kStreamAddress, "RW") + integer("GevHeartbeatTimeout", reg::kHeartbeatTimeout_ms, "RW");
  xml += integer("GevTimestampTickFrequency", 0x93c, "RO", "", 8);
  xml += command("GevTimestampControlLatch", reg::kTimestampControl, 2) +
         command("GevTimestampControlReset", reg::kTimestampControl, 1);
  xml += integer("GevTimestampValue", reg::kTimestampLatched, "RO", "", 8);
  if (has_ptp) {
    const auto entry = [](const char* name, PtpState state) { return Entry{name, static_cast<uint32_t>(state)}; };
    xml += boolean("PtpEnable", reg::kPtpEnable) + command("PtpDataSetLatch", reg::kPtpLatch, 1);
    xml += enumeration("PtpStatus", reg::kPtpStatus,
                       {{"Initializing", 1}, {"Faulty", 2}, entry("Disabled", PtpState::disabled), entry("Listening", PtpState::listening),
                        {"PreMaster", 5}, {"Master", 6}, {"Passive", 7}, {"Uncalibrated", 8}, entry("Slave", PtpState::slave)},
                       "RO");
    xml += integer("PtpOffsetFromMaster", reg::kPtpOffset_ns, "RO", "<Unit>ns</Unit>", 8);
  }
  return xml + "<Port Name=\"Device\" NameSpace=\"Standard\"></Port>\n</RegisterDescription>\n";
}

}  // namespace selvedge::sim
