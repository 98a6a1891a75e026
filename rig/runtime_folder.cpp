#include "rig/runtime_folder.h"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <string>

#include <sys/stat.h>
#include <unistd.h>

#include "files/bad_input.h"
#include "files/durable.h"

namespace selvedge::rig {

namespace {

namespace fs = std::filesystem;

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

// In a user namespace (rig/network.h makes one) a user may be 0 inside: every user's folder would be /tmp/selvedge-0.
// A row of the map: first number inside, first number outside, how many.
uid_t user_outside_namespace() {
  const uid_t inside = ::geteuid();
  std::ifstream map("/proc/self/uid_map");
  for (uint64_t first_inside, first_outside, count; map >> first_inside >> first_outside >> count;)
    if (inside >= first_inside && inside - first_inside < count)
      return static_cast<uid_t>(first_outside + (inside - first_inside));
  return inside;
}

fs::path chosen_folder() {
  if (const std::string of_unit = environment("RUNTIME_DIRECTORY"); !of_unit.empty())
    return of_unit.substr(0, of_unit.find(':'));
  if (const std::string of_login = environment("XDG_RUNTIME_DIR"); !of_login.empty())
    return fs::path(of_login) / "selvedge";
  return fmt::format("/tmp/selvedge-{}", user_outside_namespace());
}

fs::path chosen_state_folder() {
  if (const std::string of_unit = environment("STATE_DIRECTORY"); !of_unit.empty())
    return of_unit.substr(0, of_unit.find(':'));
  if (const std::string of_user = environment("XDG_STATE_HOME"); !of_user.empty())
    return fs::path(of_user) / "selvedge";
  if (const std::string home = environment("HOME"); !home.empty())
    return fs::path(home) / ".local" / "state" / "selvedge";
  refuse("state folder",
         "found none of $STATE_DIRECTORY, $XDG_STATE_HOME and $HOME, expected one: a stop is kept there");
}

}  // namespace

fs::path state_folder() {
  const fs::path folder = chosen_state_folder();
  if (!folder.is_absolute()) refuse(folder, "the state folder's path is relative, expected one from /");
  try {
    files::make_folders(folder);
  } catch (const std::exception& error) { refuse(folder, "the state folder cannot be made: {}", error.what()); }
  return folder;
}

fs::path runtime_folder() {
  const fs::path folder = chosen_folder();
  if (!folder.is_absolute()) refuse(folder, "the runtime folder's path is relative, expected one from /");
  if (::mkdir(folder.c_str(), 0700) != 0 && errno != EEXIST)
    refuse(folder, "the runtime folder cannot be made: {}", std::strerror(errno));
  struct stat found {};
  if (::lstat(folder.c_str(), &found) != 0) refuse(folder, "the runtime folder: {}", std::strerror(errno));
  if (S_ISLNK(found.st_mode)) refuse(folder, "the runtime folder is a link, expected a folder");
  if (!S_ISDIR(found.st_mode)) refuse(folder, "the runtime folder's name belongs to a file, expected a folder");
  if (found.st_uid != ::geteuid())
    refuse(folder, "the runtime folder belongs to user {}, expected user {}", found.st_uid, ::geteuid());
  if ((found.st_mode & (S_IWGRP | S_IWOTH)) != 0)
    refuse(folder, "the runtime folder has mode {:o}, expected 700: others may write there", found.st_mode & 07777);
  return folder;
}

}  // namespace selvedge::rig
