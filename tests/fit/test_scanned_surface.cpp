// A campaign that a depth camera scanned, of points that are others at each time: written, read again and fitted.
#include <cmath>
#include <filesystem>
#include <map>

#include <gtest/gtest.h>
#include <unistd.h>

#include "capture/trial/trial_writer.h"
#include "cli/verify/proofs/scanned_trial.h"
#include "files/whole_file.h"
#include "fit/campaign_search.h"
#include "fit/fit_campaign.h"
#include "fit/fit_report.h"
#include "tests/fit/simulated_trial.h"
#include "tests/keep_page.h"

namespace selvedge::fit {
namespace {

namespace fs = std::filesystem;

TEST(ScannedSurface, RecoversWhatItDetermines) {
  const fs::path folder = fs::path(testing::TempDir()) / ("selvedge_scanned_" + std::to_string(getpid()));
  fs::remove_all(folder);
  trial::Campaign made;
  made.fabric = "test knit";
  const DepthCamera camera{.px_apart_m = 5e-3};
  made.trials = {scanned_trial({true_material()}, {.samples = 13}, camera, "static-1", 3),
                 scanned_trial({true_material()}, {.amplitude_m = 0.1, .samples = 109}, camera, "waving-1", 5)};
  for (const trial::Trial& t : made.trials) trial::write_trial(t, folder / t.name);
  trial::write_campaign_json(made, folder);
  const trial::Campaign campaign = trial::read_campaign(folder);
  ASSERT_TRUE(campaign.trials[1].surface);
  EXPECT_EQ(campaign.trials[1].surface->position, made.trials[1].surface->position);
  EXPECT_EQ(*campaign.trials[1].surface->seen_from_m, camera.from_m);

  FitOptions options;
  options.coarse_cells = 6;
  options.cells = 9;
  options.max_iterations = 6;
  const FitOutcome out = fit_campaign(campaign, options);
  const cloth::Material truth = true_material();
  const std::map<std::string, double> expected = {{"bend", truth.bend}, {"drag_normal", truth.drag_normal}};
  for (const FittedParameter& p : out.parameters) {
    if (!expected.count(p.parameter.name)) continue;
    EXPECT_NEAR(std::log(p.value / expected.at(p.parameter.name)), 0, 0.25) << p.parameter.name << " " << p.value;
  }
  // What is left is the noise of a square's depth, and of the outline.
  ASSERT_EQ(out.trials.size(), 2u);
  for (const TrialError& t : out.trials) EXPECT_LT(t.end_mm, 2.5) << t.name;

  write_fit(out, campaign, folder / "fit");
  keep_page(folder / "fit" / "report.html", "fit-surface");
  const std::string page = files::read_whole(folder / "fit" / "report.html");
  EXPECT_NE(page.find("<div class=\"moving-sheets\">"), std::string::npos);
  EXPECT_EQ(page.find(R"("seen":[[])"), std::string::npos) << "points of the surface are shown in motion";
  EXPECT_EQ(page.find(">nan"), std::string::npos);
  fs::remove_all(folder);
}

}  // namespace
}  // namespace selvedge::fit
