// A simulated DLPC350: the registers that its command link reaches, what is on the mirrors, and TRIG_OUT_1.
//
// It rejects (NACK) unknown commands, data of the wrong length, configuration while a sequence runs, a start
// without validation, and everything but power and status in standby. A change of display mode and a
// validation take their time. Its flash holds the pictures of the flash table, as a lab would have burnt them.
// Reports go in and out as 64-byte arrays, so that a socket or an emulated USB bus can carry them.
// Written from the protocol's description, not from the driver.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <vector>

#include "rig/projector/backends/report_transport.h"
#include "rig/projector/flash_table.h"
#include "rig/projector/pattern.h"

namespace selvedge::hardware_sim {

struct Dlpc350Options {
  projector::FlashTable flash = projector::standard_flash_table();
  projector::Pattern lines{.kind = projector::PatternKind::stripes,
                           .period_px = 16};  // test pattern 3, where the flash table does not say
  double mode_change_s = 0.05;
  double validation_s = 0.02;
};

// A sequence as it runs: picture i of n shows from start_s + (k·n + i)·period_s for exposure_s, k = 0, 1, 2 …
struct RunningSequence {
  std::vector<projector::Pattern> pictures;
  double start_s = 0, exposure_s = 0, period_s = 0;
  bool repeat = true;
  double trigger_delay_s = 0;  // of TRIG_OUT_1's rising edge
};

class Dlpc350Device {
 public:
  explicit Dlpc350Device(const Dlpc350Options& options) : options_(options) {}

  // One report from the host at host time now_s; the reports of the answer, if the message is complete.
  std::vector<projector::Report> on_report(const projector::Report& report, double now_s);

  // What is on the mirrors at host time t, which may lie some seconds back.
  projector::Pattern pattern_at(double host_time_s) const;
  // The sequence that runs now.
  std::optional<RunningSequence> running() const;
  // The next `count` commands are rejected whatever they are.
  void reject_next(int count);
  std::int64_t rejected() const;

 private:
  using Bytes = std::vector<std::uint8_t>;
  std::vector<projector::Report> answer(double now_s);
  std::optional<Bytes> read_register(std::uint16_t code, double now_s) const;
  bool write_register(std::uint16_t code, const Bytes& data, double now_s);
  bool write_display_mode(std::uint8_t mode, double now_s);
  bool write_mailbox(const Bytes& data);
  bool start_or_stop(std::uint8_t what, double now_s);
  std::uint8_t validate() const;
  std::vector<projector::Pattern> sequence_pictures() const;
  projector::Pattern lut_picture(std::uint32_t entry, int image) const;
  projector::Pattern still_picture() const;
  void note_picture(double now_s);
  int display_mode(double now_s) const;
  std::uint32_t field(std::uint16_t code, size_t at, size_t bytes) const;  // 0 where nothing was written

  // What the mirrors showed since when: a still picture or a sequence.
  struct Shown {
    double since_s = 0;
    projector::Pattern still;
    std::optional<RunningSequence> sequence;
  };

  const Dlpc350Options options_;
  mutable std::mutex mutex_;
  Bytes incoming_;  // of a message that is not complete yet
  std::map<std::uint16_t, Bytes> registers_;
  Bytes lut_, images_;
  int mailbox_ = 0;
  size_t mailbox_address_ = 0;
  int mode_before_ = 0;
  double mode_since_s_ = -1e9;
  std::uint8_t validation_ = 0;
  bool validated_ = false;  // nothing was configured since the validation
  double validation_done_s_ = 0;
  std::optional<RunningSequence> running_;
  std::deque<Shown> shown_;
  int reject_next_ = 0;
  std::int64_t rejected_ = 0;
};

}  // namespace selvedge::hardware_sim
