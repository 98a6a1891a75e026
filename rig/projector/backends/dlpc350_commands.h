// The DLPC350's command link: messages of up to 512 bytes in 64-byte reports, each answered.
//
// A message is {flags, sequence, u16 length, CMD3, CMD2, data…}; length counts from CMD3. What does not fit
// into the first report follows in reports without header. An answer has the same four header bytes, then its
// payload; flag bit 5 says that the command was rejected.
// Source: TI DLPU010F and TI's own API (dlpc350_usb.cpp, BSD), as noted in docs/devices.md.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <memory>
#include <string>
#include <vector>

#include "rig/projector/backends/report_transport.h"
#include "rig/projector/projector.h"

namespace selvedge::projector::dlpc350 {

// CMD2 << 8 | CMD3, with the name for error texts.
struct Command {
  std::uint16_t code;
  const char* name;
};

inline constexpr Command get_version{0x0205, "get version"}, status_hardware{0x1A0A, "hardware status"},
    status_system{0x1A0B, "system status"}, status_main{0x1A0C, "main status"}, power{0x0200, "power mode"},
    input_source{0x1A00, "input source"}, test_pattern{0x1203, "test pattern"},
    test_pattern_colour{0x1204, "test pattern colour"}, led_enable{0x1A07, "LED enable"},
    display_mode{0x1A1B, "display mode"}, pattern_source{0x1A22, "pattern source"},
    pattern_trigger{0x1A23, "pattern trigger mode"}, pattern_start{0x1A24, "pattern start/stop"},
    exposure_period{0x1A29, "exposure and period"}, pattern_config{0x1A31, "pattern configuration"},
    mailbox_address{0x1A32, "mailbox address"}, mailbox_open{0x1A33, "mailbox open"},
    mailbox_data{0x1A34, "mailbox data"}, validate{0x1A1A, "validate"};

class Link {
 public:
  Link(std::unique_ptr<ReportTransport> transport, double reply_timeout_s)
      : transport_(std::move(transport)), reply_timeout_s_(reply_timeout_s) {}

  // Throws ProjectorFault naming the command where the device rejects it, wire::Disconnected where it does not
  // answer.
  void write(const Command& command, const std::vector<std::uint8_t>& data);
  // At least least_bytes of payload.
  std::vector<std::uint8_t> read(const Command& command, size_t least_bytes);

 private:
  void send(std::uint8_t flags, const Command& command, const std::vector<std::uint8_t>& data);
  std::vector<std::uint8_t> reply(const Command& command);

  std::unique_ptr<ReportTransport> transport_;
  double reply_timeout_s_;
  std::uint8_t sequence_ = 0;
};

// The projector at the other end of a transport, whichever options.transport names. Throws as Link does.
std::unique_ptr<Projector> open_over(std::unique_ptr<ReportTransport> transport, const ProjectorOptions& options);

}  // namespace selvedge::projector::dlpc350
