#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <mutex>
#include <thread>

#include <fmt/format.h>
#include <selvedge_rig/corner_sample_t.hpp>
#include <selvedge_rig/device_status_t.hpp>

#include "files/bad_input.h"
#include "hardware_sim/datastream_server/datastream_server.h"
#include "rig/channels.h"
#include "rig/clock.h"
#include "rig/network.h"
#include "rig/tracker/daemon.h"

namespace selvedge {
namespace {

// Tests run beside each other; the bus tells them apart by its port alone.
const int kBusPort = 20000 + ::getpid() % 20000;

std::vector<hardware_sim::NamedPoint> moving_corner(double t) {
  return {{"fabric", "left", {0, 0, 1}}, {"fabric", "right", {0.06 * std::sin(2 * M_PI * t), 0, 1}}};
}

// The daemon on a thread, and what it put on the bus.
class TrackerDaemon : public testing::Test {
 protected:
  void SetUp() override {
    // What stops the arm rests on these samples: not to be passed over.
    ASSERT_TRUE(rig::multicast_works(kBusPort)) << rig::multicast_advice();
    options_.latency_s = 0.02;
    options_.jitter_s = 2e-3;
    options_.noise_m = 0;
    server_ = std::make_unique<hardware_sim::DatastreamServer>(options_, moving_corner);
    configuration_ = rig::Configuration::parse(
        fmt::format("[bus]\nport = {}\n[tracker]\nport = {}\n", kBusPort, server_->port()), "test.toml");
    bus_ = std::make_unique<rig::Bus>(configuration_.bus());
    bus_->subscribe<selvedge_rig::corner_sample_t>("TRACKER_CORNERS", [this](const auto& message) {
      const std::lock_guard lock(mutex_);
      samples_.push_back(message);
    });
    bus_->subscribe<selvedge_rig::device_status_t>("TRACKER_STATUS", [this](const auto& message) {
      const std::lock_guard lock(mutex_);
      statuses_.push_back(message);
    });
    bus_->start();
    daemon_ = std::thread([this] { tracker::run_daemon(configuration_, stopping_); });
  }
  void TearDown() override {
    stopping_ = true;
    if (daemon_.joinable()) daemon_.join();
    bus_.reset();  // its thread fills what the test holds
  }

  template <class Condition>
  bool wait_for(Condition condition, double limit_s = 20) {
    const double end_s = rig::host_now_s() + limit_s;
    while (rig::host_now_s() < end_s) {
      {
        const std::lock_guard lock(mutex_);
        if (condition()) return true;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
  }

  hardware_sim::DatastreamServerOptions options_;
  std::unique_ptr<hardware_sim::DatastreamServer> server_;
  rig::Configuration configuration_;
  std::unique_ptr<rig::Bus> bus_;
  std::atomic<bool> stopping_ = false;
  std::thread daemon_;
  std::mutex mutex_;
  std::vector<selvedge_rig::corner_sample_t> samples_;
  std::vector<selvedge_rig::device_status_t> statuses_;
};

TEST_F(TrackerDaemon, TimesSamplesBetterThanTheNetworkDelivers) {
  ASSERT_TRUE(wait_for([&] { return samples_.size() >= 480; }));
  const std::lock_guard lock(mutex_);
  // The motion is known, so each position on the steep part of the sinusoid says when it was taken.
  double square = 0, count = 0;
  for (size_t i = 240; i < samples_.size(); ++i) {
    const auto& sample = samples_[i];
    ASSERT_EQ(sample.count, 2);
    ASSERT_EQ(sample.name[1], "right");
    const double phase = std::fmod(1e-6 * static_cast<double>(sample.utime), 1.0);
    if (phase > 0.2 && phase < 0.8) continue;
    const double true_phase = std::asin(sample.x_m[1] / 0.06) / (2 * M_PI);
    square += std::pow(std::remainder(phase - true_phase, 1.0), 2);
    ++count;
  }
  ASSERT_GT(count, 30);
  // Jitter is 2 ms in the mean; scheduling of a loaded machine comes on top of it and is taken out as well.
  EXPECT_LT(std::sqrt(square / count), 1.5e-3);
}

TEST_F(TrackerDaemon, ComesBackAfterALostConnectionAndSaysSo) {
  ASSERT_TRUE(wait_for([&] { return samples_.size() >= 20; }));
  server_->cut_connections();
  ASSERT_TRUE(wait_for([&] {
    return std::any_of(statuses_.begin(), statuses_.end(),
                       [](const auto& status) { return status.state == selvedge_rig::device_status_t::LOST; });
  }));
  size_t before = 0;
  {
    const std::lock_guard lock(mutex_);
    before = samples_.size();
  }
  EXPECT_TRUE(wait_for([&] { return samples_.size() > before + 20; }));
}

TEST(TrackerConfiguration, UnknownKeyAndBackendAreRefusedByName) {
  const auto read = [](const std::string& text) {
    return tracker::read_configuration(rig::Configuration::parse(text, "lab.toml").section("tracker"));
  };
  EXPECT_NO_THROW(read("[tracker]\nhost = \"10.0.0.2\"\n"));
  for (const std::string text :
       {"[tracker]\nhots = \"10.0.0.2\"\n", "[tracker]\nport = 70000\n", "[tracker]\nbackend = \"optotrak\"\n"})
    EXPECT_THROW(read(text), BadInput) << text;
}

}  // namespace
}  // namespace selvedge
