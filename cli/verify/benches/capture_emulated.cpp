// `./selvedge bench capture-v4l2` and `capture-usb3`: the camera daemon beside another's client, one after the other on
// the same simulated camera: `v4l2-ctl --stream-mmap` on a V4L2 node, `arv-camera-test` on a USB3 Vision device. Parts
// of
// `./selvedge bench capture`.
//
// Node and bus are umockdev's, whose library must stand between each process and the kernel: this program runs itself
// again under umockdev-wrapper and reads back what that run measured. The clients are programs of their own, so that
// their processor time can be told from the camera's; the daemon's frames are read out of its ring here.
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <stdexcept>
#include <thread>

#include <fmt/format.h>

#include "cli/verify/benches/arv_camera_test.h"
#include "cli/verify/benches/children_cpu.h"
#include "cli/verify/figures.h"
#include "files/shared_files.h"
#include "files/whole_file.h"
#include "hardware_sim/usb3_camera/usb3_camera.h"
#include "hardware_sim/v4l2_camera/v4l2_camera.h"
#include "rig/camera/frame_ring.h"
#include "rig/clock.h"
#include "rig/network.h"
#include "station/child_process.h"
#include "station/programs.h"

namespace selvedge::cli {

namespace {

constexpr int kEmulatedBusPort = 17291;
constexpr double kEmulatedRate_hz = 60, kDaemonStart_s = 30;
constexpr int kEmulatedWidth_px = 1280, kEmulatedHeight_px = 1024;
constexpr int kFirstFrames = 30;  // not counted: the client is still starting

struct Streamed {
  int64_t frames = 0, lost = 0;
  double seconds = 0, cpu_s = 0;
};

// camera_keys: of the rig's [camera], besides the rate.
Streamed stream_by_daemon(const std::string& camera_keys, int frames, const std::filesystem::path& folder) {
  const std::filesystem::path rig = folder / "rig.toml";
  std::ofstream(rig) << fmt::format("[bus]\nport = {}\n[camera]\n{}rate_hz = {}\n", kEmulatedBusPort, camera_keys,
                                    kEmulatedRate_hz);
  const std::string ring = camera::ring_name(kEmulatedBusPort, "camera");
  camera::FrameRingWriter::remove(ring);
  const double before_s = children_cpu_s();
  Streamed out;
  {
    const station::ChildProcess daemon(
        "camera daemon",
        {station::program(station::kLabProgram).string(), "daemon", "camera", "--config", rig.string()},
        folder / "daemon.log");
    std::unique_ptr<camera::FrameRingReader> reader;
    for (const double end_s = rig::host_now_s() + kDaemonStart_s; !reader;) {
      try {
        reader = std::make_unique<camera::FrameRingReader>(ring);
      } catch (const std::runtime_error&) {  // not there yet
        if (rig::host_now_s() > end_s)
          throw std::runtime_error("bench: the daemon delivered nothing; see " + (folder / "daemon.log").string());
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
      }
    }
    camera::RingFrame frame;
    int64_t first = 0, last = 0;
    double start_s = 0;
    for (int seen = 0; out.frames < frames && reader->next(frame, 5); ++seen) {
      if (seen < kFirstFrames) continue;
      if (first == 0) {
        first = frame.head.frame_number;
        start_s = rig::host_now_s();
      }
      last = frame.head.frame_number;
      ++out.frames;
    }
    out.seconds = rig::host_now_s() - start_s;
    out.lost = last - first + 1 - out.frames;
  }
  if (out.frames < 2)
    throw std::runtime_error("bench: the daemon delivered nothing; see " + (folder / "daemon.log").string());
  out.cpu_s = children_cpu_s() - before_s;
  camera::FrameRingWriter::remove(ring);
  return out;
}

// v4l2-ctl says a line a buffer: "cap dqbuf: 1 seq:     37 bytesused: … ts: 1234.567890 …".
Streamed stream_by_v4l2_ctl(int frames) {
  const double before_s = children_cpu_s();
  const std::string command =
      fmt::format("v4l2-ctl -d /dev/video0 --set-parm={:.0f} --stream-mmap --stream-count={} --verbose 2>&1",
                  kEmulatedRate_hz, frames + kFirstFrames);
  FILE* const pipe = ::popen(command.c_str(), "r");
  Streamed out;
  int64_t first = -1, last = -1;
  int seen = 0;
  double first_s = 0, last_s = 0;
  char line[4096];
  while (std::fgets(line, sizeof line, pipe) != nullptr) {
    const char *seq = std::strstr(line, "seq:"), *stamp = std::strstr(line, "ts: ");
    if (seq == nullptr || stamp == nullptr || ++seen <= kFirstFrames) continue;
    last = std::atoll(seq + 4);
    last_s = std::atof(stamp + 4);
    if (first < 0) {
      first = last;
      first_s = last_s;
    }
    ++out.frames;
  }
  ::pclose(pipe);
  if (out.frames < 2) throw std::runtime_error("bench capture-v4l2: v4l2-ctl delivered nothing");
  out.lost = last - first + 1 - out.frames;
  out.seconds = last_s - first_s;
  out.cpu_s = children_cpu_s() - before_s;
  return out;
}

// It sums its counts up at the end; what the camera had no room for it does not know of.
Streamed stream_from_usb3_by_arv_camera_test(const std::string& address, int frames,
                                             const std::function<int64_t()>& lost_by_camera) {
  const double before_s = children_cpu_s();
  const int64_t lost_before = lost_by_camera();
  Streamed out;
  out.seconds = std::ceil(frames / kEmulatedRate_hz);
  const ArvCounts counts = run_arv_camera_test(address, kEmulatedRate_hz, out.seconds);
  out.frames = counts.whole;
  if (out.frames < 2) throw std::runtime_error("bench capture-usb3: arv-camera-test delivered nothing");
  out.lost = counts.lost + lost_by_camera() - lost_before;
  out.cpu_s = children_cpu_s() - before_s;
  return out;
}

// Another's client and the package that has it.
struct Peer {
  std::string program, package;
  std::function<Streamed(int frames)> stream;
};

std::vector<Figure> compare(const FigureOptions& options, const std::filesystem::path& folder, const std::string& wire,
                            const std::string& camera_keys, const Peer& peer) {
  const int frames = options.quick ? 120 : 1200;
  rig::ensure_local_multicast(kEmulatedBusPort);
  const Streamed ours = stream_by_daemon(camera_keys, frames, folder);
  const bool has_peer = std::system(("command -v " + peer.program + " > /dev/null 2>&1").c_str()) == 0;
  const Streamed theirs = has_peer ? peer.stream(frames) : Streamed{};
  const std::string reference = has_peer ? peer.program + ", same device, same run"
                                         : fmt::format("{} (package {}) is not installed", peer.program, peer.package);
  const auto beside = [&](double value) { return has_peer ? value : std::nan(""); };
  const auto rate = [](const Streamed& s) { return static_cast<double>(s.frames - 1) / s.seconds; };
  const auto cpu_ms = [](const Streamed& s) { return 1e3 * s.cpu_s / static_cast<double>(s.frames + kFirstFrames); };
  const std::string who = wire + ", 1280×1024 at 60 Hz";
  return {{who + ": frames", rate(ours), beside(rate(theirs)), "1/s", Relation::shown, reference},
          {who + ": frames lost", static_cast<double>(ours.lost), beside(static_cast<double>(theirs.lost)), "",
           Relation::shown, reference},
          {who + ": processor time a frame", cpu_ms(ours), beside(cpu_ms(theirs)), "ms", Relation::shown, reference}};
}

// Each picture of one grey, the next one of another.
auto flat_pictures() {
  return [shade = uint8_t{0}](double, uint8_t* pixels) mutable {
    std::memset(pixels, ++shade, size_t{kEmulatedWidth_px} * kEmulatedHeight_px);
    return true;
  };
}

std::vector<Figure> compare_on_node(const FigureOptions& options, const std::filesystem::path& folder) {
  hardware_sim::V4l2CameraOptions camera;
  camera.width_px = kEmulatedWidth_px;
  camera.height_px = kEmulatedHeight_px;
  camera.rate_hz = kEmulatedRate_hz;
  const hardware_sim::V4l2Camera device(camera, flat_pictures());
  return compare(options, folder, "V4L2", "backend = \"v4l2\"\naddress = \"/dev/video0\"\n",
                 {"v4l2-ctl", "v4l-utils", stream_by_v4l2_ctl});
}

std::vector<Figure> compare_on_bus(const FigureOptions& options, const std::filesystem::path& folder) {
  sim::Usb3CameraOptions camera;
  camera.width_px = kEmulatedWidth_px;
  camera.height_px = kEmulatedHeight_px;
  const sim::Usb3Camera device(camera, flat_pictures());
  const Peer peer = {"arv-camera-test-0.8", "aravis-tools",
                     [&](int frames) {
    return stream_from_usb3_by_arv_camera_test(device.name(), frames, [&] { return device.counts().frames_lost; });
                     }};
  return compare(options, folder, "USB3 Vision", fmt::format("address = \"{}\"\n", device.name()), peer);
}

std::vector<Figure> figures_in(const std::filesystem::path& json) {
  std::vector<Figure> out;
  const nlohmann::json all = files::read_json(json);
  for (const auto& f : all.at("figures"))
    out.push_back({f.at("what"), f.at("measured"),
                   f.at("reference").is_number() ? f.at("reference").get<double>() : std::nan(""), f.at("unit"),
                   Relation::shown, f.at("source")});
  return out;
}

using Comparison = std::vector<Figure> (*)(const FigureOptions&, const std::filesystem::path& folder);

// bench: the name under which this program measures it.
std::vector<Figure> under_wrapper(const std::string& bench, Comparison compare_there, const FigureOptions& options) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / fmt::format("selvedge-{}-{}", bench, ::getpid());
  std::filesystem::create_directories(folder);
  std::vector<Figure> figures;
  if (const char* preloaded = std::getenv("LD_PRELOAD");
      preloaded != nullptr && std::strstr(preloaded, "umockdev") != nullptr) {
    figures = compare_there(options, folder);
  } else {
    const std::string self = files::own_program(), json = folder / "figures.json", log = folder / "bench.log";
    const std::string command = fmt::format("umockdev-wrapper '{}' bench {} {}--json '{}' > '{}' 2>&1", self, bench,
                                            options.quick ? "--quick " : "", json, log);
    if (std::system(command.c_str()) != 0)
      throw std::runtime_error(fmt::format("bench {}: no figures under umockdev-wrapper; see {}", bench, log));
    figures = figures_in(json);
  }
  std::filesystem::remove_all(folder);
  return figures;
}

}  // namespace

std::vector<Figure> bench_capture_v4l2(const FigureOptions& options) {
  return under_wrapper("capture-v4l2", compare_on_node, options);
}
std::vector<Figure> bench_capture_usb3(const FigureOptions& options) {
  return under_wrapper("capture-usb3", compare_on_bus, options);
}

}  // namespace selvedge::cli
