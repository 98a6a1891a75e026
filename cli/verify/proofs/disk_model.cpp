#include "cli/verify/proofs/disk_model.h"

#include <algorithm>
#include <cstring>
#include <fstream>
#include <functional>
#include <stdexcept>

#include <sys/stat.h>

#include "files/whole_file.h"

namespace selvedge::cli {

namespace fs = std::filesystem;

DiskModel::DiskModel(const fs::path& root, const fs::path& journal) {
  struct stat status {};
  if (::stat(root.c_str(), &status) != 0) throw std::runtime_error(root.string() + ": no such folder");
  nodes_.emplace_back().folder = true;
  by_inode_[status.st_ino] = 0;
  by_path_[root.string()] = 0;
  const std::string bytes = fs::exists(journal) ? files::read_whole(journal) : "";
  for (size_t at = 0; at + sizeof(Note) <= bytes.size(); ++time_) {
    Note note;
    std::memcpy(&note, bytes.data() + at, sizeof note);
    at += sizeof note;
    take(note, bytes.substr(at, note.path_bytes), bytes.substr(at + note.path_bytes, note.data_bytes));
    at += note.path_bytes + note.data_bytes;
  }
}

void DiskModel::take(const Note& note, const std::string& path, const std::string& data) {
  const auto folder_of = [&](const std::string& of) -> Node& {
    return nodes_[by_path_.at(fs::path(of).parent_path().string())];
  };
  Change change;
  change.time = time_;
  switch (note.call) {
    case Call::make_folder: return add_entry(path, true, note.inode);
    case Call::make_file: return add_entry(path, false, note.inode);
    case Call::write:
    case Call::truncate:
      change.cuts = note.call == Call::truncate;
      change.offset = note.offset;
      change.data = data;
      nodes_[by_inode_.at(note.inode)].waiting.push_back(std::move(change));
      return;
    case Call::rename:
      if (fs::path(path).parent_path() != fs::path(data).parent_path())
        throw std::runtime_error("disk model: a rename to another folder");
      change.gone = fs::path(path).filename().string();
      change.name = fs::path(data).filename().string();
      change.node = by_path_.at(path);
      folder_of(path).waiting.push_back(change);
      by_path_[data] = change.node;
      by_path_.erase(path);
      return;
    case Call::remove:
      change.gone = fs::path(path).filename().string();
      folder_of(path).waiting.push_back(change);
      by_path_.erase(path);
      return;
    case Call::sync_begins: sync_began_[note.sync] = time_; return;
    case Call::sync_ends: return end_sync(note);
  }
  throw std::runtime_error("disk model: an unknown call");
}

void DiskModel::add_entry(const std::string& path, bool folder, uint64_t inode) {
  Change change;
  change.time = time_;
  change.name = fs::path(path).filename().string();
  change.node = nodes_.size();
  nodes_[by_path_.at(fs::path(path).parent_path().string())].waiting.push_back(change);
  by_path_[path] = by_inode_[inode] = nodes_.size();
  nodes_.emplace_back().folder = folder;
}

void DiskModel::end_sync(const Note& note) {
  const size_t began = sync_began_.at(note.sync);
  failed_ = failed_ || note.offset != 0;
  const auto cover = [&](Node& node) {
    std::vector<Change> left;
    for (Change& change : node.waiting) {
      if (change.time < began && note.offset == 0 && !change.doomed) {
        apply(node, change);
        continue;
      }
      change.doomed = change.doomed || (change.time < began && note.offset != 0);
      left.push_back(std::move(change));
    }
    node.waiting = std::move(left);
  };
  if (note.inode != 0) return cover(nodes_[by_inode_.at(note.inode)]);
  for (Node& node : nodes_) cover(node);
}

void DiskModel::apply(Node& node, const Change& change) {
  if (node.folder) {
    if (!change.gone.empty()) node.entries.erase(change.gone);
    if (!change.name.empty()) node.entries[change.name] = change.node;
  } else if (change.cuts) {
    node.bytes.resize(change.offset);
  } else {
    // Bytes between the old end and the write are zero, as after a cut they are.
    node.bytes.resize(std::max<size_t>(node.bytes.size(), change.offset + change.data.size()));
    node.bytes.replace(change.offset, change.data.size(), change.data);
  }
}

// kept: the share of waiting changes that reached the disk all the same.
size_t DiskModel::settle(Node& node, double kept, std::mt19937& random) {
  std::uniform_real_distribution<double> share(0, 1);
  size_t lost = 0;
  for (Change change : node.waiting) {
    const bool torn = !node.folder && change.data.size() > 1 && share(random) < 0.2;
    const bool whole = share(random) < kept;
    lost += torn || !whole;
    if (torn) {
      // The file has its length, and only the beginning of what was written into it.
      const size_t there = random() % change.data.size();
      std::fill(change.data.begin() + static_cast<std::ptrdiff_t>(there), change.data.end(), '\0');
    }
    if (torn || whole) apply(node, change);
  }
  return lost;
}

size_t DiskModel::leave(const fs::path& target, std::mt19937& random) const {
  std::vector<Node> nodes = nodes_;
  const double kept = std::vector<double>{0, 0.5, 0.9}[random() % 3];
  size_t lost = 0;
  for (Node& node : nodes) lost += settle(node, kept, random);
  const std::function<void(size_t, const fs::path&)> write = [&](size_t node, const fs::path& path) {
    if (nodes[node].folder) {
      fs::create_directories(path);
      for (const auto& [name, entry] : nodes[node].entries) write(entry, path / name);
    } else {
      std::ofstream(path, std::ios::binary) << nodes[node].bytes;
    }
  };
  write(0, target);
  return lost;
}

}  // namespace selvedge::cli
