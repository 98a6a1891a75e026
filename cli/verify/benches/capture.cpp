// `./selvedge bench capture`: the camera daemon with a reader of its frame ring, beside Aravis's own
// arv-camera-test, one after the other on the same simulated GigE Vision camera.
// `./selvedge bench recorder`: the daemon and the recorder behind it, for ten minutes, onto this disk.
//
// Each client runs in a process of its own, so that its processor time can be told from the camera's.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <functional>
#include <memory>
#include <random>
#include <stdexcept>
#include <thread>
#include <type_traits>

#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "capture/recorder.h"
#include "cli/verify/benches/arv_camera_test.h"
#include "cli/verify/benches/children_cpu.h"
#include "cli/verify/figures.h"
#include "files/bad_input.h"
#include "files/whole_file.h"
#include "hardware_sim/gige_camera/gige_camera.h"
#include "rig/camera/daemon.h"
#include "rig/camera/frame_ring.h"
#include "rig/clock.h"
#include "rig/network.h"

namespace selvedge::cli {

std::vector<Figure> bench_capture_usb3(const FigureOptions& options);
std::vector<Figure> bench_capture_v4l2(const FigureOptions& options);

namespace {

constexpr const char* kAddress = "127.0.5.1";
constexpr int kBusPort = 17290;
constexpr double kRate_hz = 60;
constexpr int kWidth_px = 1280, kHeight_px = 1024;
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

// In the child: the daemon on a thread, the reader here. keep: each frame, in order.
Outcome read_frames(double seconds, const std::function<void(const camera::RingFrame&)>& keep = {}) {
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
    if (keep) keep(frame);
    ++result.frames;
    result.seconds = rig::host_now_s() - start_s;
    if (result.seconds > seconds) break;
  }
  result.lost = last - first + 1 - result.frames;
  stopping = true;
  daemon.join();
  return result;
}

// A client in a child of this process, which is to be made before the camera's threads.
struct Client {
  pid_t process = 0;
  int answer = -1;  // its end of the pipe
};

template <class Result>
Client start(const std::function<Result()>& client) {
  static_assert(std::is_trivially_copyable_v<Result>);
  int ends[2];
  if (::pipe(ends) != 0) throw std::runtime_error("bench: no pipe");
  const pid_t child = ::fork();
  if (child == 0) {
    try {
      const Result result = client();
      ::_exit(::write(ends[1], &result, sizeof result) == sizeof result ? 0 : 1);
    } catch (const std::exception& error) {
      std::fprintf(stderr, "%s\n", error.what());
      ::_exit(1);
    }
  }
  ::close(ends[1]);
  return {child, ends[0]};
}

struct Recording : Outcome {
  capture::FrameCounts written;
  size_t durable_before_end = 0;  // frames, when the camera stopped
  size_t gaps = 0;                // in the numbers, as trial.json names them
  double most_mb = 0;             // of memory, the whole process
};

Recording record_frames(double seconds, const std::filesystem::path& folder) {
  trial::Trial header;
  header.name = folder.filename().string();
  header.fabric = {"bench", 0.3, 0.3, 0.0144, true};
  header.camera.emplace();
  header.camera->width_px = kWidth_px;
  header.camera->height_px = kHeight_px;
  header.frame_rate_hz = kRate_hz;
  capture::Recorder recorder(header, folder);
  Recording result;
  static_cast<Outcome&>(result) = read_frames(seconds, [&](const camera::RingFrame& f) {
    recorder.add_frame(static_cast<int>(f.head.frame_number), static_cast<double>(f.head.frame_number) / kRate_hz,
                       f.pixels.data(), kWidth_px, kHeight_px);
  });
  result.durable_before_end = recorder.recorded().frames.durable;
  recorder.finish();
  result.written = recorder.recorded().frames;
  result.gaps = files::read_json(folder / "trial.json").at("frames").at("gaps").size();
  rusage used{};
  ::getrusage(RUSAGE_SELF, &used);
  result.most_mb = static_cast<double>(used.ru_maxrss) / 1024;
  return result;
}

// Waits for the client's outcome.
template <class Result>
Result collect(const Client& client) {
  const double before_s = children_cpu_s();
  Result result;
  const bool told = ::read(client.answer, &result, sizeof result) == sizeof result;
  ::close(client.answer);
  int status = 0;
  ::waitpid(client.process, &status, 0);
  if (!told || status != 0 || result.frames == 0) throw std::runtime_error("the daemon delivered nothing");
  result.cpu_s = children_cpu_s() - before_s;
  return result;
}

Outcome stream_by_arv_camera_test(int seconds) {
  const double before_s = children_cpu_s();
  const ArvCounts counts =
      run_arv_camera_test(kAddress, kRate_hz, seconds, " --no-packet-socket -i 9000 --packet-request-ratio=2");
  Outcome result;
  result.cpu_s = children_cpu_s() - before_s;
  result.frames = counts.whole;
  result.lost = counts.lost;
  result.seconds = seconds;
  return result;
}

void add(std::vector<Figure>& figures, const std::string& who, const Outcome& ours, const std::optional<Outcome>& peer,
         const std::string& reference) {
  const double missing = std::nan("");
  const auto rate = [](const Outcome& o) { return static_cast<double>(o.frames) / o.seconds; };
  const auto cpu_ms = [](const Outcome& o) { return 1e3 * o.cpu_s / static_cast<double>(o.frames); };
  figures.push_back(
      {who + ": whole frames", rate(ours), peer ? rate(*peer) : missing, "1/s", Relation::shown, reference});
  figures.push_back({who + ": frames lost", static_cast<double>(ours.lost),
                     peer ? static_cast<double>(peer->lost) : missing, "", Relation::shown, reference});
  figures.push_back({who + ": processor time a frame", cpu_ms(ours), peer ? cpu_ms(*peer) : missing, "ms",
                     Relation::shown, reference});
}

// paint: fills a picture.
std::unique_ptr<sim::GigeCamera> camera_of(double loss, unsigned seed, std::function<void(uint8_t*)> paint) {
  sim::GigeCameraOptions options;
  options.address = kAddress;
  options.width_px = kWidth_px;
  options.height_px = kHeight_px;
  options.seed = seed;
  auto camera = std::make_unique<sim::GigeCamera>(options, [paint = std::move(paint)](double, uint8_t* pixels) {
    paint(pixels);
    return true;
  });
  sim::GigeCameraFaults faults;
  faults.stream_loss = loss;
  camera->set_faults(faults);
  return camera;
}

// Stripes with a sensor's noise of two grey levels, which is what makes a picture large on disk.
std::vector<std::vector<uint8_t>> noisy_stripes(unsigned seed) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> noise(0, 2);
  std::vector<std::vector<uint8_t>> pictures(4, std::vector<uint8_t>(size_t{kWidth_px} * kHeight_px));
  for (size_t p = 0; p < pictures.size(); ++p)
    for (int y = 0; y < kHeight_px; ++y)
      for (int x = 0; x < kWidth_px; ++x) {
        const double grey = 128 + 90 * std::sin(0.25 * y + 0.02 * x + static_cast<double>(p)) + noise(generator);
        pictures[p][static_cast<size_t>(y) * kWidth_px + static_cast<size_t>(x)] =
            static_cast<uint8_t>(std::clamp(grey, 0.0, 255.0));
      }
  return pictures;
}

}  // namespace

