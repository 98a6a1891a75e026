// Maps of the fabric: one colour for one error in all pictures of a scale, what is held, and what is kept in the file.
#include "diagnose/fabric_map.h"

#include <regex>
#include <set>

#include <gtest/gtest.h>

namespace selvedge::diagnose {
namespace {

ResidualMap map_of(cloth::Hold hold, double mm) {
  ResidualMap map;
  map.width_m = 0.3;
  map.height_m = 0.4;
  map.held = {hold};
  map.uv = {{0.1, 0.1}, {0.2, 0.3}};
  map.at_mm = {mm, mm / 2};
  return map;
}

std::vector<std::string> colours_of(const std::string& svg) {
  std::vector<std::string> out;
  const std::regex circle("<circle [^>]*fill=\"([^\"]+)\"");
  for (std::sregex_iterator it(svg.begin(), svg.end(), circle), end; it != end; ++it) out.push_back((*it)[1]);
  return out;
}

TEST(FabricMap, OneScaleMakesTwoErrorsTwoColours) {
  const ResidualMap large = map_of(cloth::Hold::corners, 61), small = map_of(cloth::Hold::corners, 2.5);
  const double end = scale_end_mm({&large.at_mm, &small.at_mm});
  EXPECT_EQ(end, 100);
  EXPECT_EQ(scale_end_mm({&small.at_mm}), 5);
  EXPECT_EQ(scale_end_mm({}), 1);
  const std::string a = fabric_map(large, large.at_mm, end, "A"), b = fabric_map(small, small.at_mm, end, "B");
  EXPECT_NE(colours_of(a)[0], colours_of(b)[0]);
  EXPECT_EQ(colours_of(a)[0], colours_of(fabric_map(small, {61, 1}, end, "B"))[0]);  // the same error, the same colour
  for (const std::string& svg : {a, b}) {
    EXPECT_NE(svg.find(">100 mm</text>"), std::string::npos);
    EXPECT_NE(svg.find(">50 mm</text>"), std::string::npos);
  }
}

TEST(FabricMap, SaysAndDrawsWhatIsHeld) {
  std::set<std::string> said;
  for (const cloth::Hold hold : {cloth::Hold::corners, cloth::Hold::top_edge, cloth::Hold::top_edge_clamped,
                                 cloth::Hold::side_edges, cloth::Hold::nothing})
    said.insert(held_in_words(map_of(hold, 1)));
  EXPECT_EQ(said.size(), 5u);
  ResidualMap corners = map_of(cloth::Hold::corners, 1);
  EXPECT_EQ(held_in_words(corners), "the two upper corners are held");
  EXPECT_EQ(held_in_words(map_of(cloth::Hold::top_edge, 1)), "the top edge is held");
  EXPECT_NE(fabric_map(corners, corners.at_mm, 1, "x").find("held-corner"), std::string::npos);
  EXPECT_EQ(fabric_map(map_of(cloth::Hold::top_edge, 1), {1, 1}, 1, "x").find("held-corner"), std::string::npos);
  corners.held.push_back(cloth::Hold::top_edge);
  EXPECT_NE(held_in_words(corners).find("two upper corners or by the top edge"), std::string::npos);
}

TEST(FabricMap, IsReadBackAsItWasWritten) {
  ResidualMap map = map_of(cloth::Hold::top_edge_clamped, 3);
  map.after_mm = {1, 0.25};
  const auto read = read_map(map_to_json(map));
  ASSERT_TRUE(read);
  EXPECT_EQ(read->uv, map.uv);
  EXPECT_EQ(read->at_mm, map.at_mm);
  EXPECT_EQ(read->after_mm, map.after_mm);
  EXPECT_EQ(read->held, map.held);
  nlohmann::json damaged = map_to_json(map);
  damaged["mm"].erase(0);
  EXPECT_FALSE(read_map(damaged));
  EXPECT_FALSE(read_map(nullptr));
  EXPECT_FALSE(read_map({{"size_m", "wide"}}));
}

}  // namespace
}  // namespace selvedge::diagnose
