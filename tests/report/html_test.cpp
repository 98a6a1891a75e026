#include "report/html.h"

#include <cmath>
#include <limits>
#include <regex>
#include <set>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "files/whole_file.h"
#include "report/base64.h"
#include "report/parameter_plots.h"
#include "report/plot_axis.h"
#include "report/plot_data.h"
#include "report/read_figures.h"

namespace selvedge::report {
namespace {

size_t count(const std::string& text, const std::string& part) {
  size_t found = 0;
  for (size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
  return found;
}

// Every element that is opened is closed, in order.
void expect_well_formed(const std::string& markup) {
  std::vector<std::string> open;
  const std::regex tag("<(/?)([a-zA-Z0-9]+)([^>]*?)(/?)>");
  for (std::sregex_iterator it(markup.begin(), markup.end(), tag), end; it != end; ++it) {
    const std::string name = (*it)[2];
    if (name == "meta" || name == "img" || (*it)[4] == "/") continue;
    if ((*it)[1] == "/") {
      ASSERT_FALSE(open.empty()) << name;
      EXPECT_EQ(open.back(), name);
      open.pop_back();
    } else {
      open.push_back(name);
    }
  }
  EXPECT_TRUE(open.empty());
}

TEST(PlotAxis, TicksAreRoundAndCoverTheData) {
  const PlotAxis axis({0.03, 1.87}, false);
  EXPECT_LE(axis.ticks().front(), 0.03);
  EXPECT_GE(axis.ticks().back(), 1.87);
  EXPECT_EQ(axis.label(axis.ticks()[1]), "0.5");
  EXPECT_NEAR(axis.place(axis.ticks().front()), 0, 1e-12);
  EXPECT_NEAR(axis.place(axis.ticks().back()), 1, 1e-12);
}

TEST(PlotData, ComesBackAndBringsTwoPlotsOnTheSameAxes) {
  PlotOptions options{"time, s", "error < 1 \"mm\" & more"};
  options.level = 0.2;
  options.level_name = "noise";
  options.shaded = {{1, 2}};
  options.shaded_name = "held out";
  const Series small{"fitted", {0, 1, 2}, {0.1, std::numeric_limits<double>::quiet_NaN(), 0.3}};
  const std::string svg = line_plot({small}, options);
  const auto read = read_plot(svg);
  ASSERT_TRUE(read);
  ASSERT_EQ(read->series.size(), 1u);
  EXPECT_EQ(read->series[0].x, small.x);
  EXPECT_TRUE(std::isnan(read->series[0].y[1]));
  EXPECT_EQ(line_plot(read->series, read->options), svg);
  EXPECT_FALSE(read_plot("<svg></svg>"));
  EXPECT_FALSE(read_plot("<svg><metadata>{}</metadata></svg>"));
  EXPECT_FALSE(read_plot("<svg><metadata>[1, </metadata></svg>"));
  const LinePlot large{{{"fitted", {0, 5}, {0, 40}}}, options};
  const auto [a, b] = on_same_axes(*read, large);
  for (const std::string& one : {a, b}) {
    EXPECT_NE(one.find(">40</text>"), std::string::npos) << one;
    EXPECT_NE(one.find(">5</text>"), std::string::npos) << one;
    expect_well_formed(one);
  }
}

TEST(PlotAxis, LogAxisTicksDecadesAndHidesWhatHasNoLogarithm) {
  const PlotAxis axis({1e-5, 3.0, -1, 0}, true);
  EXPECT_EQ(axis.label(axis.ticks().front()), "1e-05");
  EXPECT_NEAR(axis.place(std::sqrt(axis.ticks().front() * axis.ticks().back())), 0.5, 1e-12);
  EXPECT_TRUE(std::isnan(axis.place(0)));
  EXPECT_GE(PlotAxis({2.0, 7.0}, true).ticks().size(), 2u);
}

TEST(PlotAxis, StandsWithOneValueOrNone) {
  for (const std::vector<double>& values : {std::vector<double>{}, {0.0}, {-3.0}, {1e-12, 1e-12}, {1e9}}) {
    const PlotAxis axis(values, false);
    EXPECT_GE(axis.ticks().size(), 2u);
    EXPECT_LE(axis.ticks().size(), 12u);
    for (const double value : values) {
      EXPECT_GE(axis.place(value), 0);
      EXPECT_LE(axis.place(value), 1);
    }
  }
}

TEST(LinePlot, BreaksAtNaNAndDrawsEverySeries) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::string svg =
      line_plot({{"recorded", {0, 1, 2, 3, 4}, {1, 2, nan, 4, 5}}, {"dots <&>", {0, 1, 2}, {1, 1, 1}, true}},
                {"time, s", "error, mm"});
  expect_well_formed(svg);
  const std::smatch match = [&] {
    static std::smatch found;
    std::regex_search(svg, found, std::regex("<path d=\"(M[0-9. ]+L[^\"]*)\" fill=\"none\" stroke=\"#1f4e8c\""));
    return found;
  }();
  ASSERT_FALSE(match.empty());
  EXPECT_EQ(count(match[1], "M"), 2u);
  EXPECT_EQ(count(match[1], "L"), 2u);
  EXPECT_NE(svg.find("dots &lt;&amp;&gt;"), std::string::npos);
  EXPECT_NE(svg.find("error, mm"), std::string::npos);
  EXPECT_EQ(svg.find("nan"), std::string::npos);
}

TEST(LinePlot, StaysInsideItsFrameAndRefusesUnequalLengths) {
  PlotOptions options{"x", "y", true, true};
  const std::string svg = line_plot({{"a", {1, 10, 100, -1}, {1e-6, 1, 1e6, 1}}}, options);
  expect_well_formed(svg);
  EXPECT_EQ(svg.find("inf"), std::string::npos);
  EXPECT_THROW(line_plot({{"a", {1, 2}, {1}}}, {}), std::invalid_argument);
  EXPECT_NE(line_plot({}, {}).find("no data"), std::string::npos);
}

TEST(LinePlot, ShadesSpansAndDrawsALevelWithinItsFrame) {
  PlotOptions options{"time, s", "error, mm"};
  options.shaded = {{1.5, 9}};
  options.shaded_name = "held out";
  options.level = 0.2;
  options.level_name = "noise";
  const std::string svg = line_plot({{"a", {0, 1, 2}, {1, 2, 3}}}, options);
  expect_well_formed(svg);
  std::smatch found;
  ASSERT_TRUE(std::regex_search(svg, found, std::regex("class=\"shaded\" x=\"([0-9.]+)\"[^>]*width=\"([0-9.]+)\"")));
  EXPECT_LE(std::stod(found[1]) + std::stod(found[2]), options.width_px - 13.9);  // cut off at the frame
  EXPECT_EQ(count(svg, "class=\"level\""), 1u);
  EXPECT_NE(svg.find(">held out</text>"), std::string::npos);
  EXPECT_NE(svg.find(">noise</text>"), std::string::npos);
}

TEST(ForestPlot, EachParameterLiesBetweenItsBounds) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::string svg = forest_plot(
      {{"stretch", "N/m", 100, 10, 1000, 1, 10000, 100, true}, {"coupling", "", 0.1, nan, nan, 0, 0.2, nan, false}});
  expect_well_formed(svg);
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  std::smatch found;
  ASSERT_TRUE(std::regex_search(svg, found, std::regex("class=\"interval\" x=\"([0-9.]+)\"[^>]*width=\"([0-9.]+)\"")));
  EXPECT_NEAR(std::stod(found[1]), 305, 0.2);  // a quarter of the way from 225 to 545
  EXPECT_NEAR(std::stod(found[2]), 160, 0.2);  // and half of it wide
  EXPECT_EQ(count(svg, "class=\"interval\""), 1u);
  EXPECT_EQ(count(svg, "cx=\"385.0\""), 3u);  // both values and one start lie in the middle
}

TEST(CorrelationMap, HasAColourAndANumberInEachCell) {
  const std::string svg = correlation_map({"a", "b"}, {1, -0.8, -0.8, 1});
  expect_well_formed(svg);
  EXPECT_EQ(count(svg, ">-0.80</text>"), 2u);
  EXPECT_EQ(count(svg, "fill=\"rgb(99,147,211)\""), 2u);
  EXPECT_NE(correlation_map({"a", "b"}, {1, 0.8, 0.8, 1}).find("rgb(231,151,83)"), std::string::npos);
  EXPECT_THROW(correlation_map({"a"}, {1, 2}), std::invalid_argument);
}

TEST(BarPlot, BarsAreInProportion) {
  const std::string svg = bar_plot({"bend_friction", "draught"}, {0.8, 0.4}, "probability");
  expect_well_formed(svg);
  std::vector<double> lengths;
  const std::regex bar("width=\"([0-9.]+)\" height=\"16.0\"");
  for (std::sregex_iterator it(svg.begin(), svg.end(), bar), end; it != end; ++it)
    lengths.push_back(std::stod((*it)[1]));
  ASSERT_EQ(lengths.size(), 2u);
  EXPECT_NEAR(lengths[0] / lengths[1], 2, 0.01);
}

TEST(IntervalPlot, BarsRunFromLowToHighAndGapsStayEmpty) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::string svg =
      interval_plot({"stretch", "bend"}, {{"A", {1, 2}, {0.5, 1}, {2, 4}}, {"B", {1, nan}, {nan, nan}, {nan, nan}}},
                    {"ratio", "", true});
  expect_well_formed(svg);
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  std::vector<double> lengths;
  const std::regex bar("<line x1=\"([0-9.]+)\" y1=\"[0-9.]+\" x2=\"([0-9.]+)\" y2=\"[0-9.]+\" stroke=\"#1f4e8c\"");
  for (std::sregex_iterator it(svg.begin(), svg.end(), bar), end; it != end; ++it)
    lengths.push_back(std::stod((*it)[2]) - std::stod((*it)[1]));
  ASSERT_EQ(lengths.size(), 2u);
  EXPECT_GT(lengths[0], 50);
  EXPECT_NEAR(lengths[0] / lengths[1], 1, 0.01);  // a factor of four both, on the axis of logarithms
  EXPECT_THROW(interval_plot({"a"}, {{"A", {1, 2}, {1, 2}, {1, 2}}}, {}), std::invalid_argument);
}