std::vector<Figure> bench_recorder(const FigureOptions& options) {
  const double seconds = options.quick ? 3 : 600;
  rig::ensure_local_multicast(kBusPort);
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / fmt::format("selvedge-bench-recorder-{}", ::getpid());
  const double wanted_gib = seconds * kRate_hz * kWidth_px * kHeight_px / (1 << 30);  // where nothing is compressed
  const double free_gib = static_cast<double>(std::filesystem::space(folder.parent_path()).available) / (1 << 30);
  if (free_gib < wanted_gib)
    refuse(folder.parent_path().string(),
           "found {:.1f} GiB free, expected {:.1f} for {:.0f} s of pictures; TMPDIR names another folder", free_gib,
           wanted_gib, seconds);
  const std::vector<std::vector<uint8_t>> pictures = noisy_stripes(options.seed);
  size_t shown = 0;
  options.progress(0, fmt::format("{:.0f} s of pictures", seconds));
  Recording r;
  try {
    const Client client = start<Recording>([&] { return record_frames(seconds, folder); });
    const auto device = camera_of(0, options.seed, [&](uint8_t* pixels) {
      std::memcpy(pixels, pictures[shown++ % pictures.size()].data(), pictures[0].size());
    });
    r = collect<Recording>(client);
  } catch (...) {
    std::filesystem::remove_all(folder);
    throw;
  }
  std::filesystem::remove_all(folder);
  camera::FrameRingWriter::remove(camera::ring_name(kBusPort, "camera"));
  const double count = static_cast<double>(r.frames), written = static_cast<double>(r.written.written);
  const std::string what = fmt::format("1280×1024 at 60 Hz for {:.0f} s: ", seconds);
  std::vector<Figure> out;
  out.push_back({what + "frames written", written / r.seconds, kRate_hz, "1/s", Relation::shown, "the camera's rate"});
  out.push_back({what + "frames durable when the camera stopped", static_cast<double>(r.durable_before_end), written,
                 "", Relation::shown, "frames written"});
  out.push_back(
      {what + "frames lost between camera and ring", static_cast<double>(r.lost), 0, "", Relation::shown, "none"});
  out.push_back({what + "frames refused by the recorder", static_cast<double>(r.written.refused), 0, "",
                 Relation::shown, "none"});
  out.push_back({what + "gaps named in the trial", static_cast<double>(r.gaps), 0, "", Relation::shown, "none"});
  out.push_back({what + "frames stored without compression, to keep up", static_cast<double>(r.written.stored), count,
                 "", Relation::shown, "all frames"});
  out.push_back({what + "most memory of pictures that wait",
                 static_cast<double>(r.written.most_queued_bytes) / 1048576.0, 256, "MiB", Relation::shown,
                 "the queue's bound"});
  out.push_back({what + "most memory of daemon and recorder", r.most_mb, 512, "MiB", Relation::shown,
                 "the queue, the ring and room to spare"});
  out.push_back({what + "on disk, a frame", static_cast<double>(r.written.bytes_on_disk) / written / 1048576.0, 1.25,
                 "MiB", Relation::shown, "its pixels"});
  out.push_back({what + "processor time a frame, daemon and recorder", 1e3 * r.cpu_s / count, 1e3 / kRate_hz, "ms",
                 Relation::shown, "one core's"});
  options.progress(1, "done");
  return out;
}

