// A campaign simulated on another mesh than the fit's, written to disk, read again and fitted: parameters,
// held-out error and the files that a user gets.
#include <cmath>
#include <filesystem>

#include <gtest/gtest.h>
#include <unistd.h>

#include "capture/trial/trial_writer.h"
#include "estimate/kept_input.h"
#include "files/bad_input.h"
#include "files/whole_file.h"
#include "fit/campaign_search.h"
#include "fit/fit_campaign.h"
#include "fit/fit_report.h"
#include "fit/fit_text.h"
#include "fit/fit_verdict.h"
#include "fit/tested_parameters.h"
#include "fit/trial_errors.h"
#include "material_tests/heavy_strip.h"
#include "tests/fit/simulated_trial.h"
#include "tests/keep_page.h"

namespace selvedge::fit {
namespace {

namespace fs = std::filesystem;

class FitCampaign : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ =
        fs::path(testing::TempDir()) / ("selvedge_fit_campaign_" + std::to_string(getpid()));  // tests run side by side
    fs::remove_all(folder_);
    trial::Campaign campaign;
    campaign.fabric = "test knit";
    for (const auto& [name, amplitude, seconds] :
         {std::tuple{"static-1", 0.0, 0.1}, std::tuple{"waving-1", 0.1, 0.9}}) {
      campaign.trials.push_back(simulated_trial(name, amplitude, seconds, 7));
      trial::write_trial(campaign.trials.back(), folder_ / name);
    }
    trial::write_campaign_json(campaign, folder_);
  }
  static void TearDownTestSuite() { fs::remove_all(folder_); }
  static inline fs::path folder_;
};

