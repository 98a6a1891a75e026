// What makes written files durable. Two words, for two things:
//   written: the kernel has it; it survives the end of this process, however abrupt.
//   durable: the disk has it, its entries in folders too; it survives a loss of power.
//
// A file is durable once its bytes are synced (fsync) and the folders that lead to it are. A sync that failed says
// nothing of what is on the disk, and a later one that succeeds does not mend it (the kernel may have dropped the
// bytes).
#pragma once

#include <filesystem>

namespace selvedge::files {

// The folder that holds `path`: "." for a bare name.
std::filesystem::path folder_of(const std::filesystem::path& path);

// What was made, renamed or removed in the folder, before this call. Throws std::runtime_error where the disk fails.
void sync_folder(const std::filesystem::path& folder);

// As std::filesystem::create_directories, and every folder made is durable. Throws as sync_folder.
void make_folders(const std::filesystem::path& folder);

// Everything that was written on the file system of `descriptor` before this call, by anyone. `path` is for the error.
// Throws std::runtime_error where the disk fails, or failed since the descriptor was opened.
void sync_file_system(int descriptor, const std::filesystem::path& path);

}  // namespace selvedge::files
