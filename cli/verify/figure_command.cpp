#include "cli/verify/figure_command.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>

#include <fmt/format.h>
#include <unistd.h>

#include "files/bad_input.h"
#include "files/whole_file.h"
#include "report/text_table.h"

namespace selvedge::cli {

namespace {

struct FigureArguments {
  std::string name, json_path;
  bool quick = false;
  unsigned seed = 1;
};

void list_sets(const std::string& command, const std::vector<FigureSet>& sets) {
  std::vector<std::vector<std::string>> rows;
  for (const FigureSet& set : sets) rows.push_back({set.name, set.summary});
  fmt::print("{}\nRun one with ./selvedge {} NAME [--json FILE] [--quick] [--seed N].\n",
             report::text_table({"name", "what it shows"}, rows), command);
}

const FigureSet& find_set(const std::string& command, const std::vector<FigureSet>& sets, const std::string& name) {
  const auto found = std::find_if(sets.begin(), sets.end(), [&](const FigureSet& set) { return set.name == name; });
  if (found == sets.end())
    refuse(command, "found no {} of that name, expected one that `./selvedge {}` lists", in_quotes(name), command);
  return *found;
}

// Before long work, not after it.
void require_folder_of(const std::string& json_path) {
  if (json_path.empty()) return;
  const std::filesystem::path folder = std::filesystem::absolute(json_path).parent_path();
  std::error_code error;
  if (!std::filesystem::is_directory(folder, error))
    refuse("--json " + json_path, "found no folder {}, expected it to exist", folder.string());
  if (std::filesystem::is_directory(json_path, error))
    refuse("--json " + json_path, "found a folder, expected the name of a file");
}

int run(const std::string& command, const std::vector<FigureSet>& sets, bool judged, const FigureArguments& arguments) {
  if (arguments.name.empty()) {
    list_sets(command, sets);
    return 0;
  }
  const FigureSet& set = find_set(command, sets, arguments.name);
  require_folder_of(arguments.json_path);
  FigureOptions options;
  options.quick = arguments.quick;
  options.seed = arguments.seed;
  options.progress = report::terminal_progress(command + " " + set.name);
  options.tell = [](const std::string& line) {
    fmt::print(stderr, "{}{}\n", ::isatty(2) != 0 ? "\r\x1b[K" : "", line);
    std::fflush(stderr);
  };
  const auto start = std::chrono::steady_clock::now();
  const std::vector<Figure> figures = set.run(options);
  const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  print(figures);
  if (!arguments.json_path.empty()) {
    nlohmann::json value = to_json(set.name, figures);
    value["format"] = command + "/1";
    value["quick"] = arguments.quick;
    value["seed"] = arguments.seed;
    value["wall_s"] = wall_s;
    files::write_json(arguments.json_path, value);
  }
  const auto short_ones = std::count_if(figures.begin(), figures.end(), [](const Figure& f) { return !holds(f); });
  fmt::print("{} {}: {:.1f} s", command, set.name, wall_s);
  if (judged && short_ones > 0) fmt::print(", {} of {} figures fall short\n", short_ones, figures.size());
  else fmt::print("{}\n", figures.empty() ? ", nothing measured" : judged ? ", every figure holds" : "");
  return judged && short_ones > 0 ? 1 : 0;
}

}  // namespace

void add_figure_command(CLI::App& app, const std::string& command, const std::string& description,
                        const std::vector<FigureSet>& sets, bool judged, int& exit_status) {
  CLI::App* sub = app.add_subcommand(command, description);
  auto arguments = std::make_shared<FigureArguments>();
  std::string names;
  for (const FigureSet& set : sets) names += (names.empty() ? "" : ",") + set.name;
  sub->add_option("NAME", arguments->name, "Which one to run; without it, lists them")->type_name("{" + names + "}");
  sub->add_option("--json", arguments->json_path, "Also write the figures to this file")->type_name("FILE");
  sub->add_flag("--quick", arguments->quick, "The short version that the tests run");
  sub->add_option("--seed", arguments->seed, "Of every random choice")->type_name("N")->capture_default_str();
  sub->callback([=, &sets, &exit_status] { exit_status = run(command, sets, judged, *arguments); });
}

}  // namespace selvedge::cli
