// The command line. Exit status: 0 done, 1 failed (or a figure fell short), 2 input that the user can mend.
#include <algorithm>
#include <cstdio>
#include <string>

#include <fmt/format.h>

#include "cli/command.h"
#include "files/bad_input.h"

namespace {

int report_error(std::string text, int exit_status) {
  // One line, whatever a file name or a library's message holds.
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }, ' ');
  fmt::print(stderr, "selvedge: {}\n", text);
  return exit_status;
}

// What the simulation's kernels were compiled for on the machine that built them and this one lacks; empty: nothing.
std::string missing_instructions() {
#ifdef SELVEDGE_NEEDS_AVX2
  if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma")) return "AVX2 and FMA";
#endif
#ifdef SELVEDGE_NEEDS_AVX512
  if (!__builtin_cpu_supports("avx512f") || !__builtin_cpu_supports("avx512vl") || !__builtin_cpu_supports("avx512dq"))
    return "AVX-512";
#endif
  return "";
}

}  // namespace

int main(int argc, char** argv) {
  if (const std::string missing = missing_instructions(); !missing.empty())
    return report_error("this processor: found none of " + missing +
                            ", for which this program was compiled; expected a build from source on this machine",
                        2);
  CLI::App app("Selvedge records fabric in motion, fits a simulated fabric to it, and says why the two differ.",
               "./selvedge");
  app.footer(
      "./selvedge test    sets up what is missing and runs every test.\n"
      "Exit status: 0 done, 1 failed or a figure fell short, 2 input that you can mend.");
  app.get_formatter()->column_width(30);
  app.set_version_flag("--version", "selvedge " SELVEDGE_VERSION);
  app.require_subcommand(0, 1);
  app.failure_message(CLI::FailureMessage::simple);
  int exit_status = 0;
  for (const selvedge::cli::AddCommand add : selvedge::cli::commands()) add(app, exit_status);
  try {
    app.parse(argc, argv);
    if (app.get_subcommands().empty()) fmt::print("{}", app.help());
    return exit_status;
  } catch (const CLI::Success& help) { return app.exit(help); } catch (const CLI::ParseError& error) {
    return report_error(std::string(error.what()) + " (--help lists what there is)", 2);
  } catch (const selvedge::BadInput& error) {
    return report_error(error.what(), 2);
  } catch (const std::exception& error) { return report_error(error.what(), 1); }
}
