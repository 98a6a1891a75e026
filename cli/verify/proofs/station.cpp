// What the station promises: a session that runs by itself over four fabrics and says what was hidden, a console that a
// browser walks, and pages that cost the recording nothing.
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sys/wait.h>
#include <unistd.h>

#include "cli/console_web.h"
#include "cli/verify/figures.h"
#include "cli/verify/proofs/console_run.h"
#include "files/shared_files.h"
#include "files/whole_file.h"
#include "rig/network.h"
#include "station/child_process.h"
#include "station/free_addresses.h"
#include "station/programs.h"

namespace selvedge::cli {

namespace {

namespace fs = std::filesystem;

// Exit status; what it says goes to the log.
int run(const std::string& command, const fs::path& log) {
  const int status = std::system(fmt::format("{} > '{}' 2>&1", command, log.string()).c_str());
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

std::vector<Figure> prove_session(const fs::path& folder, bool quick, const report::ProgressCallback& progress) {
  const fs::path source = files::shared_folder(),
                 file = quick ? source / "tests/end_to_end/short-session.toml" : source / "examples/four-fabrics.toml";
  progress(0.05, "an unattended session over " + file.stem().string());
  const auto begin = std::chrono::steady_clock::now();
  const int status =
      run(fmt::format("'{}' session run '{}' --out '{}'", station::program(station::kLabProgram).string(),
                      file.string(), (folder / "session").string()),
          folder / "session.log");
  const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  const nlohmann::json summary = files::read_json(folder / "session" / "session.json");
  double fabrics = 0, right = 0, explained = 0, hidden = 0, hidden_named = 0;
  for (const nlohmann::json& f : summary.at("fabrics")) {
    const bool trials = std::all_of(f["trials"].begin(), f["trials"].end(),
                                    [](const nlohmann::json& t) { return t["state"] == "done"; });
    fabrics += trials && f.contains("fit") && f.contains("diagnosis");
    if (!f.contains("truth")) continue;
    const bool names_it = f["truth"]["names_it"];
    right += names_it;
    explained += names_it || !f["truth"].value("why_not", "").empty();
    if (f["truth"]["hidden"] == "none") continue;
    ++hidden;
    hidden_named += names_it;
  }
  const double wanted = quick ? 1 : 4;
  const std::string source_text = "./selvedge session run " + file.filename().string();
  return {{"fabrics recorded, fitted and diagnosed unattended", fabrics, wanted, "", Relation::at_least, source_text},
          {"exit status of the session", static_cast<double>(status), 0, "", Relation::at_most, "no step was given up"},
          {"answers that name what was hidden, or say why not", explained, wanted, "", Relation::at_least,
           "truth.json, read at the very end"},
          {"answers that are right", right, wanted, "", Relation::shown, "truth.json"},
          {"of the hidden effects, named", hidden_named, hidden, "", Relation::shown, "truth.json"},
          {"time of the session", wall_s / 60, 0, "min", Relation::shown, "wall"}};
}

std::vector<Figure> prove_browser(const fs::path& folder, const report::ProgressCallback& progress) {
  progress(0.9, "walking the console in a browser");
  const fs::path source = files::shared_folder(), build = console_web_folder().parent_path();
  const fs::path walk = source / "tests/console/browser.sh";
  if (!fs::exists(walk))
    files::write_whole(folder / "browser.log",
                       "SKIPPED: the console was NOT tried in a browser: its test comes with the source alone\n");
  const int status =
      !fs::exists(walk)
          ? 77
          : run(fmt::format("'{}' '{}' '{}' '{}'", walk.string(), station::program(station::kLabProgram).string(),
                            source.string(), build.string()),
                folder / "browser.log");
  const Relation relation = status == 77 ? Relation::shown : Relation::at_most;
  std::string said = files::read_whole(folder / "browser.log");
  if (status == 77) fmt::print(stderr, "{}", said);
  return {{status == 77 ? "browser walk NOT run (see above), exit status"
                        : "exit status of the browser walk: arms, records, stops, scrubs, reads, is refused",
           static_cast<double>(status), 0, "", relation, "tests/console/walk.mjs"}};
}

std::vector<Figure> prove_pages(bool quick, const report::ProgressCallback& progress) {
  const ConsoleRun run = run_console_with_pages(quick ? 3 : 10, progress);
  const std::string source = "simulated rig, the console in this process";
  return {{"pictures that four pages received", static_cast<double>(run.previews), 1, "", Relation::at_least, source},
          {"frames lost by a recording with four pages open", static_cast<double>(run.frames_lost), 0,
           fmt::format("of {}", run.frames), Relation::at_most, source},
          {"live picture at a page, median age", 1e3 * run.page_latency_s, 1e3 * run.bus_latency_s, "ms",
           Relation::shown, "beside: the camera's own preview on the bus"},
          {"processor time of the console, four pages open", 100 * run.open_cores, 100 * run.idle_cores, "% of a core",
           Relation::shown, "beside: no page open, same run"}};
}

}  // namespace

std::vector<Figure> prove_station(const FigureOptions& options) {
  rig::ensure_local_multicast(static_cast<uint16_t>(station::free_bus_port()));
  const fs::path folder = fs::temp_directory_path() / fmt::format("selvedge-prove-station-{}", ::getpid());
  fs::create_directories(folder);
  std::vector<Figure> figures = prove_session(folder, options.quick, options.progress);
  for (Figure& figure : prove_pages(options.quick, options.progress)) figures.push_back(std::move(figure));
  for (Figure& figure : prove_browser(folder, options.progress)) figures.push_back(std::move(figure));
  fs::remove_all(folder);
  return figures;
}

}  // namespace selvedge::cli
