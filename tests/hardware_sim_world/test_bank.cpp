// Keys of the bank: drawn, written and read back.
#include <set>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "diagnose/effects/library.h"
#include "hardware_sim/bank/bank_campaign.h"

namespace selvedge::hardware_sim {
namespace {

TEST(BankKey, IsReadAsItWasWritten) {
  std::mt19937_64 generator(5);
  for (const char* kind : {"none", "known", "outside", "pair"}) {
    const nlohmann::json written = to_json(draw_key(kind, generator));
    EXPECT_EQ(to_json(bank_key(written)), written) << kind;
  }
}

TEST(BankKey, APairIsOfTwoEffects) {
  std::mt19937_64 generator(6);
  for (int i = 0; i < 50; ++i) {
    const BankKey key = draw_key("pair", generator);
    EXPECT_NE(key.cause, key.second);
    EXPECT_GT(key.size, 0);
    EXPECT_GT(key.second_size, 0);
  }
}

// Sizes are scored under the names that a diagnosis gives them.
TEST(BankKey, TellsTheTrueParameterAsTheLibraryNamesIt) {
  std::mt19937_64 generator(7);
  std::set<std::string> compared;
  for (int i = 0; i < 200; ++i) {
    const BankKey key = draw_key("known", generator);
    const auto parameter = true_parameter(key);
    if (!parameter) continue;
    compared.insert(key.cause);
    bool found = false;
    for (const diagnose::Effect& e : diagnose::effect_library())
      for (const model::Parameter& p : e.parameters)
        if (e.name == key.cause && p.name == parameter->first) {
          found = true;
          EXPECT_GT(parameter->second, p.lower) << key.cause;
          EXPECT_LT(parameter->second, p.upper) << key.cause;
          EXPECT_NE(parameter->second, p.start) << key.cause;
        }
    EXPECT_TRUE(found) << key.cause << " " << parameter->first;
  }
  EXPECT_EQ(compared.size(), bank_effects().size() - 3);  // hem, rest_curvature, stretch_stiffening
  EXPECT_FALSE(true_parameter(draw_key("none", generator)));
  EXPECT_FALSE(true_parameter(draw_key("pair", generator)));
}

}  // namespace
}  // namespace selvedge::hardware_sim