TEST(Base64, ReadsBackAnyBytesAndNothingElse) {
  for (const std::string& bytes : {std::string(), std::string("a"), std::string("\0\xff\x80", 3), std::string("four")})
    EXPECT_EQ(from_base64(base64(bytes)), bytes);
  for (const char* text : {"YWI", "YW*=", "=YWI", "Y==="}) EXPECT_FALSE(from_base64(text)) << text;
}

TEST(ReadFigures, GivesBackWhatAReportShows) {
  HtmlReport report("figures");
  const std::string plot = bar_plot({"a"}, {1}, "x");
  report.svg(plot, "bars <1> & \"2\"");
  report.picture_row({"one", "two"}, {"first", "second"});
  report.picture("three", "alone");
  report.paragraph("no <figure>");
  const std::filesystem::path path = std::filesystem::path(testing::TempDir()) / "selvedge_figures_test.html";
  report.write(path);
  const auto rows = read_figures(files::read_whole(path));
  std::filesystem::remove(path);
  ASSERT_EQ(rows.size(), 3u);
  ASSERT_EQ(rows[0].size(), 1u);
  EXPECT_TRUE(rows[0][0].is_svg);
  EXPECT_EQ(rows[0][0].bytes.substr(rows[0][0].bytes.find("</title>") + 8) + "\n", plot.substr(plot.find('>') + 1));
  EXPECT_EQ(rows[0][0].caption, "bars <1> & \"2\"");
  ASSERT_EQ(rows[1].size(), 2u);
  EXPECT_EQ(rows[1][1].bytes, "two");
  EXPECT_EQ(rows[2][0].caption, "alone");
  EXPECT_TRUE(read_figures("<figure><svg>").size() <= 1);  // cut off
  EXPECT_EQ(read_figures("<figure><svg></svg><figcaption>x</figcaption></figure>").at(0).at(0).caption, "x");
}

