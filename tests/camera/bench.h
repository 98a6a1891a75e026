// The daemon on one thread and the simulated camera beside it, over the real loopback.
#pragma once

#include <atomic>
#include <cstring>
#include <memory>
#include <string>
#include <thread>

#include <gtest/gtest.h>

#include "hardware_sim/gige_camera/gige_camera.h"
#include "rig/camera/daemon.h"
#include "rig/camera/frame_ring.h"
#include "rig/clock.h"
#include "rig/network.h"

namespace selvedge::camera {

// Each pixel follows from the exposure's time and its place, so a frame that is torn or mixed shows.
inline void paint(double exposure_mid_host_s, uint8_t* pixels, size_t count) {
  uint64_t seed = 0;
  std::memcpy(&seed, &exposure_mid_host_s, 8);
  std::memcpy(pixels, &exposure_mid_host_s, 8);
  for (size_t i = 8; i < count; ++i) {
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    pixels[i] = static_cast<uint8_t>(seed >> 56);
  }
}
// The exposure's time, or NaN where a pixel is not what was painted.
inline double painted_time_s(const std::vector<uint8_t>& pixels) {
  double time_s = 0;
  std::memcpy(&time_s, pixels.data(), 8);
  std::vector<uint8_t> expected(pixels.size());
  paint(time_s, expected.data(), expected.size());
  return expected == pixels ? time_s : std::numeric_limits<double>::quiet_NaN();
}

// The daemon alone, for a device at an address.
struct DaemonBench {
  DaemonBench(int number, const std::string& address, const std::string& keys) : port(17200 + number) {
    rig::ensure_local_multicast(static_cast<uint16_t>(port));
    FrameRingWriter::remove(ring());
    text = "[bus]\nport = " + std::to_string(port) + "\n[camera]\naddress = \"" + address + "\"\n" + keys;
  }
  ~DaemonBench() {
    stop();
    FrameRingWriter::remove(ring());
  }
  void start() {
    stopping = false;
    thread = std::thread([this] { run_daemon(rig::Configuration::parse(text, "bench.toml"), stopping); });
  }
  void stop() {
    stopping = true;
    if (thread.joinable()) thread.join();
  }
  std::string ring() const { return ring_name(port, "camera"); }
  rig::BusConfiguration bus() const { return rig::Configuration::parse(text, "bench.toml").bus(); }

  // Waits for the daemon to make its ring; long, since a slow machine only takes longer.
  std::unique_ptr<FrameRingReader> reader() const {
    for (const double end_s = rig::host_now_s() + 30; rig::host_now_s() < end_s;) {
      try {
        return std::make_unique<FrameRingReader>(ring());
      } catch (const std::exception&) { std::this_thread::sleep_for(std::chrono::milliseconds(10)); }
    }
    return nullptr;
  }

  int port;
  std::string text;
  std::atomic<bool> stopping{false};
  std::thread thread;
};

// With the simulated GigE Vision camera.
struct Bench : DaemonBench {
  explicit Bench(int number, sim::GigeCameraOptions given = {}, const std::string& keys = "rate_hz = 50\n")
      : DaemonBench(number, "127.0.3." + std::to_string(number), "packet_size_bytes = 9000\n" + keys),
        options(std::move(given)) {
    options.address = "127.0.3." + std::to_string(number);
    plug_in();
  }
  ~Bench() { stop(); }
  void plug_in() {
    const size_t count = static_cast<size_t>(options.width_px) * static_cast<size_t>(options.height_px);
    device = std::make_unique<sim::GigeCamera>(options, [count](double time_s, uint8_t* pixels) {
      paint(time_s, pixels, count);
      return true;
    });
  }

  sim::GigeCameraOptions options;
  std::unique_ptr<sim::GigeCamera> device;
};

}  // namespace selvedge::camera
