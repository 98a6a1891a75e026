// The short versions of the proofs of fits and diagnoses: every figure they judge holds.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "cli/verify/figures.h"

namespace selvedge::cli {
namespace {

std::vector<Figure> quick_figures(const std::vector<FigureSet>& sets, const std::string& name) {
  const auto set = std::find_if(sets.begin(), sets.end(), [&](const FigureSet& s) { return s.name == name; });
  if (set == sets.end()) return {};
  FigureOptions options;
  options.quick = true;
  return set->run(options);
}

class QuickProof : public testing::TestWithParam<std::string> {};

TEST_P(QuickProof, EveryFigureHolds) {
  const std::vector<Figure> figures = quick_figures(proofs(), GetParam());
  EXPECT_TRUE(
      std::any_of(figures.begin(), figures.end(), [](const Figure& f) { return f.relation != Relation::shown; }));
  for (const Figure& f : figures) EXPECT_TRUE(holds(f)) << f.what << ": " << f.measured << " beside " << f.reference;
}

INSTANTIATE_TEST_SUITE_P(ByName, QuickProof, testing::Values("diagnosis", "fit", "louchet", "simulator"),
                         [](const auto& info) { return info.param; });

TEST(FitBench, EndsCloserThanItStarted) {
  const std::vector<Figure> figures = quick_figures(benches(), "fit");
  ASSERT_GE(figures.size(), 4u);
  EXPECT_LT(figures[3].measured, 0.7 * figures[2].measured);  // mm, end and start
}

}  // namespace
}  // namespace selvedge::cli
