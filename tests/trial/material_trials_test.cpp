// Material tests as trials: what is written reads back equal, and every damage is refused by file and line or key.
#include <functional>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "capture/trial/trial_writer.h"
#include "files/json_reader.h"
#include "files/whole_file.h"
#include "tests/refusal.h"
#include "tests/rig/temporary_folder.h"

namespace selvedge::trial {
namespace {

namespace fs = std::filesystem;
using Eigen::Index;

class MaterialTrials : public testing::Test {
 protected:
  static Trial cantilever() {
    Trial t;
    t.experiment = Experiment::cantilever;
    t.fabric = {"denim", 0.025, 0.2, 0.001, true};
    t.cantilever = Cantilever{90, 0.05, 0.031, Eigen::Matrix2Xd(2, 5)};
    t.cantilever->midline_m << 0, 0.012, 0.024, 0.035, 0.045, 0, 0.001, 0.0045, 0.0095, 0.0162;
    return t;
  }

  static Trial cusick() {
    Trial t;
    t.experiment = Experiment::cusick;
    t.fabric = {"denim", 0.3, 0.3, 0.0135, true};
    t.cusick = Cusick{0.3, 0.18, {}};
    for (int capture = 1; capture < 3; ++capture) {
      Outline o{capture, Eigen::Matrix2Xd(2, 40)};
      for (Index i = 0; i < 40; ++i) {
        const double angle = 2 * M_PI * static_cast<double>(i) / 40, radius = 0.12 + 0.015 * std::sin(5 * angle);
        o.point_m.col(i) << radius * std::cos(angle), radius * std::sin(angle);
      }
      t.cusick->outlines.push_back(o);
    }
    return t;
  }

  static Trial tensile() {
    Trial t;
    t.experiment = Experiment::tensile;
    t.fabric = {"denim", 0.05, 0.2, 0.002, true};
    t.tensile = Tensile{0, 0.05, 0.1, "gf", {}};
    for (int number = 3; number < 5; ++number)
      t.tensile->pulls.push_back(
          {number, {0, 0.1, 0.2, 0.3}, {0, 1, 2.5, 4}, {1, 1.1, 1.2, 1.3}, {1, 0.97, std::nan(""), 0.9}});
    return t;
  }

  fs::path written(const Trial& trial) {
    const fs::path folder = folder_ / to_text(trial.experiment);
    fs::remove_all(folder);
    write_trial(trial, folder);
    return folder;
  }

  // What is said of the trial with its trial.json changed so.
  std::string refused(const Trial& trial, const std::function<void(nlohmann::json&)>& change) {
    const fs::path folder = written(trial);
    nlohmann::json about = files::JsonReader(folder / "trial.json").object();
    change(about);
    files::write_json(folder / "trial.json", about);
    return refusal_of([&] { read_trial(folder); });
  }

  std::string refused(const Trial& trial, const std::string& table, const std::string& text) {
    const fs::path folder = written(trial);
    files::write_whole(folder / table, text);
    return refusal_of([&] { read_trial(folder); });
  }

