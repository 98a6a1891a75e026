// What the preloaded library (power_cut.cpp) notes of a process's file system calls, one entry after another in one
// file, and what disk_model.h reads. An entry: a Note, then `path_bytes` of a path, then `data_bytes`: bytes written,
// or a second path. Paths are absolute; files and folders are known by their inode number.
#pragma once

#include <cstdint>

namespace selvedge::cli {

enum class Call : uint32_t {
  make_folder,  // path, inode
  make_file,    // path, inode
  write,        // inode, offset, data
  truncate,     // inode, offset: the new length
  rename,       // path, data: the new path
  remove,       // path
  sync_begins,  // number of the sync, inode (0: the whole file system)
  sync_ends,    // number of the sync, offset: 0, or the error it returned
};

struct Note {
  Call call;
  uint32_t path_bytes = 0, data_bytes = 0, sync = 0;
  uint64_t inode = 0, offset = 0;
};

}  // namespace selvedge::cli
