// Reading a file whole, and writing one so that it is there whole or not at all.
#pragma once

#include <filesystem>
#include <string>

#include <nlohmann/json.hpp>

namespace selvedge::files {

// Bytes of a regular file. Throws BadInput naming the path where it is missing or unreadable.
std::string read_whole(const std::filesystem::path& path);

// Writes to a temporary name in the same folder, flushes to disk (fsync), renames over `path`, and flushes the folder:
// once this returns, a loss of power leaves the new file, and before that the old one or the new one, each whole.
// Throws std::runtime_error naming path and cause where the disk refuses; `path` is then unchanged.
void write_whole(const std::filesystem::path& path, const std::string& bytes);

// Parses JSON. Throws BadInput naming path, line and column of the first error, and where it nests deeper than 64
// (nesting.h).
nlohmann::json read_json(const std::filesystem::path& path);
// The same of text that was read already; `where` is for errors.
nlohmann::json parse_json(const std::string& text, const std::string& where);

// write_whole with two-space indentation and a closing newline.
void write_json(const std::filesystem::path& path, const nlohmann::json& value);

}  // namespace selvedge::files
