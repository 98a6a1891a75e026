// Sealing, answering and scoring, without a simulation.
#include <filesystem>
#include <fstream>
#include <map>

#include <gtest/gtest.h>
#include <unistd.h>

#include "evaluation/blind.h"
#include "evaluation/true_shares.h"
#include "files/bad_input.h"
#include "files/whole_file.h"

namespace selvedge::evaluation {
namespace {

namespace fs = std::filesystem;

diagnose::Diagnosis says(const std::string& cause) {
  diagnose::Diagnosis d;
  d.cause = d.side = cause;
  d.probability = {{"none", 0.05}, {"unknown", 0.05}, {"draught", 0.0}};
  d.probability[cause] = 0.9;
  d.effects.resize(1);
  d.effects[0].name = "draught";
  d.effects[0].side = diagnose::Side::aerodynamic;
  d.effects[0].screened_gain = 0.1;
  d.before_mm = 4;
  d.right_floor_mm = 1;
  if (cause == "draught") {
    d.confusable = {"draught"};
    d.side = "aerodynamic";
  }
  return d;
}

constexpr const char* kSeal = "library";

class Blind : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) / ("selvedge_blind_" + std::to_string(getpid()));
    fs::remove_all(folder_);
    seal_keys(folder_,
              {{"c1", "salt1", {{"cause", "none"}}},
               {"c2", "salt2", {{"cause", "draught"}}},
               {"c3", "salt3", {{"cause", "unknown"}}}},
              kSeal);
  }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path folder_;
};

TEST(ClopperPearson, AgreesWithTables) {
  const auto [low, high] = clopper_pearson(2, 100);
  EXPECT_NEAR(low, 0.0024, 1e-4);
  EXPECT_NEAR(high, 0.0704, 1e-4);
  EXPECT_EQ(clopper_pearson(0, 10).first, 0);
  EXPECT_NEAR(clopper_pearson(0, 10).second, 0.3085, 1e-4);
}

TEST_F(Blind, ScoresOnlyFinalAnswersAndGoesOn) {
  int asked = 0;
  const auto diagnosed = [&](const fs::path& campaign) {
    ++asked;
    return says(campaign.filename() == "c1" ? "none" : "draught");
  };
  EXPECT_EQ(answer_all(folder_, kSeal, diagnosed, [&] { return asked >= 1; }), 1u);
  EXPECT_THROW(open_keys(folder_, kSeal, false), BadInput);
  EXPECT_EQ(answer_all(folder_, kSeal, diagnosed, [] { return false; }), 3u);
  EXPECT_EQ(asked, 3);
  const BlindScore s = open_keys(folder_, kSeal, false);
  EXPECT_EQ(s.answered, 3u);
  EXPECT_EQ(s.rows[0].hits, 0);  // alarms
  EXPECT_EQ(s.rows[0].of, 1);
  EXPECT_EQ(s.rows[1].hits, 1);  // draught named
  EXPECT_EQ(s.rows[1].of, 1);
  EXPECT_EQ(s.rows[3].hits, 0);  // the foreign one was not called unknown
  EXPECT_EQ(s.rows[4].hits, 1);  // but wrongly and with confidence
  EXPECT_EQ(s.rows[4].of, 3);
  EXPECT_EQ(s.baselines[0].hits, 2);
}

TEST_F(Blind, TwoProcessesShareTheWork) {
  int outer = 0, inner = 0;
  const auto other = [&](const fs::path&) {
    ++inner;
    return says("none");
  };
  const auto first = [&](const fs::path&) {
    ++outer;
    answer_all(folder_, kSeal, other, [] { return false; });  // as another process would meanwhile
    return says("none");
  };
  EXPECT_EQ(answer_all(folder_, kSeal, first, [] { return false; }), 3u);
  EXPECT_EQ(outer, 1);
  EXPECT_EQ(inner, 2);
  EXPECT_NO_THROW(open_keys(folder_, kSeal, false));
}

