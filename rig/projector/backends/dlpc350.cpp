// TI DLPC350: solid colours and the built-in lines in video mode through the test pattern generator, every
// other pattern as one plane of a flash image in pattern mode, repeated so that TRIG_OUT_1 pulses once a
// showing. Which is which: flash_table.h. Order of commands: TI's API and the LightCrafter 4500 guide.
#include <cmath>
#include <thread>

#include <fmt/format.h>

#include "files/bad_input.h"
#include "rig/clock.h"
#include "rig/projector/backends/dlpc350_commands.h"
#include "rig/projector/flash_table.h"
#include "rig/projector/projector.h"

namespace selvedge::projector {

namespace {

using namespace dlpc350;

constexpr double kModeChange_s = 3;  // how long a mode change or a validation may take
constexpr std::uint8_t kFromFlash = 3, kInternalTrigger = 1, kWhiteLeds = 7, kSequencerLeds = 8;
constexpr std::uint8_t kLutMailbox = 2, kImageMailbox = 1;
constexpr std::uint8_t kSolidPattern = 0, kLinesPattern = 3;

std::vector<std::uint8_t> little_endian(std::uint32_t value, int bytes) {
  std::vector<std::uint8_t> result;
  for (int i = 0; i < bytes; ++i) result.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
  return result;
}

std::unique_ptr<ReportTransport> open_transport(const std::string& transport) {
  if (transport == "usb") return open_usb_transport();
  if (transport.starts_with("unix:")) return open_socket_transport(transport.substr(5));
  refuse("projector transport", "found \"{}\", expected \"usb\" or \"unix:PATH\"", transport);
}

class Dlpc350 final : public Projector {
 public:
  Dlpc350(const ProjectorOptions& options, std::unique_ptr<ReportTransport> transport)
      : options_(options),
        table_(options.flash_table.empty() ? standard_flash_table() : read_flash_table(options.flash_table)),
        link_(std::move(transport), options.reply_timeout_s) {
    const auto version = link_.read(get_version, 16);
    description_ = fmt::format("DLPC350, firmware {}.{}.{}", version[3], version[2], version[0] | version[1] << 8);
    link_.write(pattern_start, {0});
    link_.write(power, {0});
  }

  void show(const Pattern& pattern) override {
    switch (pattern.kind) {
      case PatternKind::off: return darken();
      case PatternKind::solid: return show_test_pattern(kSolidPattern, pattern.inverted ? 0 : pattern.level);
      default:
        if (is_lines(pattern)) return show_test_pattern(kLinesPattern, pattern.level);
        return show_plane(pattern);
    }
  }

  void check() override {
    const auto hardware = link_.read(status_hardware, 1), main = link_.read(status_main, 1);
    // Bit 0 of the hardware status is the initialisation; the rest are errors of controller and DMD.
    if ((hardware[0] & 0x01) == 0) throw ProjectorFault("dlpc350: hardware not initialised");
    if ((hardware[0] & 0x0E) != 0) throw ProjectorFault(fmt::format("dlpc350: hardware status {:#04x}", hardware[0]));
    if (in_sequence_ && (main[0] & 0x02) == 0) throw ProjectorFault("dlpc350: the pattern sequence stopped");
  }

  std::string description() const override { return description_; }

 private:
  bool is_lines(const Pattern& pattern) const {
    if (!table_.lines) return false;
    Pattern wanted = canonical(pattern);
    wanted.level = table_.lines->level;
    return wanted == *table_.lines;
  }

  void darken() {
    stop_sequence();
    link_.write(led_enable, {0});
  }

  void stop_sequence() {
    link_.write(pattern_start, {0});
    in_sequence_ = false;
  }

  void set_mode(std::uint8_t mode) {
    if (link_.read(display_mode, 1)[0] % 2 == mode) return;
    link_.write(display_mode, {mode});
    poll(display_mode, [&](std::uint8_t value) { return value % 2 == mode; });
  }

