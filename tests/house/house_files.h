// The project's files as these tests read them: what git tracks or would, and the #include lines.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace selvedge::house {

// Paths below the top folder, sorted. As git lists them, untracked ones that it does not ignore too; where there is no
// git, every file outside folders that begin with "build" or ".".
const std::vector<std::string>& files();

// Of these, with one of the endings (".h").
std::vector<std::string> files_ending(const std::vector<std::string>& endings);

std::vector<std::string> lines_of(const std::string& file);

struct Include {
  std::string file, target;
};

// Of every C++ file: "…" and <…> alike.
std::vector<Include> includes();

// Which files of the house each of its files includes.
std::map<std::string, std::vector<std::string>> includes_of_the_house();

// Standard output of a command that a shell runs in the top folder, and its exit status.
struct Ran {
  std::string output;
  int status = -1;
};
Ran run(const std::string& command);

// The file's groups that include one another, each sorted: strongly connected parts of more than one (Tarjan 1972).
std::vector<std::vector<std::string>> circles(const std::map<std::string, std::vector<std::string>>& edges);

}  // namespace selvedge::house
