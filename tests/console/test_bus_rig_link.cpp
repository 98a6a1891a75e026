// The console's link where there is no rig.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include <fmt/format.h>
#include <unistd.h>

#include "console/bus_rig_link.h"
#include "files/bad_input.h"

namespace selvedge::console {
namespace {

// "Stopped" is said of an arm that was told so, and of a rig that is known to have none.
TEST(BusRigLink, AStopThatReachesNobodyIsNotConfirmed) {
  const auto folder = std::filesystem::temp_directory_path() / fmt::format("selvedge-no-rig-{}", ::getpid());
  std::filesystem::create_directories(folder);
  BusRigLink link({folder / "rig.toml", folder / "calibration.json", folder});
  EXPECT_THROW(link.stop("test"), BadInput);
  std::ofstream(folder / "rig.toml") << "this is no TOML";
  EXPECT_THROW(link.stop("test"), BadInput);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace selvedge::console
