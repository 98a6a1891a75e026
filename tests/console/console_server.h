// A console's server on a rig that is made up, for tests: what it was asked to do can be looked at.
#pragma once

#include <atomic>
#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <httplib.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "console/run_folder.h"
#include "console/server.h"
#include "files/bad_input.h"
#include "files/whole_file.h"

namespace selvedge::console {

namespace fs = std::filesystem;
using nlohmann::json;

// Whether something becomes true, with the patience that a busy machine may need.
inline bool comes_true(const std::function<bool()>& condition, double limit_s = 30) {
  const auto begin = std::chrono::steady_clock::now();
  while (std::chrono::steady_clock::now() - begin < std::chrono::duration<double>(limit_s)) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return condition();
}

class FakeRig : public RigLink {
 public:
  json state() override { return {{"devices", json::array()}, {"armed_here", armed.load()}}; }
  std::optional<Preview> preview(int64_t newer_than) override {
    return newer_than < 7 ? std::optional<Preview>({1, 7, "png", "{\"tiles\":[]}"}) : std::nullopt;
  }
  void watched() override { ++looks; }
  void arm(const std::string&) override {
    if (refuses) throw std::runtime_error("the arm is off");
    std::this_thread::sleep_for(std::chrono::duration<double>(arming_s.load()));
    armed = true;
  }
  void disarm() override { armed = false; }
  void stop(const std::string& why) override {
    stopped_at = std::chrono::steady_clock::now();
    if (does_not_stop) throw std::runtime_error("the arm has not said that it stopped");
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
  void reset(const std::string&) override { latched = false; }
  bool armed_here() const override { return armed; }

  std::atomic<bool> armed{false}, refuses{false}, does_not_stop{false}, latched{false};
  std::atomic<std::chrono::steady_clock::time_point> stopped_at{};
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
    files::write_whole(folder_ / "web" / "index.html", "the page, its stop at {{stop-port}}");
    files::write_whole(folder_ / "web" / "app.js", "script");
    files::write_whole(folder_ / "secret.json", "{\"secret\": 1}");
    files::write_whole(folder_ / "run" / "report.html", "a report");
    files::write_whole(folder_ / "run" / "key.pem", "private");
    files::write_whole(folder_ / "run" / "knit" / "still" / "trial.json",
                       "{\"experiment\": \"static\", \"state\": \"cut\"}");
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

  httplib::Headers with(const std::string& token, const std::string& page = "one",
                        const std::string& origin = "") const {
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
  // A thread of its own writes the log.
  bool logged(const std::string& text) const {
    return comes_true([&] { return log().find(text) != std::string::npos; });
  }
  std::string log() const { return fs::exists(options_.log) ? files::read_whole(options_.log) : ""; }

  const fs::path folder_ = fs::temp_directory_path() / fmt::format("selvedge-console-test-{}", ::getpid());
  ServerOptions options_;
  FakeRig rig_;
  std::unique_ptr<RunFolder> run_;
  std::unique_ptr<Server> server_;
  std::unique_ptr<httplib::Client> client_;
};

}  // namespace selvedge::console
