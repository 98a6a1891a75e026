#include "files/whole_file.h"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>
#include <system_error>

#include <fcntl.h>
#include <unistd.h>

#include "files/bad_input.h"
#include "files/durable.h"
#include "files/file_error.h"
#include "files/nesting.h"

namespace selvedge::files {

namespace fs = std::filesystem;

std::string read_whole(const fs::path& path) {
  std::error_code error;
  if (!fs::exists(path, error)) refuse(path.string(), "no such file");
  if (fs::is_directory(path, error)) refuse(path.string(), "found a folder, expected a file");
  if (!fs::is_regular_file(path, error)) refuse(path.string(), "found something other than a regular file");
  std::ifstream stream(path, std::ios::binary);
  if (!stream) refuse(path.string(), "cannot be opened: {}", std::strerror(errno));
  std::ostringstream text;
  text << stream.rdbuf();
  if (stream.bad()) refuse(path.string(), "cannot be read to its end");
  return std::move(text).str();
}

namespace {

void write_all(int descriptor, const std::string& bytes, const fs::path& path) {
  size_t written = 0;
  while (written < bytes.size()) {
    const ssize_t count = ::write(descriptor, bytes.data() + written, bytes.size() - written);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) fail(path, "cannot be written", errno);
    written += static_cast<size_t>(count);
  }
  if (::fsync(descriptor) != 0) fail(path, "cannot be flushed to disk", errno);
}

}  // namespace

void write_whole(const fs::path& path, const std::string& bytes) {
  const fs::path temporary = path.string() + ".part" + std::to_string(::getpid());
  const int descriptor = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (descriptor < 0) fail(temporary, "cannot be created", errno);
  try {
    write_all(descriptor, bytes, temporary);
  } catch (...) {
    ::close(descriptor);
    ::unlink(temporary.c_str());
    throw;
  }
  ::close(descriptor);
  if (::rename(temporary.c_str(), path.c_str()) != 0) {
    const int number = errno;
    ::unlink(temporary.c_str());
    fail(path, "cannot be put in place", number);
  }
  sync_folder(folder_of(path));
}

nlohmann::json read_json(const fs::path& path) { return parse_json(read_whole(path), path.string()); }

nlohmann::json parse_json(const std::string& text, const std::string& where) {
  refuse_deep_json(text, where);
  try {
    return nlohmann::json::parse(text);
  } catch (const nlohmann::json::parse_error& error) {
    size_t line = 1, column = 1;
    for (size_t i = 0; i + 1 < error.byte && i < text.size(); ++i) {
      column = text[i] == '\n' ? 1 : column + 1;
      line += text[i] == '\n';
    }
    refuse(fmt::format("{}:{}:{}", where, line, column), "found text that is not JSON, expected {}",
           text.empty() ? "a JSON object, the file is empty" : "valid JSON");
  } catch (const nlohmann::json::out_of_range&) {
    refuse(where, "found a number beyond the range of a double, expected finite numbers");
  }
}

void write_json(const fs::path& path, const nlohmann::json& value) { write_whole(path, value.dump(2) + "\n"); }

}  // namespace selvedge::files
