// The console's server: who is let in, what is read, and that a page that goes away stops the arm.
#include "console/server.h"

#include <atomic>
#include <chrono>
#include <fstream>
#include <thread>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <httplib.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "console/gate.h"
#include "console/page_watch.h"
#include "files/bad_input.h"
#include "files/whole_file.h"

namespace selvedge::console {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

class FakeRig : public RigLink {
 public:
  json state() override { return {{"devices", json::array()}, {"armed_here", armed.load()}}; }
  std::optional<Preview> preview(int64_t newer_than) override { return newer_than < 7 ? std::optional<Preview>({1, 7, "png", "{\"tiles\":[]}"}) : std::nullopt; }
  void watched() override { ++looks; }
  void arm(const std::string&) override {
    if (refuses) throw std::runtime_error("the arm is off");
    std::this_thread::sleep_for(std::chrono::duration<double>(arming_s.load()));
    armed = true;
  }
  void disarm() override { armed = false; }
  void stop(const std::string& why) override {
    armed = false;
    ++stops;
    const std::lock_guard lock(mutex);
    stopped_because = why;
  }
  void record(const json& trial) override {
    const std::lock_guard lock(mutex);
    recorded = trial;
  }
  void stop_recording() override {}
  void answer(int64_t, const std::string& text) override {
    if (text != "repeat") refuse("answer", "found {}", text);
  }
  bool armed_here() const override { return armed; }

  std::atomic<bool> armed{false}, refuses{false};
  std::atomic<double> arming_s{0};
  std::atomic<int> stops{0}, looks{0};
  std::mutex mutex;
  std::string stopped_because;
  json recorded;
};

class ConsoleServer : public testing::Test {
 protected:
  void SetUp() override {
    fs::remove_all(folder_);
    fs::create_directories(folder_ / "web");
    fs::create_directories(folder_ / "run" / "knit" / "still");
    files::write_whole(folder_ / "web" / "index.html", "the page");
    files::write_whole(folder_ / "web" / "app.js", "script");
    files::write_whole(folder_ / "secret.json", "{\"secret\": 1}");
    files::write_whole(folder_ / "run" / "report.html", "a report");
    files::write_whole(folder_ / "run" / "key.pem", "private");
    files::write_whole(folder_ / "run" / "knit" / "still" / "trial.json", "{\"experiment\": \"static\", \"state\": \"cut\"}");
    fs::create_symlink(folder_ / "secret.json", folder_ / "run" / "link.json");
    options_.token = "right";
    options_.web = folder_ / "web";
    options_.log = folder_ / "console.log";
    options_.page_bound_s = 0.5;
    run_ = std::make_unique<RunFolder>(folder_ / "run");
    server_ = std::make_unique<Server>(options_, rig_, *run_);
    client_ = std::make_unique<httplib::Client>("127.0.0.1", server_->port());
  }
  void TearDown() override {
    client_.reset();
    server_.reset();
    fs::remove_all(folder_);
  }

  httplib::Headers with(const std::string& token, const std::string& page = "one", const std::string& origin = "") const {
    httplib::Headers headers = {{"X-Selvedge-Token", token}, {"X-Selvedge-Page", page}};
    if (!origin.empty()) headers.emplace("Origin", origin);
    return headers;
  }
  int post(const std::string& path, const httplib::Headers& headers, const std::string& body = "{}") {
    const auto result = client_->Post(path.c_str(), headers, body, "application/json");
    return result ? result->status : -1;
  }
  int get(const std::string& path, const httplib::Headers& headers = {}) {
    const auto result = client_->Get(path.c_str(), headers);
    return result ? result->status : -1;
  }
  std::string log() const { return fs::exists(options_.log) ? files::read_whole(options_.log) : ""; }

  const fs::path folder_ = fs::temp_directory_path() / fmt::format("selvedge-console-test-{}", ::getpid());
  ServerOptions options_;
  FakeRig rig_;
  std::unique_ptr<RunFolder> run_;
  std::unique_ptr<Server> server_;
  std::unique_ptr<httplib::Client> client_;
};

TEST_F(ConsoleServer, ShowsThePageAndTheRun) {
  EXPECT_EQ(client_->Get("/")->body, "the page");
  EXPECT_EQ(client_->Get("/app.js")->body, "script");
  EXPECT_EQ(client_->Get("/run/report.html")->body, "a report");
  const json trials = json::parse(client_->Get("/api/trials")->body);
  ASSERT_EQ(trials.size(), 1u);
  EXPECT_EQ(trials[0]["path"], "knit/still");
  EXPECT_EQ(trials[0]["state"], "cut");
  EXPECT_EQ(get("/api/trial?path=nothing"), 404);
}

TEST_F(ConsoleServer, ChangesNothingWithoutItsToken) {
  for (const char* path : {"/api/arm", "/api/stop", "/api/disarm", "/api/record", "/api/record/stop", "/api/answer", "/api/heartbeat"}) {
    EXPECT_EQ(post(path, {}), 403) << path;
    EXPECT_EQ(post(path, with("wrong")), 403) << path;
  }
  EXPECT_FALSE(rig_.armed);
  EXPECT_EQ(rig_.stops, 0);
  EXPECT_EQ(post("/api/arm", with("right")), 200);
  EXPECT_TRUE(rig_.armed);
  EXPECT_NE(log().find("403 POST /api/arm no token"), std::string::npos) << log();
  EXPECT_NE(log().find("200 /api/arm"), std::string::npos) << log();
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
  for (const char* path : {"/run/../secret.json", "/run/%2e%2e/secret.json", "/run/..%2fsecret.json", "/run//etc/passwd", "/run/link.json", "/run/key.pem", "/../secret.json", "/%2e%2e/secret.json",
                           "/api/trial?path=..", "/api/trial?path=%2e%2e%2f", "/api/frame?path=../run/knit/still&index=0", "/api/frame?path=knit/still&index=-1", "/api/motion?path=/etc"}) {
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
  EXPECT_NE(log().find("has not been heard"), std::string::npos);
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

TEST(Gate, TokensDiffer) {
  EXPECT_EQ(random_token().size(), 64u);
  EXPECT_NE(random_token(), random_token());
}

}  // namespace
}  // namespace selvedge::console
