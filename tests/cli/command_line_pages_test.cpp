// What bash completes and what man shows, from the scripts and pages that the binary prints.
#include <algorithm>
#include <functional>
#include <memory>
#include <sstream>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "cli/command.h"
#include "cli/command_line_pages.h"
#include "cli/verify/proofs/damaged_trials.h"
#include "run_binary.h"
#include "tests/needs_package.h"

namespace selvedge::cli {
namespace {

namespace fs = std::filesystem;

class CommandLinePages : public testing::Test {
 protected:
  void SetUp() override { fs::create_directory(working_folder()); }
  fs::path working_folder() const { return scratch_.path() / "working"; }

  // What a shell prints.
  std::string bash(const std::string& script) {
    files::write_whole(working_folder() / "script.sh", script);
    const fs::path out = scratch_.path() / "bash.out";
    EXPECT_EQ(
        std::system(
            fmt::format("cd '{}' && bash script.sh > '{}' 2>&1", working_folder().string(), out.string()).c_str()),
        0)
        << files::read_whole(out);
    return files::read_whole(out);
  }

  // What is offered for the last of the words, in order, with a blank between.
  std::string completed(const std::vector<std::string>& words) {
    std::string quoted;
    for (const std::string& word : words) quoted += fmt::format(" '{}'", word);
    const fs::path script = scratch_.path() / "completion.bash";
    if (!fs::exists(script)) files::write_whole(script, run_binary("completion bash", working_folder()).out);
    std::string out =
        bash(fmt::format("set -u\nsource ../completion.bash\nCOMP_WORDS=(./selvedge{})\nCOMP_CWORD={}\n_selvedge\necho "
                         "\"${{COMPREPLY[*]}}\"\n",
                         quoted, words.size()));
    while (!out.empty() && out.back() == '\n') out.pop_back();
    return out;
  }

  ScratchFolder scratch_;
};

std::unique_ptr<const CLI::App> whole_app() {
  static int status = 0;
  auto app = std::make_unique<CLI::App>("all", "selvedge");
  for (const auto* of_program : {&lab_commands(), &simulation_commands(), &verify_commands()})
    for (const AddCommand add : *of_program) add(*app, status);
  return app;
}

TEST_F(CommandLinePages, BashOffersEveryCommandThatHelpLists) {
  const auto app = whole_app();
  std::istringstream offered(completed({""}));
  std::vector<std::string> names;
  for (std::string name; offered >> name;) names.push_back(name);
  size_t shown = 0;
  for (const CLI::App* command : app->get_subcommands(std::function<bool(const CLI::App*)>())) {
    const bool listed = std::find(names.begin(), names.end(), command->get_name()) != names.end();
    EXPECT_EQ(listed, !command->get_group().empty()) << command->get_name();
    shown += listed;
  }
  EXPECT_EQ(names.size(), shown);
  EXPECT_GT(shown, 15u);
}

TEST_F(CommandLinePages, BashCompletesOptionsAndTheirWords) {
  EXPECT_EQ(completed({"dia"}), "diagnose");
  EXPECT_EQ(completed({"session", ""}), "run");
  EXPECT_EQ(completed({"fit", "--hold"}), "--hold-out");
  EXPECT_EQ(completed({"fit", "--base", ""}), "nonlinear_drag linear_drag no_drag");
  EXPECT_EQ(completed({"fit", "--base", "=", "li"}), "linear_drag");  // as bash splits it
  EXPECT_EQ(completed({"fit", "a/campaign", "--base", "no"}), "nonlinear_drag no_drag");
  EXPECT_EQ(completed({"daemon", ""}), "arm camera projector tracker");
  EXPECT_EQ(completed({"prove", "form"}), "format");
  EXPECT_EQ(completed({"fit", "--out", ""}), "");  // file names, by bash itself
  EXPECT_EQ(completed({"check", "so"}), "");
  EXPECT_EQ(completed({"fit", "--out", "session", "--op"}), "--optimiser");  // a value is no command
}

TEST_F(CommandLinePages, BashOffersEveryOption) {
  const auto app = whole_app();
  for (const CLI::App* command : app->get_subcommands(std::function<bool(const CLI::App*)>())) {
    if (command->get_group().empty() || command->get_name() == "soak") continue;
    const std::string offered = " " + completed({command->get_name(), "--"}) + " ";
    for (const CLI::Option* option : command->get_options())
      for (const std::string& name : option->get_lnames())
        EXPECT_NE(offered.find(" --" + name + " "), std::string::npos) << command->get_name() << " --" << name;
  }
}

TEST_F(CommandLinePages, TheManualPageHasEveryCommandAndNoFaults) {
  const Ran ran = run_binary("man", working_folder());
  ASSERT_EQ(ran.exit_status, 0) << ran.err;
  EXPECT_EQ(ran.out.find(SELVEDGE_SOURCE_DIR), std::string::npos);  // nothing of the machine it was written on
  const auto app = whole_app();
  for (const CLI::App* command : app->get_subcommands(std::function<bool(const CLI::App*)>()))
    if (!command->get_group().empty() && command->get_subcommands(std::function<bool(const CLI::App*)>()).empty()) {
      std::string name = command->get_name();
      for (size_t at = name.find('-'); at != std::string::npos; at = name.find('-', at + 2)) name.insert(at, "\\");
      EXPECT_NE(ran.out.find(".SS " + name + "\n"), std::string::npos) << name;
    }
  SELVEDGE_NEEDS(std::system("command -v groff > /dev/null 2>&1") == 0, "groff-base", "setting the manual page");
  files::write_whole(working_folder() / "selvedge.1", ran.out);
  const std::string warnings = bash("groff -man -ww -z -Tutf8 selvedge.1");
  EXPECT_EQ(warnings, "");
  const std::string set =
      bash("groff -man -Tutf8 selvedge.1 | sed -e 's/\\x1b\\[[0-9;]*m//g' -e 's/.\\x08//g' | tr -s ' '");
  for (const char* part : {"--hold-out automatic|frames|trials", "session run", "EXIT STATUS", "SOURCE"})
    EXPECT_NE(set.find(part), std::string::npos) << part;
}

}  // namespace
}  // namespace selvedge::cli
