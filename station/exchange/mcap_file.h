// A file of timed messages on named channels, as Foxglove, Lichtblick and other viewers of robots' logs open it: MCAP,
// version 0, in chunks without compression, each with its index. Source: mcap.dev/spec.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace selvedge::station {

// Messages are JSON. Nothing is a whole file before finish(); throws std::runtime_error where the disk refuses.
class McapFile {
 public:
  // Once: library is who writes.
  McapFile(const std::filesystem::path& path, const std::string& library);

  // Of a type whose JSON schema this is; both are told in the file. Types of one name are one.
  uint16_t channel(const std::string& topic, const std::string& type, const std::string& json_schema);
  void metadata(const std::string& name, const std::map<std::string, std::string>& values);
  // In any order; viewers go through them by time_ns.
  void message(uint16_t channel, uint64_t time_ns, const std::string& json);
  // Closes it; returns how many messages there are.
  uint64_t finish();

 private:
  struct ChunkIndex {
    uint64_t first_ns = 0, last_ns = 0, at = 0, length = 0, index_length = 0, size = 0;
    std::map<uint16_t, uint64_t> index_at;  // by channel
  };

  void put(const std::string& bytes);
  void end_chunk();
  uint64_t put_summary();
  std::string statistics() const;
  uint64_t messages() const;

  std::ofstream out_;
  std::filesystem::path path_;
  uint64_t at_ = 0;                // bytes written
  uint32_t crc_ = 0;               // of the section under way
  std::vector<std::string> told_;  // schemas and channels, as records
  std::map<std::string, uint16_t> types_;
  std::map<uint16_t, uint64_t> count_;  // of messages, by channel
  std::vector<std::string> metadata_index_;
  std::vector<ChunkIndex> chunks_;
  std::string chunk_;  // records of the one under way
  uint64_t chunk_first_ns_ = 0, chunk_last_ns_ = 0;
  std::map<uint16_t, std::vector<std::pair<uint64_t, uint64_t>>> chunk_index_;  // time and place, by channel
};

}  // namespace selvedge::station
