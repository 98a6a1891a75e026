// Keys of the bank: drawn, written and read back.
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

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

}  // namespace
}  // namespace selvedge::hardware_sim
