// Two small results made by hand, side by side: what the numbers say, what is refused, what the page shows.
#include "station/comparison.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "files/bad_input.h"
#include "files/whole_file.h"
#include "report/base64.h"
#include "report/html.h"
#include "report/plot_data.h"
#include "report/read_figures.h"
#include "tests/keep_page.h"

namespace selvedge::station {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

class ComparisonTest : public testing::Test {
 protected:
  void SetUp() override {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  json parameter(double value, double low, double high, const char* unit) {
    return {{"value", value}, {"interval", {low, high}}, {"unit", unit}, {"determined", true}, {"at_bound", false}};
  }

  // bend: in N·m, ten per cent to each side.
  void write_fit(const fs::path& folder, double bend, double held_out) {
    fs::create_directories(folder);
    const json fit = {
        {"format", "fit/1"},
        {"campaign", "denim"},
        {"model", "Baraff-Witkin"},
        {"parameters",
         {{"bend", parameter(bend, 0.9 * bend, 1.1 * bend, "N·m")}, {"stretch", parameter(100, 60, 160, "N/m")}}},
        {"trials",
         {{"waving-1",
           {{"error_start", 3},
            {"error_end", 0.5},
            {"frames", 30},
            {"error_held_out", held_out},
            {"error_held_out_interval", {0.9 * held_out, 1.1 * held_out}}}}}},
        {"held_out", {{"by", "frames"}, {"error", held_out}}}};
    files::write_json(folder / "fit.json", fit);
    report::HtmlReport html("Fit");
    html.svg(report::line_plot({{"fitted", {0, 1}, {0.5, held_out}}}, {"s", "mm"}),
             fmt::format("waving-1: root mean square error over time; held out after {:.2f} s", held_out));
    html.picture_row(
        {"recorded", "simulated", "angles", "angles", "difference of " + folder.filename().string()},
        {"waving-1, frame 3: recorded", "simulated", "angle map, recorded", "angle map, simulated", "difference"});
    html.write(folder / "report.html");
  }

  void write_diagnosis(const fs::path& folder, double gap, const char* cause) {
    fs::create_directories(folder);
    const json d = {
        {"format", "diagnosis/1"},
        {"campaign", "denim"},
        {"gap",
         {{"value_mm", gap},
          {"noise_floor_mm", 0.2},
          {"interval_mm", {gap - 0.1, gap + 0.1}},
          {"p_value", 0.01},
          {"held_out_mm", gap + 0.4}}},
        {"cause", cause},
        {"side", "dissipative"},
        {"probabilities", {{"none", 0.1}, {"bend_friction", 0.9}}},
        {"shrink", {{"bend_friction", {{"fraction", 0.8}, {"interval", {0.6, 1.0}}}}}},
        {"where", {{{"axis", "region"}, {"cell", "lower hem"}, {"share", 0.7}, {"mm", gap}}}},
        {"map",
         {{"size_m", {0.3, 0.4}}, {"held", {"corners"}}, {"uv_m", {{0.1, 0.1}, {0.2, 0.3}}}, {"mm", {gap, gap / 2}}}}};
    files::write_json(folder / "diagnosis.json", d);
  }

  const fs::path folder_ = fs::temp_directory_path() / fmt::format("selvedge-comparison-{}", ::getpid());
};

TEST_F(ComparisonTest, SaysWhichParametersDifferAndHowFarEachPredicts) {
  write_fit(folder_ / "a", 4e-5, 0.8);
  write_fit(folder_ / "b", 6e-5, 0.5);
  write_diagnosis(folder_ / "a", 1.5, "bend_friction");
  write_diagnosis(folder_ / "b" / "diagnosis", 0.5, "none");  // as a session leaves it
  write_diagnosis(folder_ / "b" / "diagnosis-2", 0.3, "none");
  const json written = write_comparison(read_comparison(folder_ / "a", folder_ / "b"), folder_ / "out");
  ASSERT_EQ(files::read_json(folder_ / "out" / "compare.json"), written);
  const json& pair = written["pairs"][0];
  EXPECT_EQ(pair["name"], "denim");
  EXPECT_NEAR(pair["parameters"]["bend"]["ratio"].get<double>(), 1.5, 1e-12);
  EXPECT_NEAR(pair["parameters"]["bend"]["difference"].get<double>(), 2e-5, 1e-18);
  EXPECT_EQ(pair["parameters"]["bend"]["apart"], true);
  EXPECT_EQ(pair["parameters"]["stretch"]["apart"], false);
  EXPECT_NEAR(pair["held_out_mm"]["difference"].get<double>(), -0.3, 1e-12);
  EXPECT_NEAR(pair["trials"]["waving-1"]["held_out_mm"]["b"].get<double>(), 0.5, 1e-12);
  EXPECT_NEAR(pair["gap"]["value_mm"]["b"].get<double>(), 0.3, 1e-12);  // the newest diagnosis
  EXPECT_EQ(pair["gap"]["cause"]["a"], "bend_friction");
  EXPECT_EQ(pair["where"][0]["cell"], "lower hem");
  EXPECT_NE(comparison_text(written).find("better by 0.3 mm than A"), std::string::npos) << comparison_text(written);
  EXPECT_NE(comparison_text(written).find("differ: bend."), std::string::npos) << comparison_text(written);
}

TEST_F(ComparisonTest, BeginsWithWhoPredictsBetterAndByHowMuch) {
  write_fit(folder_ / "a", 4e-5, 0.8);
  write_fit(folder_ / "b", 6e-5, 0.5);
  write_fit(folder_ / "near_b", 6e-5, 0.52);
  json written = write_comparison(read_comparison(folder_ / "a", folder_ / "b"), folder_ / "out");
  EXPECT_EQ(written["verdict"]["trust"], "to be believed");
  EXPECT_EQ(written["verdict"]["sentence"],
            "B predicts what it was not fitted to better by 0.3 mm than A (0.5 and 0.8 mm)");
  EXPECT_EQ(written["pairs"][0]["better"], "b");
  EXPECT_EQ(comparison_text(written).find("to be believed: B predicts"), 0u) << comparison_text(written);
  const std::string html = files::read_whole(folder_ / "out" / "report.html");
  EXPECT_LT(html.find("<div class=\"verdict full\">"), html.find("<table>"));
  written = to_json(read_comparison(folder_ / "b", folder_ / "a"));
  EXPECT_EQ(written["pairs"][0]["better"], "a");
  written = to_json(read_comparison(folder_ / "b", folder_ / "near_b"));
  EXPECT_EQ(written["pairs"][0]["better"], "neither");
  EXPECT_EQ(written["verdict"]["sentence"].get<std::string>().find("no difference that the data can show"), 0u);
}

TEST_F(ComparisonTest, IsTrustedNoFurtherThanWhatItCompares) {
  write_fit(folder_ / "a", 4e-5, 0.8);
  write_fit(folder_ / "b", 6e-5, 0.5);
  const json as_written = files::read_json(folder_ / "b" / "fit.json");
  const auto trust_with = [&](auto change) {
    json fit = as_written;
    change(fit);
    files::write_json(folder_ / "b" / "fit.json", fit);
    return to_json(read_comparison(folder_ / "a", folder_ / "b"))["verdict"];
  };
  const json doubted = trust_with([](json& fit) {
    fit["verdict"] = {{"trust", "not to be believed"}, {"sentence", "x"}, {"because", {"gravity points up"}}};
  });
  EXPECT_EQ(doubted["trust"], "not to be believed");
  EXPECT_NE(doubted["because"][0].get<std::string>().find("gravity points up"), std::string::npos);
  const json plate = trust_with([](json& fit) { fit["held_out"]["rigid_plate_error"] = 0.4; });
  EXPECT_EQ(plate["trust"], "not to be believed");
  EXPECT_NE(plate["because"][0].get<std::string>().find("rigid plate"), std::string::npos);
  EXPECT_EQ(trust_with([](json& fit) { fit["held_out"]["rigid_plate_error"] = 0.6; })["trust"], "to be believed");
  EXPECT_EQ(trust_with([](json& fit) { fit["held_out"]["by"] = "trials"; })["trust"], "to be taken with care");
  EXPECT_EQ(trust_with([](json& fit) { fit["trials"]["waving-1"].erase("error_held_out_interval"); })["trust"],
            "to be taken with care");
  EXPECT_EQ(trust_with([](json& fit) { fit["held_out"]["error"] = nullptr; })["because"][0], "B held nothing out");
}

TEST_F(ComparisonTest, ThePageStandsAloneWithTheFiguresOfBoth) {
  write_fit(folder_ / "a", 4e-5, 0.8);
  write_fit(folder_ / "b", 6e-5, 0.5);
  write_comparison(read_comparison(folder_ / "a", folder_ / "b"), folder_ / "out");
  const std::string html = files::read_whole(folder_ / "out" / "report.html");
  for (const char* part : {"<td>apart</td>", "4e-05 (3.6e-05 … 4.4e-05)",
                           "B: waving-1: root mean square error over time; held out after 0.50 s"})
    EXPECT_NE(html.find(part), std::string::npos) << part;
  std::string pictures;
  for (const auto& row : report::read_figures(html))
    for (const report::ReadFigure& figure : row)
      if (!figure.is_svg) pictures += figure.caption + "=" + figure.bytes + ";";
  EXPECT_EQ(pictures,
            "A: waving-1, frame 3: recorded=recorded;A: simulated=simulated;A: difference=difference of a;"
            "B: waving-1, frame 3: recorded=recorded;B: simulated=simulated;B: difference=difference of b;");
}

TEST_F(ComparisonTest, DrawsBothMapsOfTheFabricOnOneScale) {
  write_fit(folder_ / "a", 4e-5, 0.8);
  write_fit(folder_ / "b", 6e-5, 0.5);
  write_diagnosis(folder_ / "a", 61, "draught");
  write_diagnosis(folder_ / "b", 2.5, "none");
  write_comparison(read_comparison(folder_ / "a", folder_ / "b"), folder_ / "out");
  keep_page(folder_ / "out" / "report.html", "comparison");
  const std::string html = files::read_whole(folder_ / "out" / "report.html");
  std::vector<std::string> maps;
  const std::string mark = "data:image/svg+xml;base64,";
  for (size_t at = html.find(mark); at != std::string::npos; at = html.find(mark, at + 1))
    maps.push_back(report::from_base64(html.substr(at + mark.size(), html.find('"', at) - at - mark.size())).value());
  std::erase_if(maps, [](const std::string& svg) { return svg.find("held-corner") == std::string::npos; });
  ASSERT_EQ(maps.size(), 2u);
  const auto first_circle = [](const std::string& svg) {
    const size_t at = svg.find("<circle");
    return svg.substr(at, svg.find("/>", at) - at);
  };
  for (const std::string& map : maps) EXPECT_NE(map.find(">100 mm</text>"), std::string::npos) << map;
  EXPECT_NE(first_circle(maps[0]), first_circle(maps[1]));
  EXPECT_NE(html.find("one colour scale, 0 to 100 mm"), std::string::npos);
  EXPECT_NE(html.find("B: error of the base model on the flat fabric, mm (the two upper corners are held)"),
            std::string::npos);
  json old = files::read_json(folder_ / "b" / "diagnosis.json");
  old.erase("map");
  files::write_json(folder_ / "b" / "diagnosis.json", old);
  write_comparison(read_comparison(folder_ / "a", folder_ / "b"), folder_ / "out");
  EXPECT_NE(files::read_whole(folder_ / "out" / "report.html").find("the diagnosis of B was written before"),
            std::string::npos);
}

TEST_F(ComparisonTest, DrawsPlotsOfBothOnTheSameAxes) {
  write_fit(folder_ / "a", 4e-5, 61);
  write_fit(folder_ / "b", 6e-5, 2.5);
  write_comparison(read_comparison(folder_ / "a", folder_ / "b"), folder_ / "out");
  const std::string html = files::read_whole(folder_ / "out" / "report.html");
  const std::string mark = "data:image/svg+xml;base64,";
  int plots = 0;
  for (size_t at = html.find(mark); at != std::string::npos; at = html.find(mark, at + 1)) {
    const std::string svg =
        report::from_base64(html.substr(at + mark.size(), html.find('"', at) - at - mark.size())).value();
    EXPECT_NE(svg.find(">60</text>"), std::string::npos) << svg;
    EXPECT_TRUE(report::read_plot(svg).has_value());
    ++plots;
  }
  EXPECT_EQ(plots, 2);
}

TEST_F(ComparisonTest, AForeignReportRunsNothingHere) {
  write_fit(folder_ / "a", 4e-5, 0.8);
  write_fit(folder_ / "b", 6e-5, 0.5);
  files::write_whole(
      folder_ / "b" / "report.html",
      "<figure><svg onload=\"alert(1)\"><script>alert(2)</script></svg><figcaption>waving-1: root mean square error "
      "over time</figcaption></figure>"
      "<figure><img src=\"http://elsewhere/x.png\" onerror=\"alert(3)\"><figcaption>waving-1, x</figcaption></figure>");
  write_comparison(read_comparison(folder_ / "a", folder_ / "b"), folder_ / "out");
  const std::string html = files::read_whole(folder_ / "out" / "report.html");
  EXPECT_NE(html.find("B: waving-1: root mean square"), std::string::npos);  // it is shown, as a picture
  for (const char* part : {"alert", "<script", "elsewhere"}) EXPECT_EQ(html.find(part), std::string::npos) << part;
}

TEST_F(ComparisonTest, SessionsArePairedByFabric) {
  for (const char* side : {"a", "b"}) {
    write_fit(folder_ / side / "linen", 4e-5, 0.8);
    write_fit(folder_ / side / (std::string(side) + "-silk"), 4e-5, 0.8);
    const json trials = {{"waving-1",
                          {{"state", "done"},
                           {"frames", 95},
                           {"frames_lost", side[0] == 'a' ? 0 : 2},
                           {"kept_aside", {"waving-1-spoiled-1"}}}}};
    files::write_json(folder_ / side / "session.json", {{"format", "session/1"},
                                                        {"fabrics",
                                                         {{"linen", {{"trials", trials}}},
                                                          {std::string(side) + "-silk", {{"trials", trials}}},
                                                          {"not-begun", {{"trials", json::object()}}}}}});
  }
  const json written = write_comparison(read_comparison(folder_ / "a", folder_ / "b"), folder_ / "out");
  ASSERT_EQ(written["pairs"].size(), 1u);
  EXPECT_EQ(written["pairs"][0]["name"], "linen");
  EXPECT_EQ(written["pairs"][0]["session"]["b"]["frames_lost"], 2);
  EXPECT_EQ(written["pairs"][0]["session"]["a"]["kept_aside"], 1);
  EXPECT_EQ(written["verdict"]["sentence"].get<std::string>().find("no difference"), 0u) << written["verdict"];
  EXPECT_EQ(written["only_a"][0], "a-silk");
  EXPECT_EQ(written["only_b"][0], "b-silk");
  write_fit(folder_ / "single", 1e-5, 1);
  EXPECT_THROW(read_comparison(folder_ / "a", folder_ / "single"), BadInput);
}

TEST_F(ComparisonTest, RefusesWhatHoldsNoResult) {
  write_fit(folder_ / "a", 4e-5, 0.8);
  fs::create_directories(folder_ / "empty");
  for (const fs::path& bad : {folder_ / "empty", folder_ / "nowhere"}) {
    EXPECT_THROW(read_comparison(folder_ / "a", bad), BadInput);
    EXPECT_THROW(read_comparison(bad, folder_ / "a"), BadInput);
  }
  files::write_whole(folder_ / "empty" / "fit.json", "{\"format\": \"fit/2\"}");
  EXPECT_THROW(read_comparison(folder_ / "a", folder_ / "empty"), BadInput);
  files::write_whole(folder_ / "empty" / "fit.json",
                     "{\"format\": \"fit/1\", \"parameters\": 3, \"trials\": [1], \"held_out\": null}");
  EXPECT_NO_THROW(to_json(read_comparison(folder_ / "a", folder_ / "empty")));  // gaps are gaps
}

}  // namespace
}  // namespace selvedge::station