TEST(HtmlReport, StandsAloneAndEscapes) {
  HtmlReport report("Fit of <silk> & co");
  report.heading("Parameters");
  report.paragraph("a < b");
  report.table({"name", "value"}, {{"stretch", "110 N/m"}, {"\"x\"", "-1"}});
  report.svg(bar_plot({"a"}, {1}, "x"), "bars");
  report.picture_row({std::string("\x89PNG\0\1", 6), "ab", "a"}, {"one", "two", "three"});
  const std::filesystem::path path = std::filesystem::path(testing::TempDir()) / "selvedge_report_test.html";
  report.write(path);
  const std::string html = files::read_whole(path);
  std::filesystem::remove(path);
  expect_well_formed(html.substr(html.find('\n') + 1));
  EXPECT_NE(html.find("<title>Fit of &lt;silk&gt; &amp; co</title>"), std::string::npos);
  EXPECT_NE(html.find("base64,iVBORwAB\""), std::string::npos);
  EXPECT_NE(html.find("base64,YWI=\""), std::string::npos);
  EXPECT_NE(html.find("base64,YQ==\""), std::string::npos);
  EXPECT_EQ(html.find("http://", html.find("<body>")), html.find("http://www.w3.org/2000/svg"));
  // For the keyboard, a phone and a reader who does not see it.
  for (const char* part :
       {"<html lang=\"en\">", "name=\"viewport\"", "<a class=\"skip\" href=\"#main\">", "<main id=\"main\"",
        "prefers-color-scheme: dark", "<div class=\"scroll\" role=\"region\" tabindex=\"0\" aria-label=\"Table 1: name",
        "role=\"img\" aria-label=\"bars\"", "<title>bars</title>", "alt=\"two\"", "<th scope=\"col\">value</th>"})
    EXPECT_NE(html.find(part), std::string::npos) << part;
  EXPECT_EQ(html.find("<nav"), std::string::npos);  // of one heading no list
  EXPECT_THROW(report.picture_row({"a"}, {}), std::invalid_argument);
  EXPECT_THROW(report.svg_row({"a"}, {}), std::invalid_argument);
}

