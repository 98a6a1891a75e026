// The console's server: who is let in, what is read, and that a page that goes away stops the arm.
#include "console/server.h"

#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

#include <fmt/format.h>

#include "console/gate.h"
#include "tests/console/console_server.h"

namespace selvedge::console {
namespace {

TEST_F(ConsoleServer, ShowsThePageAndTheRun) {
  EXPECT_EQ(client_->Get("/")->body, fmt::format("the page, its stop at {}", server_->stop_port()));
  EXPECT_EQ(client_->Get("/app.js")->body, "script");
  EXPECT_EQ(client_->Get("/run/report.html")->body, "a report");
  const json trials = json::parse(client_->Get("/api/trials")->body);
  ASSERT_EQ(trials.size(), 1u);
  EXPECT_EQ(trials[0]["path"], "knit/still");
  EXPECT_EQ(trials[0]["state"], "cut");
  EXPECT_EQ(get("/api/trial?path=nothing"), 404);
}

TEST_F(ConsoleServer, TellsWhatASecondSessionMadeOfADiagnosis) {
  for (const char* name : {"diagnosis", "confirmation"}) fs::create_directories(folder_ / "run" / "knit" / name);
  files::write_json(folder_ / "run/knit/diagnosis/diagnosis.json", {{"format", "diagnosis/1"}, {"cause", "draught"}});
  json run = json::parse(client_->Get("/api/session")->body);
  ASSERT_EQ(run["diagnoses"].size(), 1u);
  EXPECT_EQ(run["diagnoses"][0]["cause"], "draught");
  EXPECT_FALSE(run["diagnoses"][0].contains("confirmation"));
  files::write_json(folder_ / "run/knit/confirmation/confirmation.json", {{"verdict", {{"sentence", "It holds."}}}});
  run = json::parse(client_->Get("/api/session")->body);
  EXPECT_EQ(run["diagnoses"][0]["confirmation"], "It holds.");
}

TEST_F(ConsoleServer, ChangesNothingWithoutItsToken) {
  for (const char* path :
       {"/api/arm", "/api/reset", "/api/disarm", "/api/record", "/api/record/stop", "/api/answer", "/api/heartbeat"}) {
    EXPECT_EQ(post(path, {}), 403) << path;
    EXPECT_EQ(post(path, with("wrong")), 403) << path;
  }
  EXPECT_FALSE(rig_.armed);
  EXPECT_EQ(rig_.stops, 0);
  EXPECT_EQ(post("/api/arm", with("right")), 200);
  EXPECT_TRUE(rig_.armed);
  EXPECT_TRUE(logged("403 POST /api/arm no token")) << log();
  EXPECT_TRUE(logged("200 /api/arm")) << log();
}

TEST_F(ConsoleServer, RefusesOtherOriginsAndOtherHosts) {
  const std::string own = fmt::format("http://127.0.0.1:{}", server_->port());
  EXPECT_EQ(post("/api/arm", with("right", "one", "http://elsewhere.example")), 403);
  EXPECT_EQ(post("/api/arm", with("right", "one", "null")), 403);
  EXPECT_FALSE(rig_.armed);
  EXPECT_EQ(post("/api/arm", with("right", "one", own)), 200);
  // Under another name that points here: a page of that name could read.
  EXPECT_EQ(get("/api/trials", {{"Host", "rebound.example"}}), 403);
  EXPECT_EQ(get("/api/trials", {{"Origin", "http://elsewhere.example"}}), 403);
}

TEST_F(ConsoleServer, RefusesPathsThatClimbOut) {
  for (const char* path :
       {"/run/../secret.json", "/run/%2e%2e/secret.json", "/run/..%2fsecret.json", "/run//etc/passwd", "/run/link.json",
        "/run/key.pem", "/../secret.json", "/%2e%2e/secret.json", "/api/trial?path=..", "/api/trial?path=%2e%2e%2f",
        "/api/frame?path=../run/knit/still&index=0", "/api/frame?path=knit/still&index=-1", "/api/motion?path=/etc"}) {
    const int status = get(path);
    EXPECT_TRUE(status == 404 || status == 403 || status == 400) << path << " " << status;
  }
}

TEST_F(ConsoleServer, ALostPageStopsTheArm) {
  ASSERT_EQ(post("/api/arm", with("right", "one")), 200);
  for (int i = 0; i < 8; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(150));
    ASSERT_EQ(post("/api/heartbeat", with("right", "one")), 200);
  }
  EXPECT_TRUE(rig_.armed);
  EXPECT_EQ(rig_.stops, 0);
  // Another page that lives on does not count.
  const auto begin = std::chrono::steady_clock::now();
  while (rig_.stops == 0 && std::chrono::steady_clock::now() - begin < std::chrono::seconds(20)) {
    post("/api/heartbeat", with("right", "another"));
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  EXPECT_EQ(rig_.stops, 1);
  EXPECT_FALSE(rig_.armed);
  EXPECT_NE(rig_.stopped_because.find("has not been heard"), std::string::npos);
  EXPECT_TRUE(logged("has not been heard")) << log();
}

TEST_F(ConsoleServer, APageThatGoesWhileTheArmIsArmedStopsIt) {
  rig_.arming_s = 1.5;
  EXPECT_EQ(post("/api/arm", with("right", "one")), 409);
  EXPECT_FALSE(rig_.armed);
}

TEST_F(ConsoleServer, SaysWhyAndRefusesWhatItCannotRead) {
  rig_.refuses = true;
  const auto result = client_->Post("/api/arm", with("right"), "{}", "application/json");
  EXPECT_EQ(result->status, 409);
  EXPECT_EQ(json::parse(result->body)["error"], "the arm is off");
  EXPECT_EQ(post("/api/record", with("right"), "{not json"), 400);
  EXPECT_EQ(post("/api/answer", with("right"), "{\"answer\": \"perhaps\"}"), 400);
  EXPECT_EQ(post("/api/answer", with("right"), "{\"answer\": \"repeat\"}"), 200);
  EXPECT_EQ(post("/api/record", with("right"), std::string(1 << 20, 'x')), 413);
}

TEST_F(ConsoleServer, SendsEventsToSeveralPages) {
  std::vector<std::thread> pages;
  std::atomic<int> states{0}, previews{0};
  for (int i = 0; i < 4; ++i)
    pages.emplace_back([&] {
      httplib::Client page("127.0.0.1", server_->port());
      std::string text;
      page.Get("/api/events", [&](const char* data, size_t size) {
        text.append(data, size);
        return text.size() < 600;
      });
      states += text.find("event: state") != std::string::npos;
      previews += text.find("\"number\":7") != std::string::npos;
    });
  for (std::thread& page : pages) page.join();
  EXPECT_EQ(states, 4);
  EXPECT_EQ(previews, 4);
  EXPECT_GT(rig_.looks, 4);
}

TEST_F(ConsoleServer, ResetsAStopOnAPersonsWord) {
  rig_.latched = true;
  EXPECT_EQ(post("/api/reset", with("wrong")), 403);
  EXPECT_TRUE(rig_.latched);
  EXPECT_EQ(post("/api/reset", with("right")), 200);
  EXPECT_FALSE(rig_.latched);
  EXPECT_TRUE(logged("200 /api/reset")) << log();
}

TEST_F(ConsoleServer, RefusesTheSeventeenthStreamAndTakesItWhenAnotherEnds) {
  std::atomic<bool> ending{false};
  std::vector<std::thread> pages;
  for (int i = 0; i < 16; ++i)
    pages.emplace_back([&] {
      httplib::Client page("127.0.0.1", server_->port());
      page.Get("/api/events", [&](const char*, size_t) { return !ending; });
    });
  EXPECT_TRUE(comes_true([&] { return server_->listeners() == 16; }));
  EXPECT_EQ(get("/api/events"), 503);
  EXPECT_EQ(get("/"), 200) << "streams leave threads for requests";
  ending = true;
  for (std::thread& page : pages) page.join();
  EXPECT_TRUE(comes_true([&] { return server_->listeners() == 0; }));
  std::string text;
  client_->Get("/api/events", [&](const char* data, size_t size) {
    text.append(data, size);
    return false;
  });
  EXPECT_NE(text.find("event: state"), std::string::npos);
}

TEST(Gate, TokensDiffer) {
  EXPECT_EQ(random_token().size(), 64u);
  EXPECT_NE(random_token(), random_token());
}

}  // namespace
}  // namespace selvedge::console
