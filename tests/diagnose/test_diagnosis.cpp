// A campaign whose fault is known, simulated by the model itself: answered, and written as a user gets it.
#include <algorithm>
#include <filesystem>
#include <set>

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <unistd.h>
#include <nlohmann/json.hpp>

#include "diagnose/diagnosis_report.h"
#include "diagnose/effects/library.h"
#include "evaluation/fresh_reduction.h"
#include "files/whole_file.h"
#include "tests/diagnose/simulated_campaign.h"
#include "tests/keep_page.h"

namespace selvedge::diagnose {
namespace {

namespace fs = std::filesystem;

Diagnosis diagnosed(const SimulatedSwatch& c,
                    const std::set<std::string>& effects = {"camera_delay", "bend_friction", "draught", "mass_error"},
                    DiagnosisOptions options = {}) {
  std::vector<Effect> few;
  for (const Effect& e : effect_library())
    if (effects.count(e.name)) few.push_back(e);
  options.study.protocol.cells = 8;
  options.study.protocol.rate_hz = 20;
  return diagnose(simulated_campaign(c), few, options);
}

const EffectFinding& finding(const Diagnosis& d, const std::string& name) {
  return *std::find_if(d.effects.begin(), d.effects.end(), [&](const EffectFinding& f) { return f.name == name; });
}

TEST(Diagnosis, NamesADelayAndMeasuresIt) {
  SimulatedSwatch late = usual_fabric();
  late.delay_s = 0.012;
  const Diagnosis d = diagnosed(late);
  EXPECT_EQ(d.cause, "camera_delay");
  EXPECT_EQ(d.side, "measurement");
  EXPECT_GT(d.inclusion.at("camera_delay"), 0.9);
  double sum = 0;
  for (const auto& [name, p] : d.probability) sum += p;
  EXPECT_NEAR(sum, 1, 1e-9);
  EXPECT_GT(finding(d, "mass_error").absorbed, 0.999);
  EXPECT_EQ(d.inclusion.at("mass_error"), 0) << "motion cannot tell it";
  const EffectFinding& f = finding(d, "camera_delay");
  ASSERT_EQ(f.size.size(), 1u);
  EXPECT_NEAR(f.size[0].value, 0.012, 0.002);
  // No narrower than causes named right were found to lie about the true size.
  EXPECT_LT(f.size[0].low, 0.76 * f.size[0].value);
  EXPECT_GT(f.size[0].high, 1.24 * f.size[0].value);
  EXPECT_GT(f.reduction.fraction, 0.5);

  // Parts and what nothing explains add up to the gap.
  ASSERT_FALSE(d.budget.parts.empty());
  double parts = d.budget.unexplained.value;
  for (const BudgetPart& p : d.budget.parts) parts += p.share.value;
  EXPECT_NEAR(parts, 1, 1e-9);
  EXPECT_GT(d.budget.parts[0].share.value, 0.7);

  const fs::path folder = fs::path(testing::TempDir()) / "selvedge_diagnosis";
  write_diagnosis(d, folder);
  const nlohmann::json json = files::read_json(folder / "diagnosis.json");
  EXPECT_EQ(json.at("format"), "diagnosis/1");
  EXPECT_EQ(json.at("map").at("after_mm").size(), json.at("map").at("uv_m").size());
  for (const char* key : {"campaign", "gap", "where", "map", "side", "cause", "probabilities", "inclusion", "budget",
                          "confusable", "effect_size", "size_at_most", "shrink", "next_experiment", "wall_s"})
    EXPECT_TRUE(json.contains(key)) << key;
  const nlohmann::json force = files::read_json(folder / json.at("missing_force").get<std::string>());
  EXPECT_GT(force.at("windows").size(), 5u);
  EXPECT_EQ(force.at("windows")[0].at("mean_n_m2").size(), force.at("grid_uv_m").size());
  const std::string page = files::read_whole(folder / "report.html");
  keep_page(folder / "report.html", "diagnosis");
  for (const char* part : {"<svg", "clock is late by", "the two upper corners are held", "; input "})
    EXPECT_NE(page.find(part), std::string::npos) << part;
  EXPECT_EQ(page.find(">nan"), std::string::npos);
  fs::remove_all(folder);

  EXPECT_GT(d.forecast.before_mm, d.forecast.after_mm);
  EXPECT_LE(d.forecast.low_mm, d.forecast.before_mm);
  EXPECT_GE(d.forecast.high_mm, d.forecast.before_mm);
  EXPECT_FALSE(d.next_experiment.empty());

  // Trials that nothing was fitted to: the same fault, another motion.
  trial::Campaign fresh;
  fresh.trials = {simulated_trial(
      late, {.half_apart_m = 0.125, .amplitude_m = 0.075, .frequency_hz = 1.7, .samples = 96}, "waving-9", 9)};
  const evaluation::FreshReduction there = evaluation::reduction_on(fresh, effect_library(), json, "camera_delay", 13);
  EXPECT_GT(there.before_mm, there.after_mm);
  EXPECT_GT(there.fraction(), 0.5);
}

// Too little of each to be named; what may be there unseen is told.
TEST(Diagnosis, SaysHowLargeMayBeWhatItDoesNotName) {
  SimulatedSwatch little = usual_fabric();
  little.delay_s = 0.0004;
  little.air_m_s = {0, 0.02, 0};
  const Diagnosis d = diagnosed(little);
  EXPECT_EQ(d.cause, "none");
  const auto expect_within = [&](const char* effect, const char* parameter, double truth, double most) {
    const std::vector<SizedParameter>& at_most = finding(d, effect).at_most;
    const auto p = std::find_if(at_most.begin(), at_most.end(), [&](const auto& s) { return s.name == parameter; });
    ASSERT_NE(p, at_most.end()) << effect;
    EXPECT_LE(p->low, 0) << effect;
    EXPECT_GE(p->high, truth) << effect;
    EXPECT_LT(p->high - p->low, most) << effect;
  };
  expect_within("camera_delay", "delay", 0.0004, 0.005);
  expect_within("draught", "air_y", 0.02, 0.2);
  const std::vector<SizedParameter>& friction = finding(d, "bend_friction").at_most;
  ASSERT_EQ(friction.size(), 1u) << "of its starts the first parameter";
  EXPECT_GT(friction[0].high, 1e-6) << "N, though it is likeliest at none";
  EXPECT_TRUE(finding(d, "mass_error").at_most.empty()) << "motion cannot tell it";
}

TEST(Diagnosis, FindsASecondEffectBesideALargeOne) {
  SimulatedSwatch both = usual_fabric();
  both.delay_s = 0.012;
  both.air_m_s = {0.1, 0.25, 0};
  const Diagnosis d = diagnosed(both, {"camera_delay", "draught", "creep", "added_mass", "hem"});
  EXPECT_EQ(d.likeliest, "camera_delay+draught");
  EXPECT_GT(d.inclusion.at("camera_delay"), 0.5);
  EXPECT_GT(d.inclusion.at("draught"), 0.5);
  ASSERT_TRUE(d.fit.contains(d.likeliest));
  EXPECT_NEAR(d.fit.at(d.likeliest).at("delay"), 0.012, 0.003);
  EXPECT_NEAR(d.fit.at(d.likeliest).at("air_y"), 0.25, 0.05);
  ASSERT_EQ(d.budget.parts.size(), 2u);
  for (const BudgetPart& p : d.budget.parts) EXPECT_GT(p.share.value, 0.1) << p.effect;
}

// In the base fit drag and damping stand in for a draught; whoever goes on from there may find it too small, and leave
// something for grips that sit elsewhere to take up.
TEST(Diagnosis, ADraughtThatDragStoodInForIsSizedAndStaysAlone) {
  SimulatedSwatch windy = usual_fabric();
  windy.air_m_s = {0.08, 0.22, 0};
  DiagnosisOptions options;
  Eigen::VectorXd x = base_of(windy, windy.material.stretch, windy.material.shear);
  x(3) = x(4) = std::log(1e-3);  // damping of stretch and shear, N·s/m
  x(5) = std::log(2e-8);         // of bending, N·m·s
  x(6) = std::log(5.7);          // drag_normal, kg/m³
  x(7) = std::log(1e-3);         // drag_tangent, kg/(m²·s)
  x(8) = std::log(15.0);         // drag_fade, s²/m²
  options.study.base_fit = BaseFit{x, 0, {}};
  const Diagnosis d = diagnosed(windy, {"draught", "marker_offset", "rig_tilt"}, options);
  EXPECT_EQ(d.cause, "draught");
  EXPECT_EQ(d.likeliest, "draught");
  const EffectFinding& f = finding(d, "draught");
  ASSERT_EQ(f.size.size(), 3u);
  // air_x is not looked at: from here 0.12 is found for 0.08 (docs/diagnosis-measured.md).
  EXPECT_NEAR(f.size[1].value, 0.22, 0.02);
  EXPECT_NEAR(f.size[2].value, 0, 0.06);  // along the fabric it hardly shows
}

// The base fit moves the clock with the fabric: were it held, shear and damping would go to their bounds in its place.
TEST(Diagnosis, ALateClockIsFoundByTheBaseFit) {
  SimulatedSwatch late = usual_fabric();
  late.delay_s = 0.08;
  const Diagnosis d = diagnosed(late, {"camera_delay", "dropped_frames", "creep", "draught"});
  ASSERT_TRUE(d.base_fit.clock.contains("delay"));
  EXPECT_EQ(d.cause, "camera_delay");
  ASSERT_EQ(finding(d, "camera_delay").size.size(), 1u);
  EXPECT_NEAR(finding(d, "camera_delay").size[0].value, 0.08, 0.002);
}

// A fit.json has none, and its parameters stand in for what the clock does.
TEST(Diagnosis, TheClockIsMovedFromAFitToo) {
  SimulatedSwatch late = usual_fabric();
  late.delay_s = 0.02;
  DiagnosisOptions options;
  options.study.fitted = base_of(late, late.material.stretch, late.material.shear);
  const Diagnosis d = diagnosed(late, {"camera_delay"}, options);
  EXPECT_NEAR(d.base_fit.clock.at("delay"), 0.02 / 0.005, 0.6) << "in its scale";
  EXPECT_EQ(d.cause, "camera_delay");
}

// With one effect alone there is no other to go with it.
TEST(Diagnosis, OneWrongEffectStaysAlone) {
  SimulatedSwatch late = usual_fabric();
  late.delay_s = 0.012;
  const Diagnosis d = diagnosed(late, {"creep"});
  EXPECT_LE(d.budget.parts.size(), 1u);
  EXPECT_EQ(d.probability.size(), 3u);
}

// A base fit that put all of the coupling into shear.
TEST(Diagnosis, FindsTheWayBackFromStiffShear) {
  SimulatedSwatch coupled = usual_fabric();
  coupled.material.coupling = 0.4;
  DiagnosisOptions options;
  options.study.base_fit = BaseFit{base_of(coupled, 80, 450), 0, {}};
  const Diagnosis d = diagnosed(coupled, {"coupling", "draught", "creep"}, options);
  EXPECT_EQ(d.cause, "coupling");
  ASSERT_EQ(finding(d, "coupling").size.size(), 1u);
  EXPECT_NEAR(finding(d, "coupling").size[0].value, 0.4, 0.1);
}

TEST(Diagnosis, NamesNothingWhereNothingIsAmiss) {
  const Diagnosis d = diagnosed(usual_fabric());
  EXPECT_EQ(d.cause, "none");
  EXPECT_EQ(d.side, "none");
  EXPECT_TRUE(d.budget.parts.empty());
}

TEST(BaseFit, IsReadBitForBitForTheSameInput) {
  const fs::path file = fs::path(testing::TempDir()) / ("selvedge_base_fit_" + std::to_string(getpid()) + ".json");
  EXPECT_FALSE(read_base_fit(file, "input"));
  const BaseFit written{Eigen::Vector3d(0.1 + 0.2, -2, 1e-300),
                        12,
                        {Eigen::Matrix3Xd::Random(3, 4), Eigen::Matrix3Xd::Random(3, 4)},
                        {{"delay", 0.1 + 0.7}}};
  write_base_fit(file, written, "input");
  const auto fit = read_base_fit(file, "input");
  ASSERT_TRUE(fit);
  EXPECT_EQ(fit->coordinates, written.coordinates);
  EXPECT_EQ(fit->clock, written.clock);
  EXPECT_EQ(fit->branch, written.branch);
  EXPECT_EQ(fit->cells, 12);
  EXPECT_FALSE(read_base_fit(file, "another"));
  files::write_json(file, {{"coordinates", {1, 2}}});
  EXPECT_FALSE(read_base_fit(file, ""));
  fs::remove(file);
}

// Whatever comes after the base fit begins with what is kept of it.
TEST(Diagnosis, GoneOnWithFromItsKeptBaseFitIsTheSameToTheLastBit) {
  SimulatedSwatch late = usual_fabric();
  late.delay_s = 0.012;
  const fs::path file = fs::path(testing::TempDir()) / ("selvedge_kept_" + std::to_string(getpid()) + ".json");
  DiagnosisOptions options;
  options.on_base_fit = [&](const BaseFit& fit) { write_base_fit(file, fit, "input"); };
  const Diagnosis whole = diagnosed(late, {"camera_delay", "draught"}, options);
  DiagnosisOptions again;
  again.study.base_fit = read_base_fit(file, "input");
  ASSERT_TRUE(again.study.base_fit);
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  const Diagnosis resumed = diagnosed(late, {"camera_delay", "draught"}, again);
  EXPECT_EQ(resumed.probability, whole.probability);
  EXPECT_EQ(resumed.inclusion, whole.inclusion);
  EXPECT_EQ(resumed.fit, whole.fit);
  EXPECT_EQ(resumed.gap_mm, whole.gap_mm);
  EXPECT_LT(resumed.evaluations, whole.evaluations);
  fs::remove(file);
}

// A member that is not written is not sealed.
TEST(Protocol, EveryMemberIsSealed) {
  EXPECT_EQ(nlohmann::json(Protocol{}).size() * sizeof(double), sizeof(Protocol));
  Protocol other;
  other.fast_share += 0.01;
  EXPECT_NE(protocol_hash(other, {}), protocol_hash({}, {}));
  EXPECT_NE(protocol_hash({}, effect_library()), protocol_hash({}, {}));
}

}  // namespace
}  // namespace selvedge::diagnose
