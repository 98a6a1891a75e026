// `./selvedge bench capture`: the camera daemon with a reader of its frame ring, beside Aravis's own
// arv-camera-test, one after the other on the same simulated GigE Vision camera.
//
// Each client runs in a process of its own, so that its processor time can be told from the camera's.
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <thread>

#include <spdlog/spdlog.h>
#include <sys/wait.h>
#include <unistd.h>

#include "cli/benches/children_cpu.h"
#include "cli/figures.h"
#include "hardware_sim/gige_camera/gige_camera.h"
#include "rig/camera/daemon.h"
#include "rig/camera/frame_ring.h"
#include "rig/clock.h"
#include "rig/network.h"

namespace selvedge::cli {

std::vector<Figure> bench_capture_v4l2(const FigureOptions& options);

namespace {

constexpr const char* kAddress = "127.0.5.1";
constexpr int kBusPort = 17290;
constexpr double kRate_hz = 60;
constexpr double kLongestStart_s = 30;

struct Outcome {
  int64_t frames = 0, lost = 0;
  double seconds = 0;
  double cpu_s = 0;  // user and system time of the client's process
};

std::string configuration_text() {
  return fmt::format("[bus]\nport = {}\n[camera]\naddress = \"{}\"\nrate_hz = {}\npacket_size_bytes = 9000\n", kBusPort,
                     kAddress, kRate_hz);
}

// In the child: the daemon on a thread, the reader here.
Outcome read_frames(double seconds) {
  spdlog::set_level(spdlog::level::warn);
  std::atomic<bool> stopping{false};
  std::thread daemon([&] { camera::run_daemon(rig::Configuration::parse(configuration_text(), "bench"), stopping); });
  const std::string name = camera::ring_name(kBusPort, "camera");
  Outcome result;
  std::unique_ptr<camera::FrameRingReader> reader;
  for (const double end_s = rig::host_now_s() + kLongestStart_s; !reader && rig::host_now_s() < end_s;) {
    try {
      reader = std::make_unique<camera::FrameRingReader>(name);
    } catch (const std::runtime_error&) {  // not there yet
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  }
  camera::RingFrame frame;
  int64_t first = 0, last = 0;
  double start_s = 0;
  while (reader && reader->next(frame, 5)) {
    if (first == 0) {
      first = frame.head.frame_number;
      start_s = rig::host_now_s();
    }
    last = frame.head.frame_number;
    ++result.frames;
    result.seconds = rig::host_now_s() - start_s;
    if (result.seconds > seconds) break;
  }
  result.lost = last - first + 1 - result.frames;
  stopping = true;
  daemon.join();
  return result;
}

Outcome run_ours(double seconds, int pipe_end) {
  const Outcome result = read_frames(seconds);
  if (::write(pipe_end, &result, sizeof result) != sizeof result) ::_exit(1);
  ::_exit(0);
}

// Waits for the child's outcome.
Outcome collect(pid_t child, int pipe_end) {
  const double before_s = children_cpu_s();
  Outcome result;
  const bool told = ::read(pipe_end, &result, sizeof result) == sizeof result;
  int status = 0;
  ::waitpid(child, &status, 0);
  if (!told || status != 0 || result.frames == 0) throw std::runtime_error("bench capture: the daemon delivered nothing");
  result.cpu_s = children_cpu_s() - before_s;
  return result;
}

int64_t number_after(const std::string& text, const char* label) {
  const size_t place = text.find(label);
  return place == std::string::npos ? 0 : std::atoll(text.c_str() + text.find('=', place) + 1);
}

Outcome run_arv_camera_test(int seconds) {
  const double before_s = children_cpu_s();
  const std::string command = fmt::format(
      "arv-camera-test-0.8 -n {} --no-packet-socket -i 9000 -f {} -e 2000 --packet-request-ratio=2 --duration {} 2>&1",
      kAddress, kRate_hz, seconds);
  std::string text;
  char part[4096];
  FILE* pipe = ::popen(command.c_str(), "r");
  while (std::fgets(part, sizeof part, pipe)) text += part;
  ::pclose(pipe);
  Outcome result;
  result.cpu_s = children_cpu_s() - before_s;
  result.frames = number_after(text, "n_completed_buffers");
  result.lost = number_after(text, "n_failures") + number_after(text, "n_missing_frames");
  result.seconds = seconds;
  return result;
}

void add(std::vector<Figure>& figures, const std::string& who, const Outcome& ours, const std::optional<Outcome>& peer,
         const std::string& reference) {
  const double missing = std::nan("");
  const auto rate = [](const Outcome& o) { return static_cast<double>(o.frames) / o.seconds; };
  const auto cpu_ms = [](const Outcome& o) { return 1e3 * o.cpu_s / static_cast<double>(o.frames); };
  figures.push_back({who + ": whole frames", rate(ours), peer ? rate(*peer) : missing, "1/s", Relation::shown, reference});
  figures.push_back({who + ": frames lost", static_cast<double>(ours.lost),
                     peer ? static_cast<double>(peer->lost) : missing, "", Relation::shown, reference});
  figures.push_back({who + ": processor time a frame", cpu_ms(ours), peer ? cpu_ms(*peer) : missing, "ms",
                     Relation::shown, reference});
}

}  // namespace

std::vector<Figure> bench_capture(const FigureOptions& options) {
  const int seconds = options.quick ? 3 : 20;
  rig::ensure_local_multicast(kBusPort);
  const bool has_peer = std::system("command -v arv-camera-test-0.8 >/dev/null 2>&1") == 0;
  const std::string reference =
      has_peer ? "arv-camera-test-0.8, same camera, same run" : "arv-camera-test-0.8 (package aravis-tools) is not installed";

  std::vector<Figure> figures;
  int step = 0;
  for (const double loss : {0.0, 0.01}) {
    options.progress(0.2 * step, fmt::format("daemon at {:.0f} % packet loss", 100 * loss));
    // The client's process is made before the camera's threads.
    int ends[2];
    if (::pipe(ends) != 0) throw std::runtime_error("bench capture: no pipe");
    const pid_t child = ::fork();
    if (child == 0) run_ours(seconds, ends[1]);
    ::close(ends[1]);

    sim::GigeCameraOptions camera;
    camera.address = kAddress;
    camera.width_px = 1280;
    camera.height_px = 1024;
    camera.seed = options.seed;
    const size_t size = 1280 * 1024;
    sim::GigeCamera device(camera, [size, shade = uint8_t{0}](double, uint8_t* pixels) mutable {
      std::memset(pixels, ++shade, size);
      return true;
    });
    sim::GigeCameraFaults faults;
    faults.stream_loss = loss;
    device.set_faults(faults);
    const Outcome ours = collect(child, ends[0]);
    ::close(ends[0]);
    options.progress(0.2 * (step + 1), fmt::format("arv-camera-test at {:.0f} % packet loss", 100 * loss));
    std::optional<Outcome> peer;
    if (has_peer) peer = run_arv_camera_test(seconds);
    add(figures, fmt::format("1280×1024 at 60 Hz, {:.0f} % loss", 100 * loss), ours, peer, reference);
    step += 2;
  }
  camera::FrameRingWriter::remove(camera::ring_name(kBusPort, "camera"));
  options.progress(0.8, "the daemon and v4l2-ctl on a V4L2 node");
  const std::vector<Figure> v4l2 = bench_capture_v4l2(options);
  figures.insert(figures.end(), v4l2.begin(), v4l2.end());
  return figures;
}

}  // namespace selvedge::cli
