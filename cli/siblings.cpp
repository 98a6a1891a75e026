#include "cli/siblings.h"

#include <algorithm>
#include <array>
#include <stdexcept>

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fmt/format.h>

#include "files/bad_input.h"
#include "station/programs.h"

extern char** environ;

namespace selvedge::cli {

namespace {

constexpr std::array kSiblings = {station::kSimulationProgram, station::kVerifyProgram};

// What the program prints; throws where it does not end well.
std::string output_of(const std::string& program, const char* option) {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error(program + ": no pipe");
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
  const char* arguments[] = {program.c_str(), option, nullptr};
  pid_t child = 0;
  const int error = ::posix_spawn(&child, program.c_str(), &actions, nullptr, const_cast<char**>(arguments), environ);
  ::posix_spawn_file_actions_destroy(&actions);
  ::close(ends[1]);
  std::string text;
  std::array<char, 4096> part{};
  for (ssize_t n = 0; error == 0 && (n = ::read(ends[0], part.data(), part.size())) > 0;)
    text.append(part.data(), static_cast<size_t>(n));
  ::close(ends[0]);
  int status = 0;
  if (error != 0 || ::waitpid(child, &status, 0) != child || status != 0)
    throw std::runtime_error(fmt::format("{}: did not say its commands; it is of another build, or damaged", program));
  return text;
}

bool has_command(const CommandTree& tree, const std::string& name) {
  return std::any_of(tree.commands.begin(), tree.commands.end(),
                     [&](const CommandTree& command) { return command.name == name; });
}

}  // namespace

std::vector<Sibling> installed_siblings() {
  std::vector<Sibling> found;
  for (const char* name : kSiblings)
    if (const auto path = station::find_program(name))
      found.push_back({name, path->string(),
                       command_tree_from(nlohmann::json::parse(output_of(path->string(), "--command-tree")))});
  return found;
}

std::vector<std::string> missing_siblings() {
  std::vector<std::string> missing;
  for (const char* name : kSiblings)
    if (!station::find_program(name)) missing.emplace_back(name);
  return missing;
}

std::optional<Sibling> sibling_for(const std::string& command) {
  for (const Sibling& sibling : installed_siblings())
    if (has_command(sibling.commands, command)) return sibling;
  return std::nullopt;
}

void become_sibling_for(char** argv) {
  const auto sibling = sibling_for(argv[1]);
  if (!sibling) return;
  ::execv(sibling->path.c_str(), argv);
  throw std::runtime_error(sibling->path + ": cannot be started");
}

CommandTree with_siblings(CommandTree own, const std::vector<std::string>& programs) {
  const auto wanted = [&](const std::string& program) {
    return programs.empty() || std::find(programs.begin(), programs.end(), program) != programs.end();
  };
  const std::vector<Sibling> siblings = installed_siblings();
  for (const std::string& program : programs)
    if (program != station::kLabProgram &&
        std::none_of(siblings.begin(), siblings.end(), [&](const Sibling& s) { return s.program == program; }))
      refuse("--of " + program, "found no such program, expected one that is installed beside this one");
  if (!wanted(station::kLabProgram)) own.commands.clear();
  for (const Sibling& sibling : siblings)
    if (wanted(sibling.program))
      own.commands.insert(own.commands.end(), sibling.commands.commands.begin(), sibling.commands.commands.end());
  return own;
}

}  // namespace selvedge::cli
