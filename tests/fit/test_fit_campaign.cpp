// A campaign simulated on another mesh than the fit's, written to disk, read again and fitted: parameters,
// held-out error and the files that a user gets.
#include <cmath>
#include <filesystem>
#include <random>

#include <gtest/gtest.h>
#include <unistd.h>

#include "capture/trial/trial_writer.h"
#include "files/bad_input.h"
#include "files/whole_file.h"
#include "fit/campaign_search.h"
#include "fit/fit_report.h"

namespace selvedge::fit {
namespace {

namespace fs = std::filesystem;

constexpr double kWidth = 0.3;
constexpr double kNoise = 2e-4;

cloth::Material true_material() {
  cloth::Material m;
  m.density = 0.16;
  m.stretch = 90;
  m.shear = 45;
  m.bend = 8e-5;
  m.stretch_damping = m.shear_damping = 0.03;
  m.drag_normal = 1.3;
  return m;
}

// Right corner moved along y and z and back, 10 cm peak to peak at 1.5 Hz, after a short rest.
Eigen::Vector3d right_corner(double t, double amplitude) {
  const double w = t < 0.1 ? 0 : 0.5 * (1 - std::cos(2 * M_PI * 1.5 * (t - 0.1)));
  return {0.12, amplitude * w, 0.3 * amplitude * w};
}

trial::Trial simulated_trial(const std::string& name, double amplitude, double seconds, unsigned seed) {
  trial::Trial t;
  t.name = name;
  t.experiment = amplitude > 0 ? trial::Experiment::waving : trial::Experiment::static_hang;
  t.fabric = {"test knit", kWidth, kWidth, 0.16 * kWidth * kWidth, true};
  t.starts_at_rest = true;
  t.mocap_rate_hz = 120;
  t.mocap_noise_m = kNoise;
  std::mt19937 generator(seed);
  std::normal_distribution<double> noise(0, kNoise);
  const auto noisy = [&](const Eigen::Vector3d& p) -> Eigen::Vector3d { return p + Eigen::Vector3d(noise(generator), noise(generator), noise(generator)); };
  const int samples = static_cast<int>(seconds * 120) + 1;
  Eigen::Matrix3Xd left(3, samples), right(3, samples);
  for (int i = 0; i < samples; ++i) {
    t.corners.time_s.push_back(i / 120.0);
    left.col(i) = Eigen::Vector3d(-0.12, 0, 0);
    right.col(i) = right_corner(i / 120.0, amplitude);
  }
  const cloth::Sheet sheet = cloth::make_sheet(geometry::make_grid_mesh(kWidth, kWidth, 13, 13));
  cloth::Experiment e;
  e.material = true_material();
  e.path = cloth::make_path(cloth::Hold::corners, t.corners.time_s, left, right);
  e.sample_s = t.corners.time_s;
  e.start_shape = cloth::hung_shape(sheet, e, 1);
  const cloth::Trajectory run = cloth::simulate(sheet, {e}).front();
  t.corners.left.resize(3, samples);
  t.corners.right.resize(3, samples);
  trial::Markers markers;
  std::vector<Eigen::Vector3d> seen;
  for (int i = 0; i < samples; ++i) {
    t.corners.left.col(i) = noisy(left.col(i));
    t.corners.right.col(i) = noisy(right.col(i));
    for (int k = 0; k < 25; ++k) {
      const int column = 1 + 5 * (k % 5) / 2, row = 1 + 5 * (k / 5) / 2;  // vertices 1, 3, 6, 8, 11
      markers.time_s.push_back(i / 120.0);
      markers.marker.push_back(k);
      markers.uv.emplace_back(kWidth * column / 12, kWidth * row / 12);
      seen.push_back(noisy(run.samples[static_cast<size_t>(i)].col(row * 13 + column)));
    }
  }
  markers.position.resize(3, static_cast<Eigen::Index>(seen.size()));
  for (size_t i = 0; i < seen.size(); ++i) markers.position.col(static_cast<Eigen::Index>(i)) = seen[i];
  t.markers = std::move(markers);
  return t;
}

class FitCampaign : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = fs::path(testing::TempDir()) / ("selvedge_fit_campaign_" + std::to_string(getpid()));  // tests run side by side
    fs::remove_all(folder_);
    trial::Campaign campaign;
    campaign.fabric = "test knit";
    for (const auto& [name, amplitude, seconds] : {std::tuple{"static-1", 0.0, 0.1}, std::tuple{"waving-1", 0.1, 0.9}}) {
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
  options.coarse_columns = 7;
  options.columns = 11;
  options.max_iterations = 6;
  const trial::Campaign campaign = trial::read_campaign(folder_);
  const FitOutcome out = fit_campaign(campaign, options);
  const cloth::Material truth = true_material();
  const std::map<std::string, double> expected = {{"bend", truth.bend}, {"stretch", truth.stretch}, {"drag_normal", truth.drag_normal}};
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
  EXPECT_NE(html.find("data:image/png;base64"), std::string::npos);
  EXPECT_NE(html.find("<svg"), std::string::npos);
}

TEST_F(FitCampaign, StillTrialAloneLeavesDampingUndetermined) {
  FitOptions options;
  options.coarse_columns = 7;
  options.columns = 9;
  options.max_iterations = 3;
  const FitOutcome out = fit_campaign(trial::read_campaign(folder_ / "static-1"), options);
  for (const FittedParameter& p : out.parameters) {
    if (p.parameter.name != "bend_damping" && p.parameter.name != "drag_normal") continue;
    EXPECT_GT(p.variability_percent, 50) << p.parameter.name;
    EXPECT_FALSE(p.determined) << p.parameter.name;
    EXPECT_EQ(p.upper_interval, p.parameter.upper) << p.parameter.name;
  }
  EXPECT_TRUE(std::isnan(held_out_mm(out)));
}

FitOptions small_search_options() {
  FitOptions options;
  options.coarse_columns = 5;
  options.columns = 7;
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
  const FitOutcome through = fit_campaign(campaign, with_search(small_search_options(), small_search(), campaign, folder_ / "through"));
  EXPECT_EQ(through.trace.back().evaluations, 24);
  EXPECT_LE(through.trace.back().best_cost, through.trace.front().best_cost);

  FitOptions killed = small_search_options();
  int searched = 0;
  killed.progress = [&](double, const std::string& what) {
    if (what.rfind("search", 0) == 0 && ++searched == 9) throw std::runtime_error("killed");
  };
  EXPECT_THROW(fit_campaign(campaign, with_search(killed, small_search(), campaign, folder_ / "killed")), std::runtime_error);
  const FitOutcome continued = fit_campaign(campaign, with_search(small_search_options(), small_search(), campaign, folder_ / "killed"));
  EXPECT_EQ(continued.coordinates, through.coordinates);
  EXPECT_EQ(files::read_whole(folder_ / "killed" / "evaluations.txt"), files::read_whole(folder_ / "through" / "evaluations.txt"));

  CampaignSearch other = small_search();
  other.seed = 2;
  EXPECT_THROW(fit_campaign(campaign, with_search(small_search_options(), other, campaign, folder_ / "killed")), BadInput);

  write_fit(continued, campaign, folder_ / "killed");
  EXPECT_NE(files::read_whole(folder_ / "killed" / "report.html").find("temperature"), std::string::npos);
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
  EXPECT_THROW(observe_trial(t), BadInput);
}

TEST(ObserveTrial, AveragesAStillFabricAndThinsAMovingOne) {
  const ObservedTrial still = observe_trial(simulated_trial("still", 0, 0.2, 1));
  EXPECT_TRUE(still.still);
  EXPECT_EQ(still.markers->time_s.size(), 1u);
  const ObservedTrial moving = observe_trial(simulated_trial("moving", 0.1, 0.5, 1));
  EXPECT_FALSE(moving.still);
  EXPECT_NEAR(static_cast<double>(moving.markers->time_s.size()), 16, 1);
}

}  // namespace
}  // namespace selvedge::fit
