// 64-byte HID reports to a DLPC350 and back: over USB, or over a socket that carries the same reports.
//
// USB: vendor 0x0451, product 0x6401, interface 0, interrupt endpoints taken from the descriptors (on the real
// device 0x01 out, 0x81 in).
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>

namespace selvedge::projector {

inline constexpr size_t report_bytes = 64;
using Report = std::array<std::uint8_t, report_bytes>;

class ReportTransport {
 public:
  virtual ~ReportTransport() = default;
  // Both throw wire::Disconnected where the device is gone.
  virtual void write(const Report& report) = 0;
  virtual std::optional<Report> read(double timeout_s) = 0;
};

// Throw wire::Disconnected where there is no device, or nobody listens.
std::unique_ptr<ReportTransport> open_usb_transport();
std::unique_ptr<ReportTransport> open_socket_transport(const std::filesystem::path& path);

}  // namespace selvedge::projector
