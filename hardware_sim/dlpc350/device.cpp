#include "hardware_sim/dlpc350/device.h"

#include <algorithm>
#include <cmath>

namespace selvedge::hardware_sim {

namespace {

using projector::Pattern;
using projector::PatternKind;
using projector::Report;

constexpr double kHistory_s = 20;
constexpr size_t kHeader = 4, kLongestMessage = 512, kLutEntry = 3, kLutEntries = 128, kImages = 64;
constexpr double kTriggerStep_s = 107.2e-9;
constexpr int kTriggerZero = 0xBB;

enum : std::uint16_t {
  kPower = 0x0200,
  kReset = 0x0802,
  kVersion = 0x0205,
  kLedCurrent = 0x0B01,
  kTestPattern = 0x1203,
  kTestColour = 0x1204,
  kSource = 0x1A00,
  kLeds = 0x1A07,
  kHardwareStatus = 0x1A0A,
  kSystemStatus = 0x1A0B,
  kMainStatus = 0x1A0C,
  kValidate = 0x1A1A,
  kDisplayMode = 0x1A1B,
  kTriggerOut1 = 0x1A1D,
  kTriggerOut2 = 0x1A1E,
  kPatternSource = 0x1A22,
  kPatternTrigger = 0x1A23,
  kStart = 0x1A24,
  kExposure = 0x1A29,
  kPatternConfig = 0x1A31,
  kMailboxAddress = 0x1A32,
  kMailboxOpen = 0x1A33,
  kMailboxData = 0x1A34,
  kTriggerIn1 = 0x1A35,
  kLoadImage = 0x1A39
};

// Data bytes that each register takes; mailbox data goes by its mailbox.
const std::map<std::uint16_t, size_t> kSizes{
    {kPower, 1},    {kReset, 1},       {kSource, 1},        {kTestPattern, 1},    {kTestColour, 12},
    {kLeds, 1},     {kLedCurrent, 3},  {kDisplayMode, 1},   {kPatternSource, 1},  {kPatternTrigger, 1},
    {kStart, 1},    {kExposure, 8},    {kPatternConfig, 4}, {kMailboxAddress, 1}, {kMailboxOpen, 1},
    {kValidate, 1}, {kTriggerOut1, 3}, {kTriggerOut2, 2},   {kTriggerIn1, 4},     {kLoadImage, 1}};
// What may only be set while no sequence runs.
constexpr std::uint16_t kConfiguration[] = {kSource,      kDisplayMode,   kPatternSource,  kPatternTrigger,
                                            kExposure,    kPatternConfig, kMailboxAddress, kMailboxOpen,
                                            kMailboxData, kValidate};

bool configures(std::uint16_t code) {
  return std::find(std::begin(kConfiguration), std::end(kConfiguration), code) != std::end(kConfiguration);
}

std::uint32_t little_endian(const std::vector<std::uint8_t>& bytes, size_t at, size_t count) {
  std::uint32_t value = 0;
  for (size_t i = 0; i < count; ++i) value |= static_cast<std::uint32_t>(bytes[at + i]) << (8 * i);
  return value;
}

}  // namespace

std::vector<Report> Dlpc350Device::on_report(const Report& report, double now_s) {
  const std::lock_guard lock(mutex_);
  incoming_.insert(incoming_.end(), report.begin(), report.end());
  const size_t length = kHeader + little_endian(incoming_, 2, 2);
  if (length <= kLongestMessage && length > incoming_.size()) return {};
  auto result = answer(now_s);
  incoming_.clear();
  return result;
}

std::vector<Report> Dlpc350Device::answer(double now_s) {
  const size_t length = little_endian(incoming_, 2, 2);
  const bool reading = (incoming_[0] & 0x80) != 0, wants_reply = (incoming_[0] & 0x40) != 0;
  const bool sound = (incoming_[0] & 0x07) == 0 && length >= 2 && kHeader + length <= kLongestMessage;
  std::optional<Bytes> payload;
  if (reject_next_ > 0) {
    --reject_next_;
  } else if (sound) {
    const auto code = static_cast<std::uint16_t>(little_endian(incoming_, 4, 2));
    const Bytes data(incoming_.begin() + 6, incoming_.begin() + static_cast<long>(kHeader + length));
    if (reading) payload = read_register(code, now_s);
    else if (write_register(code, data, now_s)) payload.emplace();
  }
  if (!payload) ++rejected_;
  if (!reading && !wants_reply) return {};
  Report report{};
  report[0] = static_cast<std::uint8_t>((incoming_[0] & 0xC7) | (payload ? 0 : 0x20));
  report[1] = incoming_[1];
  if (payload) {
    report[2] = static_cast<std::uint8_t>(payload->size());  // no register here is longer than a report
    std::copy(payload->begin(), payload->end(), report.begin() + kHeader);
  }
  return {report};
}

std::uint32_t Dlpc350Device::field(std::uint16_t code, size_t at, size_t bytes) const {
  const auto found = registers_.find(code);
  return found == registers_.end() ? 0 : little_endian(found->second, at, bytes);
}

int Dlpc350Device::display_mode(double now_s) const {
  return now_s < mode_since_s_ + options_.mode_change_s ? mode_before_ : static_cast<int>(field(kDisplayMode, 0, 1));
}

std::optional<Dlpc350Device::Bytes> Dlpc350Device::read_register(std::uint16_t code, double now_s) const {
  const bool standby = field(kPower, 0, 1) == 1;
  switch (code) {
    case kVersion:  // 4.4.0 for firmware, API, software and sequence configuration
      return Bytes{0, 0, 4, 4, 0, 0, 4, 4, 0, 0, 4, 4, 0, 0, 4, 4};
    case kHardwareStatus:
    case kSystemStatus: return Bytes{0x01};
    case kMainStatus: return Bytes{static_cast<std::uint8_t>((standby ? 1 : 0) | (running_ ? 2 : 0))};
    case kDisplayMode: return Bytes{static_cast<std::uint8_t>(display_mode(now_s))};
    case kValidate: return Bytes{static_cast<std::uint8_t>(now_s < validation_done_s_ ? 0x80 : validation_)};
    default:
      if (const auto found = registers_.find(code); found != registers_.end()) return found->second;
      return std::nullopt;
  }
}

bool Dlpc350Device::write_register(std::uint16_t code, const Bytes& data, double now_s) {
  if (field(kPower, 0, 1) == 1 && code != kPower) return false;
  if (configures(code) && running_) return false;
  if (code == kMailboxData) {
    if (!write_mailbox(data)) return false;
    validated_ = false;
    return true;
  }
  const auto size = kSizes.find(code);
  if (size == kSizes.end() || data.size() != size->second) return false;
  if (code == kStart && !start_or_stop(data[0], now_s)) return false;
  if (code == kDisplayMode && !write_display_mode(data[0], now_s)) return false;
  if (code == kMailboxOpen) {
    if (data[0] > 3) return false;
    mailbox_ = data[0];
    mailbox_address_ = 0;
  }
  if (code == kMailboxAddress) {
    if (data[0] > 127) return false;
    mailbox_address_ = data[0];
  }
  if (code == kPower && data[0] == 1) running_.reset();
  if (configures(code)) validated_ = false;
  registers_[code] = data;
  if (code == kValidate) {
    validation_ = validate();
    validated_ = true;
    validation_done_s_ = now_s + options_.validation_s;
  }
  note_picture(now_s);
  return true;
}

bool Dlpc350Device::write_display_mode(std::uint8_t mode, double now_s) {
  if (mode > 1) return false;
  mode_before_ = display_mode(now_s);
  if (mode != mode_before_) mode_since_s_ = now_s;
  return true;
}

bool Dlpc350Device::write_mailbox(const Bytes& data) {
  if (mailbox_ == 0 || data.empty()) return false;
  if (mailbox_ == 3) return true;  // variable exposure: taken, but no trigger mode here uses it
  const bool lut = mailbox_ == 2;
  const size_t entry = lut ? kLutEntry : 1, entries = lut ? kLutEntries : kImages;
  if (data.size() % entry != 0 || mailbox_address_ + data.size() / entry > entries) return false;
  Bytes& table = lut ? lut_ : images_;
  const size_t at = mailbox_address_ * entry;
  if (table.size() < at + data.size()) table.resize(at + data.size());
  std::copy(data.begin(), data.end(), table.begin() + static_cast<long>(at));
  return true;
}

// Bit 0 exposure or period out of range, 1 pattern number, 4 period less than exposure + 230 us.
std::uint8_t Dlpc350Device::validate() const {
  constexpr std::uint32_t kShortestOneBit_us = 235, kDead_us = 230, kLongest_us = 2000000;
  const std::uint32_t exposure = field(kExposure, 0, 4), period = field(kExposure, 4, 4);
  std::uint8_t verdict = 0;
  if (exposure < kShortestOneBit_us || period < exposure || period > kLongest_us) verdict |= 0x01;
  if (period != exposure && period < exposure + kDead_us) verdict |= 0x10;
  const size_t entries = field(kPatternConfig, 0, 1) + 1, images = field(kPatternConfig, 3, 1) + 1;
  if (!registers_.contains(kPatternConfig) || lut_.size() < entries * kLutEntry || images_.size() < images)
    return verdict | 0x02;
  for (size_t i = 0; i < entries; ++i) {
    const std::uint32_t entry = little_endian(lut_, i * kLutEntry, kLutEntry);
    const std::uint32_t number = entry >> 2 & 0x3F, depth = entry >> 8 & 0x0F;
    if (depth < 1 || depth > 8 || (depth > 1 ? (number + 1) * depth > 24 : number > 25)) verdict |= 0x02;
  }
  return verdict;
}

bool Dlpc350Device::start_or_stop(std::uint8_t what, double now_s) {
  if (what != 2) {
    running_.reset();
    return what < 2;
  }
  const bool valid = validated_ && now_s >= validation_done_s_ && (validation_ & 0x13) == 0;
  if (!valid || display_mode(now_s) != 1 || field(kPatternSource, 0, 1) != 3 || field(kPatternTrigger, 0, 1) != 1)
    return false;
  RunningSequence sequence;
  sequence.pictures = sequence_pictures();
  sequence.start_s = now_s;
  sequence.exposure_s = 1e-6 * field(kExposure, 0, 4);
  sequence.period_s = 1e-6 * field(kExposure, 4, 4);
  sequence.repeat = field(kPatternConfig, 1, 1) == 1;
  if (registers_.contains(kTriggerOut1))
    sequence.trigger_delay_s = (static_cast<int>(field(kTriggerOut1, 1, 1)) - kTriggerZero) * kTriggerStep_s;
  running_ = sequence;
  return true;
}

std::vector<Pattern> Dlpc350Device::sequence_pictures() const {
  Bytes images(images_.begin(), images_.begin() + static_cast<long>(field(kPatternConfig, 3, 1)) + 1);
  if (images.size() == 2) std::swap(images[0], images[1]);  // exactly two entries are taken swapped
  std::vector<Pattern> pictures;
  int image = -1;
  for (size_t i = 0; i <= field(kPatternConfig, 0, 1); ++i) {
    const std::uint32_t entry = little_endian(lut_, i * kLutEntry, kLutEntry);
    if ((entry >> 18 & 1) != 0 || image < 0) ++image;  // buffer swap: the next image
    pictures.push_back(lut_picture(entry, images[static_cast<size_t>(image) % images.size()]));
  }
  return pictures;
}

Pattern Dlpc350Device::lut_picture(std::uint32_t entry, int image) const {
  const bool inverted = (entry >> 16 & 1) != 0;
  const int number = static_cast<int>(entry >> 2 & 0x3F), depth = static_cast<int>(entry >> 8 & 0x0F);
  if ((entry >> 12 & 7) == 0) return {};
  if (depth == 1 && number == 25) return {.kind = PatternKind::solid, .inverted = inverted};
  const Pattern* burnt = depth == 1 ? options_.flash.at(image, number) : nullptr;
  // An empty plane of the firmware is black.
  Pattern picture = burnt != nullptr ? *burnt : Pattern{.kind = PatternKind::solid, .inverted = true};
  picture.inverted = picture.inverted != inverted;
  return picture;
}

Pattern Dlpc350Device::still_picture() const {
  if (field(kDisplayMode, 0, 1) != 0 || (field(kSource, 0, 1) & 7) != 1) return {};
  const double foreground = registers_.contains(kTestColour) ? field(kTestColour, 2, 2) / 1023.0 : 1;  // green for all
  Pattern picture;
  if (field(kTestPattern, 0, 1) == 0) picture.kind = PatternKind::solid;
  if (field(kTestPattern, 0, 1) == 3) picture = options_.flash.lines.value_or(options_.lines);
  if (picture.kind != PatternKind::off) picture.level = foreground;
  return picture;
}

void Dlpc350Device::note_picture(double now_s) {
  Shown next;
  next.since_s = now_s;
  const bool lit = (field(kLeds, 0, 1) & (running_ ? 0x0F : 0x07)) != 0 && field(kPower, 0, 1) == 0;
  if (lit && running_) next.sequence = running_;
  if (lit && !running_) next.still = still_picture();
  if (!shown_.empty()) {
    const Shown& last = shown_.back();
    const bool same_sequence = last.sequence.has_value() == next.sequence.has_value() &&
                               (!next.sequence || last.sequence->start_s == next.sequence->start_s);
    if (last.still == next.still && same_sequence) return;
  }
  shown_.push_back(std::move(next));
  while (shown_.size() > 1 && shown_[1].since_s < now_s - kHistory_s) shown_.pop_front();
}

Pattern Dlpc350Device::pattern_at(double host_time_s) const {
  const std::lock_guard lock(mutex_);
  const auto after = std::upper_bound(shown_.begin(), shown_.end(), host_time_s,
                                      [](double t, const Shown& shown) { return t < shown.since_s; });
  if (after == shown_.begin()) return {};
  const Shown& shown = *std::prev(after);
  if (!shown.sequence) return shown.still;
  const auto& sequence = *shown.sequence;
  const double number = std::floor((host_time_s - sequence.start_s) / sequence.period_s);
  if (!sequence.repeat && number >= static_cast<double>(sequence.pictures.size())) return {};
  const double within_s = host_time_s - sequence.start_s - number * sequence.period_s;
  if (within_s > sequence.exposure_s) return {};
  return sequence.pictures[static_cast<size_t>(number) % sequence.pictures.size()];
}

std::optional<RunningSequence> Dlpc350Device::running() const {
  const std::lock_guard lock(mutex_);
  return running_;
}

void Dlpc350Device::reject_next(int count) {
  const std::lock_guard lock(mutex_);
  reject_next_ = count;
}

std::int64_t Dlpc350Device::rejected() const {
  const std::lock_guard lock(mutex_);
  return rejected_;
}

}  // namespace selvedge::hardware_sim
