// The data files: every example is read, and what a person can get wrong is refused with file and key.
#include <set>

#include <gtest/gtest.h>

#include "experiments/experiment_file.h"
#include "files/bad_input.h"
#include "tests/experiments/small_experiment.h"

namespace selvedge::experiments {
namespace {

TEST(ExperimentFile, EveryExampleIsReadAndEveryKindHasOne) {
  std::set<Kind> kinds;
  for (const auto& entry : std::filesystem::directory_iterator(kExamples)) {
    const ExperimentFile file = read_experiment(entry.path());
    kinds.insert(file.kind);
    EXPECT_EQ(file.fabrics.size(), 4u) << entry.path();
    EXPECT_FALSE(file.paper.source.empty()) << entry.path();
  }
  EXPECT_EQ(kinds.size(), 6u);
}

TEST(ExperimentFile, HasThePapersCells) {
  const ExperimentFile statics = read_experiment(kExamples / "static.toml"),
                       waving = read_experiment(kExamples / "waving.toml");
  EXPECT_EQ(statics.paper.fabrics.size(), 4u);
  EXPECT_EQ(statics.paper.fabrics.at("knit").at("E1"), (std::vector<std::string>{"253.1", "172.8", ""}));
  EXPECT_EQ(statics.paper.repeated.at("bend").back(), "9.18");
  EXPECT_EQ(waving.paper.fabrics.at("satin").at("E1+E2"), (std::vector<std::string>{"", "379.2", "292.7"}));
  EXPECT_EQ(waving.paper.fabrics.at("linen").size(), 12u);
}

struct Mistake {
  std::string from, to, named;
};

class WrongFile : public testing::TestWithParam<Mistake> {};

TEST_P(WrongFile, IsRefusedNamingTheKey) {
  std::string text = small_experiment("waving");
  const size_t at = text.find(GetParam().from);
  ASSERT_NE(at, std::string::npos);
  text.replace(at, GetParam().from.size(), GetParam().to);
  const ScratchFolder folder("wrong");
  const std::filesystem::path path = folder.write("e.toml", text);
  try {
    read_experiment(path);
    FAIL() << "was accepted";
  } catch (const BadInput& error) {
    const std::string what = error.what();
    EXPECT_NE(what.find("e.toml"), std::string::npos) << what;
    EXPECT_NE(what.find(GetParam().named), std::string::npos) << what;
    EXPECT_EQ(what.find('\n'), std::string::npos) << what;
  }
}

INSTANTIATE_TEST_SUITE_P(
    ByMistake, WrongFile,
    testing::Values(Mistake{"title", "titel", "titel"}, Mistake{"\"waving\"", "\"weaving\"", "kind"},
                    Mistake{"[\"felt\"]", "[\"silk\"]", "silk"}, Mistake{"[\"felt\"]", "[]", "fabrics"},
                    Mistake{"density = 0.2", "density = 20", "density"}, Mistake{"bend = 1.5e-4\n", "", "bend"},
                    Mistake{"shear = 110", "shear = \"stiff\"", "shear"},
                    Mistake{"shear = 110", "sheer = 110", "shear"}, Mistake{"[\"a\"]", "[\"b\"]", "names"},
                    Mistake{"[\"a\"]", "[]", "names"}, Mistake{"apart_m = 0.29", "apart_m = 2", "apart_m"},
                    Mistake{"frequency_hz = 1.2", "frequency_hz = nan", "frequency_hz"},
                    Mistake{"[\"annealing\"]", "[\"anealing\"]", "optimisers"},
                    Mistake{"evaluations = 20", "evaluations = 0", "evaluations"},
                    Mistake{"evaluations = 20", "evaluations = 2.5", "evaluations"}, Mistake{"[fit]", "[fits]", "fits"},
                    Mistake{"[fit]", "[fit", "e.toml:"}, Mistake{"[\"12.5\"]", "[\"12.5\", \"3\"]", "E1"},
                    Mistake{"bend = [", "bent = [", "bent"}, Mistake{"[paper.felt]", "[paper.silk]", "silk"}));

TEST(ExperimentFile, RobotNeedsARobotTrialAndSkirtNoTrials) {
  const ScratchFolder folder("kinds");
  std::string text = small_experiment("waving");
  EXPECT_THROW(read_experiment(folder.write("e.toml", text.replace(text.find("\"waving\""), 8, "\"robot\""))),
               BadInput);
  text = small_experiment("waving");
  EXPECT_THROW(read_experiment(folder.write("e.toml", text.replace(text.find("\"waving\""), 8, "\"skirt\""))),
               BadInput);
}

}  // namespace
}  // namespace selvedge::experiments
