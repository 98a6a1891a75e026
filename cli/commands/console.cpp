// ./selvedge console --run DIR | --config FILE: the rig and its runs as a web page, until Ctrl-C.
#include <chrono>
#include <filesystem>
#include <memory>
#include <thread>

#include <fmt/format.h>

#include "cli/command.h"
#include "cli/console_web.h"
#include "cli/output_folder.h"
#include "cli/stop_signals.h"
#include "console/bus_rig_link.h"
#include "console/gate.h"
#include "console/server.h"
#include "files/bad_input.h"

namespace selvedge::cli {

namespace {

struct ConsoleArguments {
  std::filesystem::path run, configuration, calibration;
  console::ServerOptions server;
};

void run_console(ConsoleArguments& a) {
  if (a.run.empty() && a.configuration.empty()) refuse("console", "expected --run DIR, --config FILE, or both");
  if (a.run.empty()) a.run = std::filesystem::path("runs") / "console";
  if (a.configuration.empty()) {
    if (!std::filesystem::is_directory(a.run))
      refuse("--run " + a.run.string(), "found no such folder, expected one, or --config FILE to begin a new one");
    a.configuration = a.run / "rig.toml";
  } else if (!std::filesystem::is_regular_file(a.configuration))
    refuse("--config " + a.configuration.string(), "no such file");
  expect_folder("--run", a.run);
  std::filesystem::create_directories(a.run);
  a.server.token = console::random_token();
  a.server.web = console_web_folder();
  a.server.log = a.run / "console.log";
  const std::atomic<bool>& stopping = stop_on_signals();
  const console::RunFolder run(a.run);
  console::BusRigLink link(
      {a.configuration, a.calibration.empty() ? a.run / "calibration.json" : a.calibration, a.run / "console"});
  const console::Server server(a.server, link, run);
  fmt::print("console of {}: {}\nwhoever has this address may move the arm; Ctrl-C ends it\n", a.run.string(),
             server.url());
  fmt::print("stop port: http://{}:{}/ (whoever reaches it may stop the arm)\n", a.server.bind, server.stop_port());
  std::fflush(stdout);
  while (!stopping) std::this_thread::sleep_for(std::chrono::milliseconds(50));
}

}  // namespace

void add_console(CLI::App& app, int&) {
  auto* command = app.add_subcommand("console", "the rig and its runs as a web page on this host");
  auto a = std::make_shared<ConsoleArguments>();
  command->add_option("--run", a->run,
                      "folder of a session or demo: its rig, trials and reports; default: runs/console");
  command->add_option("--config", a->configuration, "the rig's configuration; default: rig.toml of the run");
  command->add_option("--calibration", a->calibration,
                      "calibration.json for trials that are recorded here; default: the run's");
  command->add_option("--port", a->server.port, "TCP port; 0: any that is free")
      ->check(CLI::Range(0, 65535))
      ->capture_default_str();
  command
      ->add_option("--stop-port", a->server.stop_port,
                   "TCP port of the stop alone; 0: any that is free; default: --port + 1, or any that is free")
      ->check(CLI::Range(0, 65535));
  command
      ->add_option("--bind", a->server.bind,
                   "address to listen at; other than loopback lets others on the network look")
      ->capture_default_str();
  command
      ->add_option("--page-timeout", a->server.page_bound_s,
                   "s without a word of the page that armed the arm, then it is stopped")
      ->check(CLI::Range(0.5, 60.0))
      ->capture_default_str();
  command->callback([a] { run_console(*a); });
}

}  // namespace selvedge::cli
