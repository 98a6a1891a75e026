// Recorded and simulated pictures over one another. What a browser does with them: pages.mjs.
#include "report/flipped_pictures.h"

#include <filesystem>
#include <string>

#include <gtest/gtest.h>
#include <unistd.h>

#include "files/whole_file.h"
#include "report/base64.h"
#include "report/html.h"
#include "tests/keep_page.h"

namespace selvedge::report {
namespace {

namespace fs = std::filesystem;

// Four by three pixels of one grey, 40 and 200.
constexpr const char* kDark =
    "iVBORw0KGgoAAAANSUhEUgAAAAQAAAADCAAAAACRn/EaAAAADklEQVR42mPQAAIGOAEADh8B4RTI5fEAAAAASUVORK5CYII=";
constexpr const char* kLight =
    "iVBORw0KGgoAAAANSUhEUgAAAAQAAAADCAAAAACRn/EaAAAADklEQVR42mM4AQQMcAIARl8JYX4NFOUAAAAASUVORK5CYII=";

TEST(FlippedPictures, StandInTheReportWithTheirNames) {
  const PicturePair first{"waving-<1>, frame 3", from_base64(kDark).value(), from_base64(kLight).value()};
  HtmlReport html("Pictures");
  html.heading("Recorded and simulated");
  html.interactive(flipped_pictures({first, {"waving-1, frame 9", first.simulated, first.recorded}}), "caption");
  const fs::path page = fs::path(testing::TempDir()) / ("selvedge_flipped_" + std::to_string(getpid()) + ".html");
  html.write(page);
  keep_page(page, "pictures");
  const std::string text = files::read_whole(page);
  fs::remove(page);
  for (const std::string& part :
       {std::string("alt=\"waving-&lt;1&gt;, frame 3: recorded\" src=\"data:image/png;base64,") + kDark,
        std::string("alt=\"waving-&lt;1&gt;, frame 3: simulated\" src=\"data:image/png;base64,") + kLight,
        std::string("data-name=\"waving-1, frame 9\"")})
    EXPECT_NE(text.find(part), std::string::npos) << part;
  EXPECT_EQ(text.find("<1>"), std::string::npos);
}

}  // namespace
}  // namespace selvedge::report
