// `./selvedge watch CAMPAIGN`: whether camera and projector still stand where the trials' matrices say.
#include <filesystem>
#include <memory>

#include <fmt/format.h>

#include "cli/command.h"
#include "cli/output_folder.h"
#include "report/progress.h"
#include "station/calibration_watch.h"

namespace selvedge::cli {

namespace {

struct WatchArguments {
  std::filesystem::path campaign, out;
};

}  // namespace

void add_watch(CLI::App& app, int& exit_status) {
  CLI::App* sub = app.add_subcommand("watch",
                                     "compare the held corners and the stripes about them in recorded frames with the "
                                     "tracker; exit 1 where camera or projector has moved");
  auto a = std::make_shared<WatchArguments>();
  sub->add_option("CAMPAIGN", a->campaign, "a trial's or a campaign's folder, with images")->required();
  sub->add_option("--out", a->out, "also write calibration-watch.json into this folder");
  sub->callback([a, &exit_status] {
    expect_folder("--out", a->out);
    const station::CalibrationWatch watch =
        station::watch_calibration(trial::read_campaign(a->campaign), report::terminal_progress("watch"));
    if (!a->out.empty()) {
      std::filesystem::create_directories(a->out);
      station::write_watch(watch, a->out);
    }
    fmt::print("{}", station::to_text(watch));
    exit_status = watch.moved() ? 1 : 0;
  });
}

}  // namespace selvedge::cli
