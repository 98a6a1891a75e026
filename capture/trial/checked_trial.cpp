#include "capture/trial/checked_trial.h"

#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "capture/trial/trial_writer.h"
#include "files/bad_input.h"
#include "files/checked_lines.h"
#include "files/whole_file.h"

namespace selvedge::trial {

namespace fs = std::filesystem;
using files::CheckedLines;
using files::CsvTable;
using nlohmann::json;

namespace {

constexpr const char* kind = "crc32";

uint32_t checksum_of(json trial_json) {
  trial_json.erase("crc32");
  return files::crc32_of(trial_json.dump(2));
}

std::string damaged_lines(const std::vector<CheckedLines::Range>& ranges) {
  std::vector<std::string> texts;
  for (const CheckedLines::Range& range : ranges)
    texts.push_back(range.first == range.last ? fmt::format("line {}", range.first)
                                              : fmt::format("lines {} to {}", range.first, range.last));
  return fmt::format("{} damaged", fmt::join(texts, ", "));
}

// A sentence, or nothing where the table is as it was written. expected_rows: where the recorder has said it.
std::string table_damage(const std::string& name, const CheckedLines& lines, std::optional<size_t> expected_rows,
                         bool may_be_torn) {
  std::vector<std::string> what;
  // A table that was only just begun when its recorder was killed.
  const bool just_begun = may_be_torn && lines.torn && lines.rows == 0 && lines.damaged.empty();
  if (lines.header_damaged && !just_begun) what.push_back("header damaged");
  if (!lines.damaged.empty()) what.push_back(damaged_lines(lines.damaged));
  if (lines.torn && !may_be_torn) what.push_back("last line cut off");
  if (what.empty() && (!expected_rows || *expected_rows == lines.rows)) return "";
  std::string kept = expected_rows ? fmt::format("{} of {} rows read", lines.rows, *expected_rows)
                                   : fmt::format("{} rows read", lines.rows);
  what.push_back(std::move(kept));
  return fmt::format("{}: {}", name, fmt::join(what, ", "));
}

// A table that the recorder never writes has no checksums, in whatever trial it was put.
bool has_checked_lines(const std::string& name) {
  return std::find(std::begin(table_names), std::end(table_names), name) != std::end(table_names);
}

}  // namespace

std::string checked_header(std::string_view table) {
  std::string header = table == "corners.csv"   ? corners_header
                       : table == "frames.csv"  ? frames_header
                       : table == "markers.csv" ? markers_header
                                                : robot_header;
  header.pop_back();
  return header + (table == "frames.csv" ? ",image_crc32,crc32\n" : ",crc32\n");
}

bool has_checksums(const json& trial_json) {
  return trial_json.contains("checksums") && trial_json["checksums"] == kind;
}

bool is_as_written(const json& trial_json) {
  if (!trial_json.contains("checksums") && !trial_json.contains("crc32")) return true;
  return trial_json.contains("crc32") && trial_json["crc32"] == checksum_of(trial_json);
}

void write_checked_json(const fs::path& folder, json value) {
  value["checksums"] = kind;
  value["crc32"] = checksum_of(value);
  files::write_json(folder / copy_name, value);
  files::write_json(folder / "trial.json", value);
}

std::string image_damage(const fs::path& path, uint32_t crc32) {
  try {
    const std::string bytes = files::read_whole(path);
    if (bytes.empty()) return "empty";
    return files::crc32_of(bytes) == crc32 ? "" : "damaged";
  } catch (const BadInput&) { return "missing"; }
}

TableReader::TableReader(fs::path folder, State state, const json& trial_json, std::vector<std::string>& damaged)
    : folder_(std::move(folder)), state_(state), checked_(has_checksums(trial_json)),
      rows_(trial_json.contains("rows") && trial_json["rows"].is_object() ? trial_json["rows"] : json::object()),
      damaged_(damaged) {}

// Whether a table that a trial may lack is to be read. A recorder that was cut off leaves a table that it had only just
// begun without a whole row: there is nothing in it yet, and what else was recorded is to be read all the same.
bool TableReader::is_recorded(const fs::path& path) const {
  std::error_code error;
  if (!fs::exists(path, error)) return false;
  if (state_ == State::complete) return true;
  const std::string bytes = files::read_whole(path);
  return std::count(bytes.begin(), bytes.end(), '\n') > 1;
}

std::optional<CsvTable> TableReader::read(const std::string& name, const std::vector<files::CsvColumn>& wanted,
                                          bool must) const {
  const fs::path path = folder_ / name;
  std::optional<CsvTable> table;
  if (checked_ && has_checked_lines(name)) {
    table = read_checked(name, wanted);
  } else if (must || is_recorded(path)) {
    table = files::read_csv(path, wanted, state_ != State::complete);
    if (table->rows() == 0) refuse(path.string(), "found a header and no rows, expected at least one");
  }
  if (table) files::require_times_ascend(*table, 0);
  return table;
}

std::optional<CsvTable> TableReader::read_checked(const std::string& name,
                                                  const std::vector<files::CsvColumn>& wanted) const {
  const fs::path path = folder_ / name;
  std::optional<size_t> expected;
  if (rows_.contains(name) && rows_[name].is_number_unsigned()) expected = rows_[name].get<size_t>();
  std::error_code error;
  if (!fs::exists(path, error)) {
    if (expected.value_or(0) > 0) damaged_.push_back(fmt::format("{}: missing, 0 of {} rows read", name, *expected));
    return std::nullopt;
  }
  CheckedLines lines;
  try {
    lines = files::read_checked_lines(path, checked_header(name));
  } catch (const BadInput& unreadable) {
    damaged_.push_back(unreadable.what());
    return std::nullopt;
  }
  const std::string damage = table_damage(name, lines, expected, state_ == State::recording);
  if (!damage.empty()) damaged_.push_back(damage);
  if (lines.rows == 0) return std::nullopt;
  return files::parse_csv(path, lines.text, wanted);
}

}  // namespace selvedge::trial