TEST(HtmlReport, ListsItsHeadingsAndLeadsToEach) {
  HtmlReport report("x");
  for (const char* heading : {"Where", "What is <left>", "Where"}) report.heading(heading);
  const std::filesystem::path path = std::filesystem::path(testing::TempDir()) / "selvedge_contents_test.html";
  report.input("abc123");
  report.write(path);
  const std::string html = files::read_whole(path);
  std::filesystem::remove(path);
  const std::regex link("<a href=\"#([^\"]+)\">");
  std::set<std::string> ids;
  for (std::sregex_iterator it(html.begin(), html.end(), link), end; it != end; ++it) ids.insert((*it)[1]);
  ASSERT_EQ(ids.size(), 3u);
  for (const std::string& id : ids) EXPECT_EQ(count(html, "id=\"" + id + "\""), 1u) << id;
  EXPECT_NE(html.find("; input abc123</footer>"), std::string::npos);
}

TEST(HtmlReport, BeginsWithItsVerdictAndEndsWithWhoMadeIt) {
  Verdict verdict;
  verdict.sentence = "the fit predicts 2 < 3 mm";
  verdict.lower(Trust::none, "the recording is doubted");
  verdict.lower(Trust::limited, "a parameter is at its bound");
  EXPECT_EQ(verdict.trust, Trust::none);
  EXPECT_EQ(to_lines(verdict),
            "not to be believed: the fit predicts 2 < 3 mm\n  because the recording is doubted\n"
            "  because a parameter is at its bound\n");
  EXPECT_EQ(to_lines(verdict, true).find("\x1b[31mnot to be believed\x1b[0m: the fit"), 0u);
  const std::optional<Verdict> read = read_verdict(to_json(verdict));
  ASSERT_TRUE(read);
  EXPECT_EQ(to_lines(*read), to_lines(verdict));
  EXPECT_FALSE(read_verdict({{"trust", "somewhat"}, {"sentence", "x"}}));
  EXPECT_FALSE(read_verdict(nullptr));
  HtmlReport html("A & B");
  html.verdict(verdict);
  const std::filesystem::path file = std::filesystem::temp_directory_path() / "selvedge-verdict.html";
  set_command("./selvedge fit <x>");
  html.write(file);
  set_command("");
  const std::string page = files::read_whole(file);
  std::filesystem::remove(file);
  expect_well_formed(page.substr(page.find("<html")));
  EXPECT_NE(
      page.find("<div class=\"verdict none\"><strong>Not to be believed</strong>the fit predicts 2 &lt; 3 mm<ul>"),
      std::string::npos);
  EXPECT_NE(page.find(" UTC, by ./selvedge fit &lt;x&gt;</footer>"), std::string::npos);
}

}  // namespace
}  // namespace selvedge::report
