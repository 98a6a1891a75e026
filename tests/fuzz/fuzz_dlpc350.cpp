// A DLPC350 that answers anything: its link alone, or the projector behind it.
#include <algorithm>
#include <span>

#include "files/bad_input.h"
#include "rig/projector/backends/dlpc350_commands.h"
#include "rig/projector/projector.h"
#include "rig/wire/socket.h"

using namespace selvedge;
using namespace selvedge::projector;

namespace {

// Reports from the input, the last one filled up with zeros. numbered: each with the number of the command that was
// sent last, which the link asks for first.
class Answers final : public ReportTransport {
 public:
  Answers(std::span<const uint8_t> bytes, bool numbered) : left_(bytes), numbered_(numbered) {}
  void write(const Report& report) override { sequence_ = report[1]; }
  std::optional<Report> read(double) override {
    if (left_.empty()) return std::nullopt;
    Report report{};
    const size_t count = std::min(report.size(), left_.size());
    std::copy_n(left_.begin(), count, report.begin());
    left_ = left_.subspan(count);
    if (numbered_) report[1] = sequence_;
    return report;
  }

 private:
  std::span<const uint8_t> left_;
  bool numbered_;
  uint8_t sequence_ = 0;
};

void ask_link(std::unique_ptr<ReportTransport> answers) {
  dlpc350::Link link(std::move(answers), 1);
  for (;;) {
    link.read(dlpc350::get_version, 16);
    link.write(dlpc350::power, {0});
    link.read(dlpc350::status_main, 1);
  }
}

void use_projector(std::unique_ptr<ReportTransport> answers) {
  const auto projector = dlpc350::open_over(std::move(answers), {.reply_timeout_s = 1});
  projector->check();
  projector->show({.kind = PatternKind::solid});
  projector->show({.kind = PatternKind::stripes, .period_px = 16});
  projector->check();
}

}  // namespace

// The first byte: bit 0 numbers the answers, bit 1 asks the link alone.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size < 1) return 0;
  auto answers = std::make_unique<Answers>(std::span(data + 1, size - 1), (data[0] & 1) != 0);
  try {
    if ((data[0] & 2) != 0) ask_link(std::move(answers));
    else use_projector(std::move(answers));
  } catch (const ProjectorFault&) {
  } catch (const wire::Disconnected&) {}
  return 0;
}
