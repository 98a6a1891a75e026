// A session's verdict: the least of its parts, each with its reason.
#include "station/session_verdict.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "files/whole_file.h"
#include "station/session_report.h"

namespace selvedge::station {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using report::Trust;

json verdict(const char* trust, const json& because = json::array()) {
  return {{"trust", trust}, {"sentence", "x"}, {"because", because}};
}

json good_session() {
  const json fabric = {{"trials", {{"waving-1", {{"state", "done"}}}}},
                       {"fit", {{"verdict", verdict("to be believed")}}},
                       {"diagnosis", {{"verdict", verdict("to be believed")}}}};
  return {{"steps",
           {{"calibrate", {{"state", "done"}, {"result", {{"verdict", "good"}}}}}, {"linen/fit", {{"state", "done"}}}}},
          {"fabrics", {{"linen", fabric}, {"knit", fabric}}}};
}

void expect_lowered(const json& session, Trust trust, const std::string& why) {
  const report::Verdict found = verdict_of_session(session);
  EXPECT_EQ(found.trust, trust) << why;
  ASSERT_EQ(found.because.size(), 1u) << report::to_lines(found);
  EXPECT_NE(found.because[0].find(why), std::string::npos) << found.because[0];
}

TEST(SessionVerdict, IsFullWhereEverythingIs) {
  const report::Verdict found = verdict_of_session(good_session());
  EXPECT_EQ(found.trust, Trust::full) << report::to_lines(found);
  EXPECT_EQ(found.sentence,
            "of 2 fabrics 2 recorded in full; 2 fitted, 2 of them to be believed; 2 diagnosed, 2 of them to be "
            "believed");
}

TEST(SessionVerdict, IsTheLeastOfItsParts) {
  json session = good_session();
  session["fabrics"]["knit"]["fit"]["verdict"] = verdict("not to be believed", {"a rigid plate comes as near"});
  expect_lowered(session, Trust::none, "the fit of knit is not to be believed: a rigid plate comes as near");
  EXPECT_NE(verdict_of_session(session).sentence.find("2 fitted, 1 of them"), std::string::npos);
  session = good_session();
  session["fabrics"]["linen"]["diagnosis"]["verdict"] = verdict("to be taken with care", {"likely by 60 % only"});
  expect_lowered(session, Trust::limited, "the diagnosis of linen is to be taken with care: likely by 60 % only");
}

TEST(SessionVerdict, NamesTheFaultsOfTheRig) {
  json session = good_session();
  session["steps"]["calibrate"]["result"]["verdict"] = "doubtful";
  expect_lowered(session, Trust::limited, "calibration (calibrate) is doubtful");
  session = good_session();
  session["steps"]["knit/record/waving-2"] = {{"state", "skipped"}, {"why", "the camera moved"}};
  expect_lowered(session, Trust::limited, "knit/record/waving-2 was given up: the camera moved");
  session = good_session();
  session["fabrics"]["knit"]["trials"]["waving-2"] = {{"state", "not begun"}};
  expect_lowered(session, Trust::limited, "1 of 2 trials of knit were not recorded");
}

TEST(SessionVerdict, IsTheFirstThingThatPageFileAndTerminalSay) {
  const fs::path folder = fs::temp_directory_path() / fmt::format("selvedge-session-verdict-{}", ::getpid());
  fs::remove_all(folder);
  SessionFile file;
  file.path = "evening.toml";
  {
    Journal journal(folder, "");
    journal.begun("calibrate");
    journal.skipped("calibrate", "no grid was seen");
  }
  const json written = write_session_report(file, folder);
  EXPECT_EQ(files::read_json(folder / "session.json"), written);
  EXPECT_EQ(written["verdict"]["trust"], "to be taken with care");
  EXPECT_EQ(session_text(written).find("to be taken with care: of 0 fabrics"), 0u) << session_text(written);
  const std::string html = files::read_whole(folder / "report.html");
  const size_t begin = html.find("<div class=\"verdict limited\">");
  EXPECT_NE(html.find("calibrate was given up: no grid was seen", begin), std::string::npos);
  EXPECT_LT(begin, html.find("<table>"));
  fs::remove_all(folder);
}

}  // namespace
}  // namespace selvedge::station
