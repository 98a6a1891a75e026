#include "rig/configuration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/refusal.h"

namespace selvedge::rig {
namespace {

using ::testing::HasSubstr;

const char* kText =
    "[bus]\nport = 7700\n[camera]\nbackend = \"aravis\"\nexposure_s = 0.002\nheight_px = 480\n"
    "corner_m = [0.1, 0.2, 0.3]\n";

TEST(Configuration, ReadsWhatIsThereAndFallsBackElsewhere) {
  const Configuration configuration = Configuration::parse(kText, "rig.toml");
  EXPECT_EQ(configuration.bus().port, 7700);
  EXPECT_EQ(configuration.bus().receive_buffer_bytes, 4194304);
  EXPECT_EQ(configuration.bus().key_file, "");
  EXPECT_EQ(Configuration::parse("[bus]\nkey_file = \"/etc/selvedge/bus.key\"\n", "rig.toml").bus().key_file,
            "/etc/selvedge/bus.key");
  Section camera = configuration.section("camera");
  EXPECT_EQ(camera.choice("backend", std::nullopt, {"aravis", "v4l2"}), "aravis");
  EXPECT_EQ(camera.number("exposure_s", std::nullopt, 0, 1, "s"), 0.002);
  EXPECT_EQ(camera.integer("height_px", std::nullopt, 1, 10000, "px"), 480);
  EXPECT_EQ(camera.numbers("corner_m", std::nullopt, 3, -1, 1, "m"), (std::vector<double>{0.1, 0.2, 0.3}));
  EXPECT_EQ(camera.text("name", "camera"), "camera");
  EXPECT_NO_THROW(camera.finish());
}

TEST(Configuration, NamesFileSectionKeyFoundAndExpected) {
  const Configuration configuration = Configuration::parse(kText, "rig.toml");
  const auto camera = [&] { return configuration.section("camera"); };
  EXPECT_THAT(refusal_of([&] { camera().number("exposure_s", std::nullopt, 0.01, 1, "s"); }),
              AllOf(HasSubstr("rig.toml [camera] exposure_s"), HasSubstr("0.002"), HasSubstr("0.01 to 1 s")));
  EXPECT_THAT(refusal_of([&] { camera().number("rate_hz", std::nullopt, 0, 1, "Hz"); }), HasSubstr("missing"));
  EXPECT_THAT(refusal_of([&] { camera().number("backend", std::nullopt, 0, 1, "Hz"); }), HasSubstr("a number in Hz"));
  EXPECT_THAT(refusal_of([&] { camera().integer("exposure_s", std::nullopt, 0, 1); }), HasSubstr("a whole number"));
  EXPECT_THAT(refusal_of([&] { camera().numbers("corner_m", std::nullopt, 2, -1, 1, "m"); }), HasSubstr("expected 2"));
  EXPECT_THAT(refusal_of([&] { camera().choice("backend", std::nullopt, {"v4l2"}); }),
              HasSubstr("expected one of v4l2"));
}

TEST(Configuration, RefusesUnknownKeysAndSections) {
  Section camera = Configuration::parse("[camera]\nexposre_s = 1\n", "rig.toml").section("camera");
  camera.number("exposure_s", 0.001, 0, 1, "s");
  EXPECT_THAT(refusal_of([&] { camera.finish(); }), AllOf(HasSubstr("exposre_s"), HasSubstr("exposure_s")));
  EXPECT_THAT(refusal_of([] { Configuration::parse("[camra]\n", "rig.toml"); }), HasSubstr("camra"));
  EXPECT_THAT(refusal_of([] { Configuration::parse("camera = 3\n", "rig.toml"); }), HasSubstr("a section"));
  EXPECT_THAT(refusal_of([] { Configuration::parse("[bus]\nport = 80\n", "rig.toml").bus(); }), HasSubstr("1024"));
}

TEST(Configuration, RefusesNotANumberAndBrokenText) {
  EXPECT_THAT(refusal_of([] {
                Configuration::parse("[camera]\nexposure_s = nan\n", "rig.toml")
                    .section("camera")
                    .number("exposure_s", 1, 0, 1, "s");
              }),
              HasSubstr("exposure_s"));
  EXPECT_THAT(refusal_of([] { Configuration::parse("[camera]\nx = \n", "rig.toml"); }), HasSubstr("rig.toml:2:"));
  EXPECT_THAT(refusal_of([] { Configuration::load("/nowhere/rig.toml"); }), HasSubstr("/nowhere/rig.toml"));
}

}  // namespace
}  // namespace selvedge::rig