  const rig::TemporaryFolder temporary_;
  const fs::path folder_ = temporary_.path();
};

testing::AssertionResult says(const std::string& text, const std::vector<std::string>& parts) {
  for (const std::string& part : parts)
    if (text.find(part) == std::string::npos) return testing::AssertionFailure() << '"' << text << "\" lacks " << part;
  return testing::AssertionSuccess();
}

TEST_F(MaterialTrials, ReadBackEqual) {
  const Trial a = read_trial(written(cantilever()));
  EXPECT_EQ(a.experiment, Experiment::cantilever);
  EXPECT_EQ(a.cantilever->angle_deg, 90);
  EXPECT_EQ(a.cantilever->overhang_m, 0.05);
  EXPECT_EQ(a.cantilever->bending_length_m, 0.031);
  EXPECT_EQ(a.cantilever->midline_m, cantilever().cantilever->midline_m);

  const Trial b = read_trial(written(cusick()));
  ASSERT_EQ(b.cusick->outlines.size(), 2u);
  EXPECT_EQ(b.cusick->outlines[1].capture, 2);
  EXPECT_EQ(b.cusick->outlines[1].point_m, cusick().cusick->outlines[1].point_m);
  EXPECT_NEAR(areal_mass(b), 0.0135 / (M_PI * 0.15 * 0.15), 1e-12);

  const Trial c = read_trial(written(tensile()));
  ASSERT_EQ(c.tensile->pulls.size(), 2u);
  EXPECT_EQ(c.tensile->pulls[0].number, 3);
  EXPECT_EQ(c.tensile->pulls[1].force, tensile().tensile->pulls[1].force);
  EXPECT_EQ(c.tensile->pulls[1].stretch_across[3], 0.9);
  EXPECT_TRUE(std::isnan(c.tensile->pulls[1].stretch_across[2]));
  EXPECT_EQ(c.tensile->force_unit, "gf");
}

TEST_F(MaterialTrials, ABendingLengthAloneWillDo) {
  Trial t = cantilever();
  t.cantilever->midline_m.resize(2, 0);
  EXPECT_EQ(read_trial(written(t)).cantilever->midline_m.cols(), 0);
  t.cantilever->bending_length_m.reset();
  const fs::path folder = written(t);
  EXPECT_TRUE(says(refusal_of([&] { read_trial(folder); }), {"trial.json", "bending_length_m", "midline.csv"}));
}

TEST_F(MaterialTrials, KeysAreRefusedByName) {
  EXPECT_TRUE(says(refused(cantilever(), [](auto& j) { j.erase("cantilever"); }), {"trial.json", "cantilever"}));
  EXPECT_TRUE(says(refused(cantilever(), [](auto& j) { j["cantilever"]["overhang_m"] = -1; }),
                   {"cantilever.overhang_m", "-1"}));
  EXPECT_TRUE(says(refused(cantilever(), [](auto& j) { j["cantilever"]["angle_deg"] = 500; }),
                   {"cantilever.angle_deg", "500"}));
  EXPECT_TRUE(says(refused(cusick(), [](auto& j) { j["cusick"]["support_m"] = 0.4; }),
                   {"cusick.support_m", "less than disc_m"}));
  EXPECT_TRUE(says(refused(cusick(), [](auto& j) { j["cusick"]["disc_m"] = 300; }), {"cusick.disc_m", "10 m"}));
  EXPECT_TRUE(says(refused(tensile(), [](auto& j) { j["tensile"].erase("length_m"); }), {"tensile.length_m"}));
}

TEST_F(MaterialTrials, TablesAreRefusedByLine) {
  EXPECT_TRUE(says(refused(cantilever(), "midline.csv", "along_m,down_m\n0,0\n0.1,0\n0.2,0\n0.3,0\n"),
                   {"midline.csv", "0.3 m", "overhang_m"}));
  EXPECT_TRUE(says(refused(cantilever(), "midline.csv", "along_m,down_m\n0,0\n"), {"midline.csv", "1 rows"}));
  EXPECT_TRUE(says(refused(cantilever(), "midline.csv", "along_m,down_m\n0,0\n0.01,-0.002\n0.02,-0.004\n0.03,-0.006\n"),
                   {"midline.csv:5", "down_m", "-0.006"}));
  std::string clockwise = "capture,x_m,y_m\n", outside = clockwise, apart = clockwise;
  for (int i = 0; i < 20; ++i) {
    const double angle = 2 * M_PI * i / 20;
    clockwise += fmt::format("1,{},{}\n", 0.1 * std::cos(angle), -0.1 * std::sin(angle));
    outside += fmt::format("1,{},{}\n", 0.2 * std::cos(angle), 0.2 * std::sin(angle));
    apart += fmt::format("{},{},{}\n", i % 2, 0.1 * std::cos(angle), 0.1 * std::sin(angle));
  }
  EXPECT_TRUE(says(refused(cusick(), "outline.csv", clockwise), {"outline.csv:2", "clockwise"}));
  EXPECT_TRUE(says(refused(cusick(), "outline.csv", outside), {"outline.csv:2", "0.2 m"}));
  EXPECT_TRUE(says(refused(cusick(), "outline.csv", apart), {"outline.csv:4", "capture", "again"}));
  const std::string head = "pull,t_s,force_n,stretch_along,stretch_across\n1,0,0,1,1\n1,1,1,1.1,\n1,2,2,1.2,0.9\n";
  EXPECT_TRUE(says(refused(tensile(), "pull.csv", head + "1,1.5,3,1.3,0.9\n"), {"pull.csv:5", "backwards"}));
  EXPECT_TRUE(says(refused(tensile(), "pull.csv", head + "1,3,3,0,0.9\n"), {"pull.csv:5", "stretch_along"}));
  EXPECT_TRUE(says(refused(tensile(), "pull.csv", head + "2,3,3,1,0.9\n"), {"pull.csv:2", "3 rows of pull 1"}));
  const fs::path folder = written(tensile());
  fs::remove(folder / "pull.csv");
  EXPECT_TRUE(says(refusal_of([&] { read_trial(folder); }), {"pull.csv"}));
}

TEST_F(MaterialTrials, ACampaignIsTakenApart) {
  Campaign campaign;
  Trial hung;
  hung.name = "hung";
  Trial strip = cantilever();
  strip.name = "strip";
  campaign.trials = {hung, strip, strip};
  campaign.trials[2].name = "again";
  campaign.replicates = {{"strip", "again"}, {"hung", "strip"}};
  const Campaign tests = only_tests(campaign, true), rig = only_tests(campaign, false);
  ASSERT_EQ(tests.trials.size(), 2u);
  ASSERT_EQ(rig.trials.size(), 1u);
  EXPECT_EQ(rig.trials[0].name, "hung");
  EXPECT_EQ(tests.replicates, (std::vector<std::vector<std::string>>{{"strip", "again"}}));
  EXPECT_TRUE(rig.replicates.empty());
}

}  // namespace
}  // namespace selvedge::trial