// The round with the median rate, with the frames that all rounds lost: a virtual machine's timers make the simulated
// camera itself miss a frame now and then, in some rounds more than in others.
Outcome median_of(std::vector<Outcome> rounds) {
  std::sort(rounds.begin(), rounds.end(), [](const Outcome& a, const Outcome& b) {
    return static_cast<double>(a.frames) / a.seconds < static_cast<double>(b.frames) / b.seconds;
  });
  Outcome median = rounds[rounds.size() / 2];
  median.lost = 0;
  for (const Outcome& round : rounds) median.lost += round.lost;
  return median;
}

std::vector<Figure> bench_capture(const FigureOptions& options) {
  const int seconds = options.quick ? 3 : 8, rounds = options.quick ? 1 : 3;
  rig::ensure_local_multicast(kBusPort);
  const bool has_peer = std::system("command -v arv-camera-test-0.8 >/dev/null 2>&1") == 0;
  const std::string reference = has_peer ? "arv-camera-test-0.8, same camera, same run"
                                         : "arv-camera-test-0.8 (package aravis-tools) is not installed";

  std::vector<Figure> figures;
  double done = 0;
  for (const double loss : {0.0, 0.01}) {
    std::vector<Outcome> ours, peers;
    for (int round = 0; round < rounds; ++round, done += 0.4 / rounds) {
      options.progress(done,
                       fmt::format("daemon at {:.0f} % packet loss, round {} of {}", 100 * loss, round + 1, rounds));
      const Client client = start<Outcome>([&] { return read_frames(seconds); });
      const auto device = camera_of(loss, options.seed, [shade = uint8_t{0}](uint8_t* pixels) mutable {
        std::memset(pixels, ++shade, size_t{kWidth_px} * kHeight_px);
      });
      ours.push_back(collect<Outcome>(client));
      options.progress(done + 0.2 / rounds, fmt::format("arv-camera-test at {:.0f} % packet loss, round {} of {}",
                                                        100 * loss, round + 1, rounds));
      if (has_peer) peers.push_back(stream_by_arv_camera_test(seconds));
    }
    add(figures, fmt::format("1280×1024 at 60 Hz, {:.0f} % loss", 100 * loss), median_of(ours),
        has_peer ? std::optional(median_of(peers)) : std::nullopt, reference);
  }
  camera::FrameRingWriter::remove(camera::ring_name(kBusPort, "camera"));
  options.progress(0.7, "the daemon and v4l2-ctl on a V4L2 node");
  for (Figure& figure : bench_capture_v4l2(options)) figures.push_back(std::move(figure));
  options.progress(0.85, "the daemon and arv-camera-test on a USB bus");
  for (Figure& figure : bench_capture_usb3(options)) figures.push_back(std::move(figure));
  return figures;
}

}  // namespace selvedge::cli
