#include "hardware_sim/genicam_camera/features.h"

namespace selvedge::sim {

namespace {

constexpr uint32_t kSensorWidth = 0x10000, kSensorHeight = 0x10004, kWidth = 0x10008, kHeight = 0x1000c,
                   kOffsetX = 0x10010, kOffsetY = 0x10014, kPixelFormat = 0x10018, kPayloadSize = 0x1001c,
                   kTriggerActivation = 0x10034, kTriggerSelector = 0x1003c, kFrameRateEnable = 0x10040,
                   kGain_db = 0x10058, kTLParamsLocked = 0x10068;

}  // namespace

void add_features(RegisterFile& registers, const FeatureValues& values) {
  const auto width = static_cast<uint32_t>(values.width_px), height = static_cast<uint32_t>(values.height_px);
  registers.set_word(kSensorWidth, width);
  registers.set_word(kSensorHeight, height);
  registers.set_word(kWidth, width);
  registers.set_word(kHeight, height);
  registers.set_word(kPixelFormat, kMono8);
  registers.set_word(kPayloadSize, width * height);
  registers.set_word(kFrameRateEnable, 1);
  registers.set_word(reg::kTriggerSource, 1);
  registers.set_real(reg::kFrameRate_hz, values.rate_hz);
  registers.set_real(reg::kExposure_us, values.exposure_s * 1e6);
  registers.set_real(reg::kTemperature_degc, values.temperature_degc);

  // The sensor is always read whole.
  registers.allow(kWidth, width, width);
  registers.allow(kHeight, height, height);
  registers.allow(kOffsetX, 0, 0);
  registers.allow(kOffsetY, 0, 0);
  registers.allow(kPixelFormat, kMono8, kMono8);
  registers.allow(reg::kAcquisitionMode, 0, 1);
  registers.allow_command(reg::kAcquisitionStart, 1, 1);
  registers.allow_command(reg::kAcquisitionStop, 1, 1);
  registers.allow(reg::kTriggerMode, 0, 1);
  registers.allow(reg::kTriggerSource, 0, 1);
  registers.allow(kTriggerActivation, 0, 0);  // rising edge
  registers.allow_command(reg::kTriggerSoftware, 1, 1);
  registers.allow(kTriggerSelector, 0, 0);  // frame start
  registers.allow(kFrameRateEnable, 0, 1);
  registers.allow(kTLParamsLocked, 0, 1);
  registers.allow_real(reg::kFrameRate_hz, 0.1, 1000);
  registers.allow_real(reg::kExposure_us, 10, 1e6);
  registers.allow_real(kGain_db, 0, 48);
}

std::string feature_nodes(const Nodes& nodes) {
  std::string xml;
  xml += Nodes::category("ImageFormatControl",
                         {"SensorWidth", "SensorHeight", "Width", "Height", "OffsetX", "OffsetY", "PixelFormat"});
  xml += Nodes::category("AcquisitionControl",
                         {"AcquisitionMode", "AcquisitionStart", "AcquisitionStop", "AcquisitionFrameRateEnable",
                          "AcquisitionFrameRate", "TriggerSelector", "TriggerMode", "TriggerSource",
                          "TriggerActivation", "TriggerSoftware", "ExposureTime", "Gain"});
  xml += nodes.real("DeviceTemperature", reg::kTemperature_degc, "RO", -40, 120, "C");

  xml += nodes.integer("SensorWidth", kSensorWidth, "RO") + nodes.integer("SensorHeight", kSensorHeight, "RO");
  xml += nodes.integer("Width", kWidth, "RW", "<pMin>SensorWidth</pMin><pMax>SensorWidth</pMax><Inc>1</Inc>");
  xml += nodes.integer("Height", kHeight, "RW", "<pMin>SensorHeight</pMin><pMax>SensorHeight</pMax><Inc>1</Inc>");
  xml += nodes.integer("OffsetX", kOffsetX, "RW", "<Min>0</Min><Max>0</Max>");
  xml += nodes.integer("OffsetY", kOffsetY, "RW", "<Min>0</Min><Max>0</Max>");
  xml += nodes.enumeration("PixelFormat", kPixelFormat, {{"Mono8", kMono8}});

  xml += nodes.enumeration("AcquisitionMode", reg::kAcquisitionMode, {{"Continuous", 0}, {"SingleFrame", 1}});
  xml += nodes.command("AcquisitionStart", reg::kAcquisitionStart, 1) +
         nodes.command("AcquisitionStop", reg::kAcquisitionStop, 1);
  xml += nodes.boolean("AcquisitionFrameRateEnable", kFrameRateEnable);
  xml += nodes.real("AcquisitionFrameRate", reg::kFrameRate_hz, "RW", 0.1, 1000, "Hz");
  xml += nodes.enumeration("TriggerSelector", kTriggerSelector, {{"FrameStart", 0}});
  xml += nodes.enumeration("TriggerMode", reg::kTriggerMode, {{"Off", 0}, {"On", 1}});
  xml += nodes.enumeration("TriggerSource", reg::kTriggerSource, {{"Line0", 0}, {"Software", 1}});
  xml += nodes.enumeration("TriggerActivation", kTriggerActivation, {{"RisingEdge", 0}});
  xml += nodes.command("TriggerSoftware", reg::kTriggerSoftware, 1);
  xml += nodes.real("ExposureTime", reg::kExposure_us, "RW", 10, 1e6, "us");
  xml += nodes.real("Gain", kGain_db, "RW", 0, 48, "dB");

  xml += nodes.integer("PayloadSize", kPayloadSize, "RO") +
         nodes.integer("TLParamsLocked", kTLParamsLocked, "RW", "<Min>0</Min><Max>1</Max>");
  return xml;
}

}  // namespace selvedge::sim