TEST(BlindSets, AreIncludedWholeOrNot) {
  const fs::path folder = fs::path(testing::TempDir()) / ("selvedge_blind_sets_" + std::to_string(getpid()));
  fs::remove_all(folder);
  seal_keys(folder,
            {{"both", "s", {{"cause", "hem+draught"}}},
             {"one", "t", {{"cause", "draught+hem"}}},
             {"three", "u", {{"cause", "draught+hem+creep"}}}},
            kSeal);
  answer_all(
      folder, kSeal,
      [](const fs::path& campaign) {
    diagnose::Diagnosis d = says("draught");
    d.probability = {{"none", 0.01}, {"unknown", 0.03}, {"hem", 0.01}, {"draught", 0.95}};
    d.inclusion = {{"hem", 0.2}, {"draught", 0.95}, {"coupling", 0.1}};
    if (campaign.filename() == "both") d.inclusion["hem"] = 0.9;
    if (campaign.filename() == "three") d.inclusion["coupling"] = 0.6;
    d.budget.parts = {{"draught", 0.95, {0.7, 0.5, 0.9}}};
    return d;
      },
      [] { return false; });
  const auto row = [&](const Truth& truth, const std::string& begin) {
    for (const ScoreRow& r : open_keys(folder, kSeal, false, truth).rows)
      if (r.what.starts_with(begin)) return std::pair{r.hits, r.of};
    return std::pair{-1, -1};
  };
  EXPECT_EQ(row({}, "sets: every effect"), (std::pair{1, 3}));
  EXPECT_EQ(row({}, "sets: none included wrongly"), (std::pair{2, 3}));
  EXPECT_EQ(row({}, "any campaign: wrong"), (std::pair{0, 3}));
  // Where hem takes little it need not be included; where it takes most, it should have been named.
  Truth truth;
  std::vector<Opened> beside;
  truth.begins = [&](const std::vector<Opened>& answers) { beside = answers; };
  truth.shares = [&](const SealedKey& key, const nlohmann::json&) {
    EXPECT_EQ(beside.size(), 3u) << "answers are told before anything is simulated";
    if (key.id == "one") return std::map<std::string, double>{{"draught", 0.8}, {"hem", 0.1}};
    if (key.id == "both") return std::map<std::string, double>{{"draught", 0.3}, {"hem", 0.6}};
    return std::map<std::string, double>{{"draught", 0.45}, {"hem", 0.3}, {"creep", 0.1}};
  };
  EXPECT_EQ(row(truth, "sets: every effect"), (std::pair{2, 3}));
  EXPECT_EQ(row(truth, "any campaign: wrong"), (std::pair{1, 3}));
  ASSERT_EQ(beside.size(), 3u);
  EXPECT_EQ(beside[0].id + beside[0].truth + beside[0].named, "bothhem+draughtdraught");
  EXPECT_TRUE(beside[0].right);
  EXPECT_EQ(row(truth, "budget: the 90 % interval"), (std::pair{1, 3}));
  const BlindScore s = open_keys(folder, kSeal, false, truth);
  EXPECT_NEAR(s.share_error, 0.25, 1e-9);
  // Draught 3 × 0.95 there; hem 0.2 twice and 0.9 there; coupling 0.1 twice and 0.6 not there.
  EXPECT_EQ(s.inclusions, 9);
  EXPECT_NEAR(s.inclusion_error, (std::abs(3 * 0.95 + 0.9 - 4) + std::abs(0.4 - 2) + 0.2 + 0.6) / 9, 1e-9);
  fs::remove_all(folder);
}

TEST(Shapley, SharesWhatTwoMakeTogether) {
  // Alone 1 and 2, together 5: each has half of the 2 that neither makes alone. A third makes nothing.
  const std::vector<double> parts = shapley(3, [](unsigned s) {
    return (s & 3u) == 3u ? 5.0 : (s & 1u) != 0 ? 1.0 : (s & 2u) != 0 ? 2.0 : 0.0;
  });
  EXPECT_NEAR(parts[0], 2, 1e-12);
  EXPECT_NEAR(parts[1], 3, 1e-12);
  EXPECT_NEAR(parts[2], 0, 1e-12);
}

