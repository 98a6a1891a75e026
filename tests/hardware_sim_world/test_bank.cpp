// Keys of the bank: drawn, written and read back; and a campaign of one.
#include <filesystem>
#include <set>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "capture/trial/trial.h"
#include "diagnose/effects/library.h"
#include "hardware_sim/bank/bank_campaign.h"

namespace selvedge::hardware_sim {
namespace {

TEST(BankKey, IsReadAsItWasWritten) {
  std::mt19937_64 generator(5);
  for (const std::string& world : bank_world_names())
    for (const char* kind : {"none", "known", "outside", "set"}) {
      const nlohmann::json written = to_json(draw_key(kind, bank_world(world), generator));
      EXPECT_EQ(to_json(bank_key(written)), written) << kind;
      EXPECT_EQ(written.at("world"), world);
    }
}

TEST(BankKey, ASetIsOfTwoOrThreeEffects) {
  std::mt19937_64 generator(6);
  std::set<size_t> counts;
  for (int i = 0; i < 50; ++i) {
    const BankKey key = draw_key("set", BankWorld::lattice, generator);
    std::set<std::string> names;
    for (const BankEffect& e : key.effects) {
      names.insert(e.name);
      EXPECT_GT(e.size, 0);
    }
    EXPECT_EQ(names.size(), key.effects.size());
    counts.insert(names.size());
  }
  EXPECT_EQ(counts, (std::set<size_t>{2, 3}));
}

// As evidence.md and the percentiles have it.
TEST(BankDesign, IsDrawnWithinItsRanges) {
  std::mt19937_64 generator(8);
  std::vector<double> lengths_mm, densities;
  std::set<SwatchHold> holds;
  std::set<size_t> trials;
  for (int i = 0; i < 400; ++i) {
    const BankKey key = draw_key("none", BankWorld::lattice, generator);
    const BankDesign& d = key.design;
    holds.insert(d.hold);
    trials.insert(d.trials.size());
    EXPECT_GE(d.dots_across * d.dots_down, 9);
    EXPECT_LE(d.dots_across * d.dots_down, 100);
    EXPECT_GE(d.rate_hz, 30);
    EXPECT_LE(d.rate_hz, 240);
    EXPECT_GE(d.noise_m, 1e-4);
    EXPECT_LE(d.noise_m, 2e-3);
    EXPECT_EQ(d.trials.front().kind, trial::Experiment::static_hang);
    for (const BankTrial& t : d.trials)
      if (t.kind != trial::Experiment::static_hang) {
        EXPECT_GE(t.duration_s, 1);
        EXPECT_LE(t.duration_s, 10);
      }
    lengths_mm.push_back(1e3 * bending_length_m(key.truth));
    densities.push_back(key.truth.density);
    EXPECT_LE(9.81 * key.truth.density * kSwatch_m, 0.1 * key.truth.stretch);
  }
  EXPECT_EQ(holds.size(), 2u);
  EXPECT_EQ(*trials.begin(), 3u);
  EXPECT_EQ(*trials.rbegin(), 12u);
  std::sort(lengths_mm.begin(), lengths_mm.end());
  std::sort(densities.begin(), densities.end());
  EXPECT_NEAR(lengths_mm[200], 18.6, 1);
  EXPECT_NEAR(densities[200], 0.197, 0.02);
  EXPECT_GE(lengths_mm.front(), 10);
  EXPECT_LT(lengths_mm[20], 12.5);
}

// Sizes are scored under the names that a diagnosis gives them.
TEST(BankKey, TellsTheTrueParameterAsTheLibraryNamesIt) {
  std::mt19937_64 generator(7);
  std::set<std::string> compared;
  for (int i = 0; i < 200; ++i) {
    const BankKey key = draw_key("known", BankWorld::lattice, generator);
    const auto parameter = true_parameter(key);
    if (!parameter) continue;
    compared.insert(key.cause());
    bool found = false;
    for (const diagnose::Effect& e : diagnose::effect_library())
      for (const model::Parameter& p : e.parameters)
        if (e.name == key.cause() && p.name == parameter->first) {
          found = true;
          EXPECT_GT(parameter->second, p.lower) << key.cause();
          EXPECT_LT(parameter->second, p.upper) << key.cause();
          EXPECT_NE(parameter->second, p.start) << key.cause();
        }
    EXPECT_TRUE(found) << key.cause() << " " << parameter->first;
  }
  EXPECT_EQ(compared.size(), bank_effects().size() - 3);  // hem, rest_curvature, stretch_stiffening
  EXPECT_FALSE(true_parameter(draw_key("none", BankWorld::lattice, generator)));
  EXPECT_FALSE(true_parameter(draw_key("set", BankWorld::lattice, generator)));
}

TEST(BankCampaign, IsRecordedAsItWasDesigned) {
  namespace fs = std::filesystem;
  std::mt19937_64 generator(9);
  BankKey key = draw_key("none", BankWorld::lattice, generator);
  key.effects = {{"camera_delay", 0.01}, {"dropped_frames", 0.4}};
  key.truth.stretch = 60;
  key.design.hold = SwatchHold::top_edge;
  key.design.dots_across = 3;
  key.design.dots_down = 4;
  key.design.rate_hz = 30;
  key.design.trials = {{trial::Experiment::static_hang, 0.2},
                       {trial::Experiment::waving, 0.4},
                       {trial::Experiment::robot, 0.3},
                       {trial::Experiment::robot, 0.3}};
  const fs::path folder = fs::path(testing::TempDir()) / ("selvedge_bank_" + std::to_string(getpid()));
  write_bank_campaign(key, "swatch", folder);
  const trial::Campaign read = trial::read_campaign(folder);
  ASSERT_EQ(read.trials.size(), 4u);
  EXPECT_EQ(read.trials[1].held, trial::Held::top_edge);
  EXPECT_EQ(read.trials[1].markers->time_s.size(), 12u * 12);
  EXPECT_EQ(read.replicates.size(), 1u);
  // Each edge is as long as the fabric, and moves.
  const trial::Corners& corners = read.trials[1].corners;
  EXPECT_NEAR((corners.right.col(0) - corners.left.col(0)).norm(), kSwatch_m, 0.01);
  EXPECT_GT((corners.left.col(11) - corners.left.col(0)).norm(), 0.005);
  fs::remove_all(folder);
}

}  // namespace
}  // namespace selvedge::hardware_sim