TEST_F(FitCampaign, RecoversWhatTheTrialsDetermine) {
  FitOptions options;
  options.coarse_cells = 6;
  options.cells = 9;
  options.max_iterations = 6;
  const trial::Campaign campaign = trial::read_campaign(folder_);
  const FitOutcome out = fit_campaign(campaign, options);
  const cloth::Material truth = true_material();
  const std::map<std::string, double> expected = {
      {"bend", truth.bend}, {"stretch", truth.stretch}, {"drag_normal", truth.drag_normal}};
  for (const FittedParameter& p : out.parameters) {
    if (!expected.count(p.parameter.name)) continue;
    EXPECT_NEAR(std::log(p.value / expected.at(p.parameter.name)), 0, 0.25) << p.parameter.name << " " << p.value;
  }
  ASSERT_EQ(out.trials.size(), 2u);
  EXPECT_LT(out.trials[1].end_mm, out.trials[1].start_mm);
  EXPECT_LT(out.trials[1].end_mm, 1.5);
  EXPECT_EQ(out.hold_out, "frames");
  EXPECT_LT(held_out_mm(out), 2 * out.trials[1].end_mm);

  write_fit(out, campaign, folder_ / "out");
  const nlohmann::json fit = files::read_json(folder_ / "out" / "fit.json");
  EXPECT_EQ(fit.at("format"), "fit/1");
  EXPECT_EQ(fit.at("parameters").at("bend").at("unit"), "N·m");
  EXPECT_EQ(fit.at("parameters").size(), 9u);
  EXPECT_TRUE(fit.at("trials").at("waving-1").contains("error_end"));
  const std::string html = files::read_whole(folder_ / "out" / "report.html");
  EXPECT_NE(html.find("<div class=\"verdict"), std::string::npos);
  EXPECT_NE(html.find("<div class=\"moving-sheets\">"), std::string::npos);  // and in it both trials in motion
  for (const char* name : {"static-1", "waving-1"})
    EXPECT_NE(html.find(std::string(R"("name":")") + name + "\""), std::string::npos) << name;
  EXPECT_NE(html.find("<svg"), std::string::npos);
  keep_page(folder_ / "out" / "report.html", "fit");
  // Parameters between their bounds, which of them go together, what was held out, and of what input all this is.
  for (const char* part : {"aria-label=\"Each parameter between its bounds",
                           "Which parameters these trials cannot tell", "class=\"shaded\"", ">held out</text>"})
    EXPECT_NE(html.find(part), std::string::npos) << part;
  EXPECT_NE(html.find("; input " + out.input + "</footer>"), std::string::npos);
  EXPECT_LT((out.correlation.diagonal().array() - 1).abs().maxCoeff(), 1e-9);
  EXPECT_LE(out.correlation.cwiseAbs().maxCoeff(), 1 + 1e-9);
  EXPECT_EQ(remarks_of(out).size(), out.remarks.size() + out.combinations.size());
  for (const char* wrong : {">nan", " nan"}) EXPECT_EQ(html.find(wrong), std::string::npos);

  // In a terminal too, what is not there is a dash or says why: the still trial held nothing out.
  FitOutcome gaps = out;
  gaps.trials[1].held_out_interval_mm.reset();
  gaps.parameters[0].variability_percent = std::nan("");
  const std::string text = outcome_text(gaps);
  EXPECT_EQ(text.find("nan"), std::string::npos) << text;
  EXPECT_NE(text.find("too short to tell"), std::string::npos) << text;
  for (TrialError& t : gaps.trials) t.held_out_mm = std::nan("");
  EXPECT_NE(outcome_text(gaps).find("nothing was held out"), std::string::npos) << outcome_text(gaps);

  // The verdict falls where the figures say so.
  EXPECT_EQ(fit.at("verdict").at("trust"), to_text(verdict_of(out).trust));
  EXPECT_NE(verdict_of(out).trust, report::Trust::none);
  FitOutcome spoiled = out;
  spoiled.doubts = {"waving-1: corners.csv: the held corners lie 300 m apart"};
  EXPECT_EQ(verdict_of(spoiled).trust, report::Trust::none);
  spoiled = out;
  spoiled.trials[1].held_out_mm = 0.2 * 1e3 * out.simulation->trials()[1].height_m;
  EXPECT_EQ(verdict_of(spoiled).trust, report::Trust::none);
  spoiled = out;
  for (FittedParameter& p : spoiled.parameters) p.at_bound = true;
  EXPECT_EQ(verdict_of(spoiled).trust, report::Trust::none);

  // A diagnosis begins there: with these recordings and this drag law, and no others.
  const fs::path file = folder_ / "out" / "fit.json";
  const std::string recordings = estimate::recordings_hash(campaign);
  const std::vector<model::Parameter> base = model::base_parameters();
  const auto coordinates = read_fit(file, input_of(recordings, model::Drag::nonlinear), base);
  ASSERT_TRUE(coordinates);
  EXPECT_LT((*coordinates - out.coordinates).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_FALSE(read_fit(file, input_of(recordings, model::Drag::linear), base));
  EXPECT_FALSE(read_fit(file, input_of("others", model::Drag::nonlinear), base));
  nlohmann::json damaged = fit;
  damaged["parameters"].erase("bend");
  files::write_json(folder_ / "damaged.json", damaged);
  EXPECT_THROW(read_fit(folder_ / "damaged.json", input_of(recordings, model::Drag::nonlinear), base), BadInput);
}

// A strip of the same fabric over an edge, its midline from the model itself: here the joining is what is tried.
trial::Trial strip_trial(const std::string& name, double overhang_m) {
  const double density = true_material().density;
  trial::Trial t;
  t.name = name;
  t.experiment = trial::Experiment::cantilever;
  t.fabric = {"test knit", 0.025, 0.2, density * 0.025 * 0.2, true};
  const auto strip = material_tests::hanging_strip({true_material().bend, 0}, 9.81 * density, overhang_m);
  t.cantilever = trial::Cantilever{0, overhang_m, std::nullopt, strip->point_m};
  return t;
}

TEST_F(FitCampaign, MaterialTestsGiveStartAndPrior) {
  FitOptions options;
  options.coarse_cells = 6;
  options.cells = 8;
  options.max_iterations = 3;
  trial::Campaign campaign = trial::read_campaign(folder_ / "static-1");
  campaign.trials.insert(campaign.trials.begin(), strip_trial("strip", 0.05));
  campaign.trials.push_back(strip_trial("strip-2", 0.06));
  const TestedParameters tested = tested_parameters(campaign, options.drag);
  const model::Parameter& bend = tested.parameters[place_of(tested.parameters, "bend")];
  EXPECT_NEAR(bend.start / true_material().bend, 1, 0.05);
  EXPECT_LT(bend.prior_sd, 0.1);
  EXPECT_TRUE(bend.measured);
  EXPECT_FALSE(tested.parameters[place_of(tested.parameters, "shear")].measured);

  const FitOutcome out = fit_campaign(campaign, options);
  ASSERT_EQ(out.trials.size(), 1u);
  EXPECT_EQ(out.trials[0].name, "static-1");
  for (const FittedParameter& p : out.parameters) {
    if (p.parameter.name != "bend") continue;
    EXPECT_NEAR(p.value / true_material().bend, 1, 0.1);
    EXPECT_TRUE(p.determined) << p.lower_interval << " " << p.upper_interval;
  }
  EXPECT_NE(out.remarks.front().find("cantilever"), std::string::npos) << out.remarks.front();
  EXPECT_EQ(to_json(out).at("material_tests").at("cantilever").at("trials").size(), 2u);

  campaign.trials.erase(campaign.trials.begin() + 1);
  EXPECT_THROW(fit_campaign(campaign, options), BadInput);  // nothing that hangs is left
}

TEST_F(FitCampaign, AFabricOfTheLibraryIsWhereRigidityBegins) {
  TestedParameters parameters = tested_parameters(trial::read_campaign(folder_ / "static-1"), model::Drag::nonlinear);
  begin_like({"denim", "table", 0.4, 4e-5, 1e-5, {}, {}}, parameters);
  const model::Parameter& bend = parameters.parameters[place_of(parameters.parameters, "bend")];
  EXPECT_NEAR(bend.start, 2e-5, 1e-9);
  EXPECT_TRUE(bend.measured && bend.tried.empty());
  EXPECT_NE(parameters.remarks.back().find("denim"), std::string::npos);
}

TEST_F(FitCampaign, StillTrialAloneLeavesDampingUndetermined) {
  FitOptions options;
  options.coarse_cells = 6;
  options.cells = 8;
  options.max_iterations = 3;
  const FitOutcome out = fit_campaign(trial::read_campaign(folder_ / "static-1"), options);
  for (const FittedParameter& p : out.parameters) {
    if (p.parameter.name != "bend_damping" && p.parameter.name != "drag_normal") continue;
    EXPECT_GT(p.variability_percent, 50) << p.parameter.name;
    EXPECT_FALSE(p.determined) << p.parameter.name;
    EXPECT_EQ(p.upper_interval, p.parameter.upper) << p.parameter.name;
  }
  EXPECT_TRUE(std::isnan(held_out_mm(out)));
  EXPECT_FALSE(rigid_plate_mm(out));
}

// Somebody's export in which all markers jump about together, as a board would.
TEST_F(FitCampaign, AFitThatABoardBeatsIsNotToBeBelieved) {
  trial::Campaign campaign;
  campaign.folder = folder_;
  campaign.trials.push_back(simulated_trial("jumps", 0, 0.9, 7));
  trial::Trial& t = campaign.trials.front();
  t.experiment = trial::Experiment::waving;
  const auto jump_m = [](double time_s) { return 0.02 * std::round(2 * std::sin(40 * time_s)); };
  for (size_t i = 0; i < t.corners.time_s.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    t.corners.left(0, at) += jump_m(t.corners.time_s[i]);
    t.corners.right(0, at) += jump_m(t.corners.time_s[i]);
  }
  for (size_t i = 0; i < t.markers->time_s.size(); ++i)
    t.markers->position(0, static_cast<Eigen::Index>(i)) += jump_m(t.markers->time_s[i]);
  FitOptions options;
  options.coarse_cells = options.cells = 6;
  options.max_iterations = 2;
  const FitOutcome out = fit_campaign(campaign, options);
  EXPECT_LT(rigid_plate_mm(out).value(), 0.5 * held_out_mm(out));
  const report::Verdict verdict = verdict_of(out);
  EXPECT_EQ(verdict.trust, report::Trust::none);
  EXPECT_NE(verdict.because.front().find("rigid plate"), std::string::npos) << verdict.because.front();
}

// Of still trials alone, which cost little: the grid follows the fabric, and the fit says what it leaves open.
TEST(FitGrid, IsFinerForASofterFabric) {
  const auto fitted = [](double bend) {
    SimulatedSwatch swatch{true_material()};
    swatch.material.bend = bend;
    swatch.cells = 24;
    trial::Campaign campaign;
    campaign.folder = "simulated";
    campaign.trials = {selvedge::simulated_trial(swatch, {.half_apart_m = 0.12}, "static-1", 1),
                       selvedge::simulated_trial(swatch, {.half_apart_m = 0.11}, "static-2", 2)};
    FitOptions options;
    options.coarse_cells = 6;
    options.max_iterations = 3;
    return fit_campaign(campaign, options);
  };
  const FitOutcome stiff = fitted(8e-5), soft = fitted(1.2e-5);
  EXPECT_GE(stiff.simulation->options().cells, 8);  // bending length 37 mm
  EXPECT_GE(soft.simulation->options().cells, 15);  // 20 mm
  EXPECT_GT(soft.simulation->options().cells, stiff.simulation->options().cells);
  for (const FitOutcome* out : {&stiff, &soft}) {
    SCOPED_TRACE(fmt::format("{} cells", out->simulation->options().cells));
    EXPECT_GT(out->grid_mm, 0);
    EXPECT_LT(out->grid_mm, 0.5);
    EXPECT_EQ(to_json(*out)["grid"]["cells"], out->simulation->options().cells);
    EXPECT_EQ(to_json(*out)["grid"]["next_finer_moves_mm"], out->grid_mm);
  }
  for (const FittedParameter& p : soft.parameters) {
    if (p.parameter.name != "bend") continue;
    EXPECT_NEAR(p.value, 1.2e-5, 0.1 * 1.2e-5);
  }
}

FitOptions small_search_options() {
  FitOptions options;
  options.coarse_cells = 5;
  options.cells = 6;
  return options;
}

CampaignSearch small_search() {
  CampaignSearch search;
  search.optimiser = "annealing";
  search.evaluations = 24;
  search.parameters = {"stretch", "shear", "bend"};
  return search;
}

// Broken off in the middle, the same fit into the same folder ends as one that ran through.
TEST_F(FitCampaign, SearchContinuesFromItsJournal) {
  const trial::Campaign campaign = trial::read_campaign(folder_ / "static-1");
  const FitOutcome through =
      fit_campaign(campaign, with_search(small_search_options(), small_search(), campaign, folder_ / "through"));
  EXPECT_EQ(through.trace.back().evaluations, 24);
  EXPECT_LE(through.trace.back().best_cost, through.trace.front().best_cost);

  FitOptions killed = small_search_options();
  int searched = 0;
  killed.progress = [&](double, const std::string& what) {
    if (what.rfind("search", 0) == 0 && ++searched == 9) throw std::runtime_error("killed");
  };
  EXPECT_THROW(fit_campaign(campaign, with_search(killed, small_search(), campaign, folder_ / "killed")),
               std::runtime_error);
  const FitOutcome continued =
      fit_campaign(campaign, with_search(small_search_options(), small_search(), campaign, folder_ / "killed"));
  EXPECT_EQ(continued.coordinates, through.coordinates);
  EXPECT_EQ(files::read_whole(folder_ / "killed" / "evaluations.txt"),
            files::read_whole(folder_ / "through" / "evaluations.txt"));

  CampaignSearch other = small_search();
  other.seed = 2;
  EXPECT_THROW(fit_campaign(campaign, with_search(small_search_options(), other, campaign, folder_ / "killed")),
               BadInput);

  write_fit(continued, campaign, folder_ / "killed");
  EXPECT_NE(files::read_whole(folder_ / "killed" / "report.html").find("temperature"), std::string::npos);
}

// Broken off in the grid, in a stage on the coarse grid and in the last one, least squares end as if they had run
// through.
TEST_F(FitCampaign, LeastSquaresContinueFromTheirJournal) {
  const trial::Campaign campaign = trial::read_campaign(folder_ / "static-1");
  FitOptions options = small_search_options();
  options.max_iterations = 4;
  const FitOutcome through = fit_campaign(campaign, options);
  options.journal = folder_ / "squares" / "iterations.txt";
  for (const auto& [stage, nth] :
       {std::pair("coarse grid: search", 2), {"coarse grid: start 2", 1}, {"grid of 6 cells", 1}}) {
    FitOptions killed = options;
    int seen = 0;
    killed.progress = [&](double, const std::string& what) {
      if (what.rfind(stage, 0) == 0 && ++seen == nth) throw std::runtime_error("killed");
    };
    EXPECT_THROW(fit_campaign(campaign, killed), std::runtime_error) << stage;
  }
  const FitOutcome continued = fit_campaign(campaign, options);
  EXPECT_EQ(continued.coordinates, through.coordinates);
  EXPECT_EQ(continued.history, through.history);
  EXPECT_EQ(continued.evaluations, through.evaluations);
  // All is there: it is not asked for again.
  const std::string kept = files::read_whole(options.journal);
  fit_campaign(campaign, options);
  EXPECT_EQ(files::read_whole(options.journal), kept);

  // Another fit begins anew.
  FitOptions other = options;
  other.drag = model::Drag::none;
  EXPECT_EQ(fit_campaign(campaign, other).parameters.size(), 6u);
  EXPECT_EQ(files::read_whole(options.journal).find(kept.substr(0, kept.find('\n'))), std::string::npos);
}

TEST_F(FitCampaign, SearchRefusesWhatItDoesNotKnow) {
  const trial::Campaign campaign = trial::read_campaign(folder_);
  CampaignSearch search = small_search();
  search.parameters = {"stretch", "colour"};
  EXPECT_THROW(with_search({}, search, campaign, folder_ / "refused"), BadInput);
  search = small_search();
  search.error = SearchError::folds;  // the trials have markers, no images
  EXPECT_THROW(with_search({}, search, campaign, folder_ / "refused"), BadInput);
  EXPECT_FALSE(fs::exists(folder_ / "refused"));
}

TEST(ObserveTrial, RefusesATrialWithNothingToCompare) {
  trial::Trial t = simulated_trial("bare", 0, 0.1, 1);
  t.markers.reset();
  EXPECT_THROW(model::observe_trial(t), BadInput);
}

TEST(ObserveTrial, AveragesAStillFabricAndThinsAMovingOne) {
  const model::ObservedTrial still = model::observe_trial(simulated_trial("still", 0, 0.2, 1));
  EXPECT_TRUE(still.still);
  EXPECT_EQ(still.markers->time_s.size(), 1u);
  const model::ObservedTrial moving = model::observe_trial(simulated_trial("moving", 0.1, 0.5, 1));
  EXPECT_FALSE(moving.still);
  EXPECT_NEAR(static_cast<double>(moving.markers->time_s.size()), 16, 1);
}

}  // namespace
}  // namespace selvedge::fit
