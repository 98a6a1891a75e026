// What a disk may hold after its power was cut, from the notes of the preloaded library (cli/power_cut).
//
// Bytes of a file and entries of a folder each wait until a sync makes them durable: fsync of that file or folder, or
// syncfs. A sync covers what was done before it began; one that failed covers nothing, and no later one covers what it
// was to. Of what still waits when the power goes, any part may be there: writes are dropped, torn and reordered, names
// come and go in any order. A rename is there whole or not at all, as journalling file systems have it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "cli/verify/power_cut/journal_format.h"

namespace selvedge::cli {

class DiskModel {
 public:
  // root: the folder that was noted, empty when the notes began. Throws std::runtime_error on notes that make no sense.
  DiskModel(const std::filesystem::path& root, const std::filesystem::path& journal);

  // Writes what the disk holds after the cut below `target`, a new folder. Returns how many changes were lost or torn.
  size_t leave(const std::filesystem::path& target, std::mt19937& random) const;

  bool had_failed_sync() const { return failed_; }

 private:
  struct Change {
    size_t time = 0;      // number of the note
    bool doomed = false;  // a sync that was to cover it failed
    bool cuts = false;    // of a file: its length becomes `offset`; otherwise `data` is written there
    uint64_t offset = 0;
    std::string data;
    std::string gone, name;  // of a folder: the entry that goes, the one that comes; either may be empty
    size_t node = 0;
  };
  struct Node {
    bool folder = false;
    std::string bytes;                      // durable
    std::map<std::string, size_t> entries;  // durable
    std::vector<Change> waiting;
  };

  void take(const Note& note, const std::string& path, const std::string& data);
  void add_entry(const std::string& path, bool folder, uint64_t inode);
  void end_sync(const Note& note);
  static void apply(Node& node, const Change& change);
  static size_t settle(Node& node, double kept, std::mt19937& random);

  std::vector<Node> nodes_;
  std::map<uint64_t, size_t> by_inode_;
  std::map<std::string, size_t> by_path_;  // as the process sees it
  std::map<uint32_t, size_t> sync_began_;  // when
  size_t time_ = 0;
  bool failed_ = false;
};

}  // namespace selvedge::cli
