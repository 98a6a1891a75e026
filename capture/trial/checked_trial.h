// What a recorded trial carries so that damage to it shows and the rest still reads:
//   each line of a table ends with its own checksum, column crc32 (files/checked_lines.h);
//   each row of frames.csv has its picture's, column image_crc32: the CRC-32 of the whole file;
//   trial.json has "checksums": "crc32", and its own as "crc32": of the same JSON without that key, as dump(2) writes
//   it; trial-copy.json is a second copy of trial.json.
// Source: docs/formats.md, "Checksums".
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "capture/trial/trial.h"
#include "files/csv_table.h"

namespace selvedge::trial {

inline constexpr const char* copy_name = "trial-copy.json";
inline constexpr const char* table_names[] = {"corners.csv", "frames.csv", "markers.csv", "robot.csv"};

// First line, with its line break, of a table whose lines carry checksums. table: one of table_names.
std::string checked_header(std::string_view table);

// Whether tables and images carry checksums, as trial.json says.
bool has_checksums(const nlohmann::json& trial_json);

// Whether this is what the recorder wrote, as far as its checksum tells; true where it has none.
bool is_as_written(const nlohmann::json& trial_json);

// Puts the checksum in and writes the copy first, then trial.json; both durable. Throws as files::write_whole.
void write_checked_json(const std::filesystem::path& folder, nlohmann::json value);

// Empty, or what is wrong with a listed image: "missing", "empty", "damaged".
std::string image_damage(const std::filesystem::path& path, uint32_t crc32);

// Reads the tables of one trial. With checksums, what is damaged is passed over and named.
class TableReader {
 public:
  // damaged: where sentences go, in the order of the tables read.
  TableReader(std::filesystem::path folder, State state, const nlohmann::json& trial_json,
              std::vector<std::string>& damaged);

  bool checked() const { return checked_; }

  // Times in one column, at least one row. None where the trial lacks the table. must: without checksums, refuses a
  // trial that lacks it.
  std::optional<files::CsvTable> read(const std::string& name, const std::vector<files::CsvColumn>& wanted,
                                      bool must) const;

 private:
  std::optional<files::CsvTable> read_checked(const std::string& name,
                                              const std::vector<files::CsvColumn>& wanted) const;
  bool is_recorded(const std::filesystem::path& path) const;

  const std::filesystem::path folder_;
  const State state_;
  const bool checked_;
  const nlohmann::json rows_;  // by table, once the trial has ended
  std::vector<std::string>& damaged_;
};

}  // namespace selvedge::trial
