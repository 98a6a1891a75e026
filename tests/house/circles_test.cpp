// No header includes itself on the way round, and no two modules (a header with its .cpp) need one another: each can be
// read and tested before those that use it.
#include <map>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/house/house_files.h"

namespace selvedge::house {
namespace {

using Edges = std::map<std::string, std::vector<std::string>>;

std::string joined(const std::vector<std::string>& parts) {
  std::string text;
  for (const std::string& part : parts) text += (text.empty() ? "" : " ") + part;
  return text;
}

std::string module_of(const std::string& file) { return file.substr(0, file.rfind('.')); }

// Circles of modules that were there when this test was written. The list may only shrink: who breaks one takes its
// line out.
const std::set<std::string> old_circles = {
    "calib/calibration calib/verdict",
    "cloth/bordered_sheet cloth/sheet",
    "cloth/filtered_step cloth/held_motion cloth/implicit_euler cloth/runge_kutta cloth/settle cloth/simulate",
    "hardware_sim/datastream_server/datastream_server hardware_sim/datastream_server/frame_packet",
    "hardware_sim/gige_camera/gige_camera hardware_sim/gige_camera/registers hardware_sim/gige_camera/stream",
    "hardware_sim/usb3_camera/registers hardware_sim/usb3_camera/usb3_camera",
    "rig/arm/control_link rig/arm/control_server rig/arm/daemon",
};

TEST(Circles, NoHeaderIncludesItself) {
  Edges headers;
  for (const auto& [file, targets] : includes_of_the_house())
    if (file.ends_with(".h")) headers[file] = targets;
  EXPECT_GT(headers.size(), 200u);
  for (const auto& circle : circles(headers)) ADD_FAILURE() << "include one another: " << joined(circle);
}

TEST(Circles, NoTwoModulesNeedOneAnother) {
  Edges modules;
  for (const auto& [file, targets] : includes_of_the_house())
    for (const std::string& target : targets)
      if (module_of(target) != module_of(file)) modules[module_of(file)].push_back(module_of(target));
  std::set<std::string> found;
  for (const auto& circle : circles(modules)) found.insert(joined(circle));
  for (const std::string& circle : found) EXPECT_TRUE(old_circles.count(circle)) << "need one another: " << circle;
  for (const std::string& circle : old_circles)
    EXPECT_TRUE(found.count(circle)) << "is no circle any more, so take it out of old_circles: " << circle;
}

TEST(Circles, AreFound) {
  EXPECT_EQ(circles({{"a", {"b"}}, {"b", {"c"}}, {"c", {"d"}}}), (std::vector<std::vector<std::string>>{}));
  EXPECT_EQ(circles({{"a", {"b", "d"}}, {"b", {"c"}}, {"c", {"a"}}, {"d", {"e"}}, {"e", {"d"}}}),
            (std::vector<std::vector<std::string>>{{"d", "e"}, {"a", "b", "c"}}));
}

}  // namespace
}  // namespace selvedge::house