TEST_F(Blind, CountsWhatIsSaidWithTheEffectDeleted) {
  answer_all(
      folder_, kSeal, [](const fs::path&) { return says("draught"); }, [] { return false; });
  const std::vector<NamedRight> right = named_right(folder_, kSeal, false);
  ASSERT_EQ(right.size(), 1u);
  EXPECT_EQ(right[0].id, "c2");
  EXPECT_EQ(right[0].cause, "draught");
  EXPECT_EQ(score_without(folder_, right)[0].of, 0);
  fs::create_directories(folder_ / "without" / "c2");
  files::write_json(folder_ / "without" / "c2" / "diagnosis.json", {{"cause", "unknown"}});
  EXPECT_EQ(score_without(folder_, right)[0].hits, 1);
  files::write_json(folder_ / "without" / "c2" / "diagnosis.json", {{"cause", "hem"}});
  EXPECT_EQ(score_without(folder_, right)[2].hits, 1);
}

TEST_F(Blind, TellsHowFarToldShrinkIsFromThatOfFreshTrials) {
  answer_all(
      folder_, kSeal,
      [](const fs::path&) {
    diagnose::Diagnosis d = says("draught");
    d.effects[0].weighed = true;
    d.effects[0].reduction = {4, 1.6, 0.6, 0.5, 0.7};
    return d;
      },
      [] { return false; });
  Truth truth;
  truth.reduction = [](const SealedKey& key, const nlohmann::json&, const std::string& effect) {
    EXPECT_EQ(key.id, "c2");
    EXPECT_EQ(effect, "draught");
    return std::optional<double>(0.45);
  };
  const BlindScore s = open_keys(folder_, kSeal, false, truth);
  EXPECT_EQ(s.reductions, 1u);
  EXPECT_NEAR(s.reduction_error, 0.15, 1e-9);
}

TEST_F(Blind, CountsIntervalsThatHoldTheTrueSize) {
  answer_all(
      folder_, kSeal,
      [](const fs::path&) {
    diagnose::Diagnosis d = says("draught");
    d.effects[0].weighed = true;
    d.effects[0].size = {{"air_y", "m/s", 0.2, 0.15, 0.25}};
    return d;
      },
      [] { return false; });
  const auto held = [&](double truly) {
    Truth truth;
    truth.size = [&](const SealedKey& key) {
      EXPECT_EQ(key.id, "c2");
      return std::optional(TrueParameter{"air_y", truly});
    };
    const BlindScore s = open_keys(folder_, kSeal, false, truth);
    EXPECT_EQ(s.sizes.size(), 1u);
    for (const ScoreRow& r : s.rows)
      if (r.what.starts_with("size")) return std::pair{r.hits, r.of};
    return std::pair{-1, -1};
  };
  EXPECT_EQ(held(0.24), (std::pair{1, 1}));
  EXPECT_EQ(held(0.26), (std::pair{0, 1}));
}

TEST_F(Blind, AnotherProtocolThanTheSealedOneNeitherAnswersNorOpens) {
  const auto none = [](const fs::path&) { return says("none"); };
  EXPECT_THROW(answer_all(folder_, "another", none, [] { return false; }), BadInput);
  EXPECT_FALSE(fs::exists(folder_ / "answers"));
  answer_all(folder_, kSeal, none, [] { return false; });
  EXPECT_THROW(open_keys(folder_, "another", false), BadInput);
  EXPECT_NO_THROW(open_keys(folder_, kSeal, false));
}

TEST_F(Blind, RefusesChangedAnswersAndKeys) {
  answer_all(
      folder_, kSeal, [](const fs::path&) { return says("none"); }, [] { return false; });
  const fs::path one = folder_ / "answers" / "c2" / "diagnosis.json";
  const std::string bytes = files::read_whole(one);
  files::write_whole(one, bytes + " ");
  EXPECT_THROW(open_keys(folder_, kSeal, false), BadInput);
  files::write_whole(one, bytes);
  EXPECT_NO_THROW(open_keys(folder_, kSeal, false));
  nlohmann::json keys = files::read_json(folder_ / "keys.json");
  keys[1]["key"]["cause"] = "none";
  files::write_json(folder_ / "keys.json", keys);
  EXPECT_THROW(open_keys(folder_, kSeal, false), BadInput);
}

}  // namespace
}  // namespace selvedge::evaluation