  template <class Done>
  std::uint8_t poll(const Command& command, Done&& done) {
    const double end_s = rig::host_now_s() + kModeChange_s;
    for (;;) {
      const std::uint8_t value = link_.read(command, 1)[0];
      if (done(value)) return value;
      if (rig::host_now_s() > end_s)
        throw ProjectorFault(
            fmt::format("dlpc350: {} still reads {:#04x} after {} s", command.name, value, kModeChange_s));
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  }

  void show_test_pattern(std::uint8_t number, double level) {
    stop_sequence();
    set_mode(0);
    link_.write(input_source, {1});
    link_.write(test_pattern, {number});
    std::vector<std::uint8_t> colours;  // foreground r, g, b, then background
    const auto bright = static_cast<std::uint32_t>(std::lround(1023 * level));
    for (const std::uint32_t value : {bright, bright, bright, 0U, 0U, 0U})
      for (const auto byte : little_endian(value, 2)) colours.push_back(byte);
    link_.write(test_pattern_colour, colours);
    link_.write(led_enable, {kWhiteLeds});
  }

  void show_plane(const Pattern& pattern) {
    const FlashPlane* plane = table_.find(pattern);
    if (plane == nullptr)
      refuse("projector",
             "no plane of the flash table shows this pattern (orientation {}, period {} px, duty {}, first bright "
             "row {} px, bit {})",
             pattern.orientation == Orientation::horizontal ? "horizontal" : "vertical", pattern.period_px,
             pattern.duty, pattern.first_bright_row_px, pattern.bit);
    if (pattern.level != 1)
      refuse("projector", "a pattern from flash has full brightness, level {} wanted", pattern.level);
    stop_sequence();
    set_mode(1);
    link_.write(pattern_source, {kFromFlash});
    link_.write(pattern_config, {0, 1, 0, 0});  // one entry, repeated, one image; TRIG_OUT_2 at each
    set_exposure();
    link_.write(pattern_trigger, {kInternalTrigger});
    link_.write(led_enable, {kSequencerLeds});
    write_mailbox(kLutMailbox, lut_entry(*plane, pattern.inverted != plane->pattern.inverted));
    write_mailbox(kImageMailbox, {static_cast<std::uint8_t>(plane->image)});
    start_validated();
  }

  void set_exposure() {
    const auto microseconds = static_cast<std::uint32_t>(std::lround(options_.exposure_s * 1e6));
    std::vector<std::uint8_t> times = little_endian(microseconds, 4);
    for (const auto byte : little_endian(microseconds, 4)) times.push_back(byte);
    link_.write(exposure_period, times);
  }

  static std::vector<std::uint8_t> lut_entry(const FlashPlane& plane, bool inverted) {
    const std::uint32_t depth = 1, buffer_swap = 1;
    return little_endian(static_cast<std::uint32_t>(plane.plane) << 2 | depth << 8 | std::uint32_t{kWhiteLeds} << 12 |
                             (inverted ? 1U << 16 : 0U) | buffer_swap << 18,
                         3);
  }

  void write_mailbox(std::uint8_t mailbox, const std::vector<std::uint8_t>& data) {
    link_.write(mailbox_open, {mailbox});
    link_.write(mailbox_address, {0});
    link_.write(mailbox_data, data);
    link_.write(mailbox_open, {0});
  }

  void start_validated() {
    link_.write(validate, {0});
    const std::uint8_t verdict = poll(validate, [](std::uint8_t value) { return (value & 0x80) == 0; });
    constexpr std::uint8_t kErrors = 0x01 | 0x02 | 0x10;  // exposure or period, pattern number, period − exposure
    if ((verdict & kErrors) != 0)
      throw ProjectorFault(fmt::format("dlpc350: sequence not valid, status {:#04x}", verdict));
    link_.write(pattern_start, {2});
    poll(status_main, [](std::uint8_t value) { return (value & 0x02) != 0; });
    in_sequence_ = true;
  }

  ProjectorOptions options_;
  FlashTable table_;
  Link link_;
  std::string description_;
  bool in_sequence_ = false;
};

}  // namespace

std::unique_ptr<Projector> open_dlpc350(const ProjectorOptions& options) {
  return dlpc350::open_over(open_transport(options.transport), options);
}

std::unique_ptr<Projector> dlpc350::open_over(std::unique_ptr<ReportTransport> transport,
                                              const ProjectorOptions& options) {
  return std::make_unique<Dlpc350>(options, std::move(transport));
}

}  // namespace selvedge::projector
