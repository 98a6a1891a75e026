#include "console/bus_rig_link.h"

#include <atomic>
#include <chrono>
#include <mutex>
#include <thread>

#include <fmt/format.h>
#include <selvedge_rig/operator_answer_t.hpp>
#include <spdlog/spdlog.h>

#include "calib/calibration_file.h"
#include "capture/session/arm_lease.h"
#include "capture/session/run_trial.h"
#include "capture/trial/names.h"
#include "console/heard.h"
#include "console/preview.h"
#include "console/requests.h"
#include "files/bad_input.h"
#include "rig/arm/control_link.h"
#include "rig/camera/frame_ring.h"
#include "rig/channels.h"
#include "rig/clock.h"
#include "station/rig_steps.h"

namespace selvedge::console {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr double kLookAgain_s = 1;  // at the configuration file
constexpr double kWatched_s = 1;
constexpr double kAnswer_s = 10;  // for the rig to be there when something is asked of it

}  // namespace

struct BusRigLink::Impl {
  explicit Impl(const BusRigOptions& o) : options(o), looker([this] { look(); }) {}
  ~Impl() {
    ending = true;
    cancel = true;
    looker.join();
    if (recorder.joinable()) recorder.join();
  }

  // Listens on the port that the configuration names now; makes a picture when somebody looks.
  void look() {
    double file_s = -1e9, picture_s = 0;
    while (!ending) {
      const double now_s = rig::host_now_s();
      if (now_s - file_s > kLookAgain_s) {
        file_s = now_s;
        look_at_file();
      }
      notice_a_stop();
      if (now_s - watched_s < kWatched_s && now_s - picture_s >= 1 / options.preview_rate_hz) {
        picture_s = now_s;
        try {
          take_picture();
        } catch (const std::exception& error) {
          ring.reset();  // the camera's daemon is not there (yet), or began a new ring
        }
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  }

  // An arm that stopped by itself, or was stopped by others, is not armed from here any more: only a person arms it
  // again.
  void notice_a_stop() {
    if (!armed || records) return;
    const std::shared_ptr<Heard> now = heard_now();
    if (!now || !now->disarmed_since(armed_since_us)) return;
    const std::lock_guard lock(arm_mutex);
    let_go();
  }
  // With arm_mutex held.
  void let_go() {
    lease.reset();
    arm_client.reset();
    armed = false;
  }

  void look_at_file() {
    std::error_code error;
    const auto written = fs::last_write_time(options.configuration, error);
    if (error || (heard_now() && written == file_written)) return;
    try {
      rig::Configuration loaded = rig::Configuration::load(options.configuration);
      auto fresh = std::make_shared<Heard>(loaded);
      const std::lock_guard lock(mutex);
      configuration = std::move(loaded);
      heard = std::move(fresh);
      file_written = written;
      ring.reset();
    } catch (const std::exception& problem) { spdlog::warn("{}", problem.what()); }
  }

  void take_picture() {
    const std::shared_ptr<Heard> now = heard_now();
    if (!now) return;
    const std::string name = camera::ring_name(current().bus().port, "camera");
    if (!ring || ring->replaced()) ring = std::make_unique<camera::FrameRingReader>(name);
    bool any = false;
    while (ring->next(frame, 0)) any = any || frame.head.whole;
    if (!any || !frame.head.whole) return;
    const LivePicture picture = live_picture(frame.pixels, ring->width_px(), ring->height_px(), now->stripes_show());
    Preview fresh{frame.head.utime, frame.head.frame_number, picture.png, overlay_json(picture)};
    const std::lock_guard lock(mutex);
    newest = std::move(fresh);
  }

  std::shared_ptr<Heard> heard_now() const {
    const std::lock_guard lock(mutex);
    return heard;
  }
  rig::Configuration current() const {
    const std::lock_guard lock(mutex);
    return configuration;
  }
  // Where no rig is heard, the file may still name an arm whose daemon listens. Throws where there is none to read:
  // nothing was stopped then, and nobody shall be told so.
  void stop_arm(const std::string& why) const {
    const rig::Configuration known = heard_now() ? current() : rig::Configuration::load(options.configuration);
    if (known.has("arm")) arm::stop_arm(known, why);
  }
  std::shared_ptr<Heard> need_rig() const {
    auto now = heard_now();
    if (!now) refuse(options.configuration.string(), "no rig yet: start one with ./selvedge rig up, or a session");
    return now;
  }

  void run_recording(const session::TrialPlan& trial, const session::RigOptics& optics) {
    std::string ended = "recorded";
    try {
      const rig::Configuration rig_configuration = current();
      const session::SessionPlan plan = session::read_session_plan(rig_configuration);
      session::RigClient client(rig_configuration);
      const auto progress = [this](double done, const std::string& what) {
        if (cancel) throw session::DeviceFailed("stopped at the console");
        const std::lock_guard lock(mutex);
        recording["done"] = done;
        recording["message"] = what;
      };
      client.wait_until_running(kAnswer_s, [&](const std::string& missing) { progress(0, missing); });
      fs::create_directories(options.recordings);
      const session::TrialRecord record =
          station::record_session_trial(client, rig_configuration, plan, trial, optics, options.recordings, progress);
      ended = fmt::format("recorded {} frames, {} lost, a corner hidden in {:.0f} % of the samples{}", record.frames,
                          record.frames_lost, 100 * record.occluded_share,
                          record.started_at_rest ? "" : "; it did not begin at rest");
    } catch (const std::exception& error) { ended = error.what(); }
    const std::lock_guard lock(mutex);
    recording["running"] = false;
    recording["ended"] = ended;
    records = false;
  }

  const BusRigOptions options;
  mutable std::mutex mutex;  // of all down to recording
  rig::Configuration configuration;
  fs::file_time_type file_written{};
  std::shared_ptr<Heard> heard;
  std::optional<Preview> newest;
  json recording = json::object();
  std::atomic<double> watched_s{-1e9};
  std::atomic<bool> ending{false}, cancel{false}, records{false}, robot{false};

  std::unique_ptr<camera::FrameRingReader> ring;  // the looker's alone
  camera::RingFrame frame;

  std::mutex arm_mutex;  // of the lease
  std::unique_ptr<session::RigClient> arm_client;
  std::unique_ptr<session::ArmLease> lease;
  std::atomic<bool> armed{false};
  std::atomic<int> stops{0};  // asked for here
  std::atomic<int64_t> armed_since_us{0};
  std::thread recorder;
  std::thread looker;
};

BusRigLink::BusRigLink(const BusRigOptions& options) : impl_(std::make_unique<Impl>(options)) {}

BusRigLink::~BusRigLink() {
  try {
    disarm();
  } catch (const std::exception&) {  // the lease ends with this process
  }
}

json BusRigLink::state() {
  const auto heard = impl_->heard_now();
  json out = heard ? heard->state() : json{{"devices", json::array()}};
  out["rig"] = heard ? "listening" : "none";
  out["armed_here"] = impl_->armed.load();
  out["calibrated"] = fs::exists(impl_->options.calibration);
  const std::lock_guard lock(impl_->mutex);
  out["record"] = impl_->recording;
  return out;
}

std::optional<Preview> BusRigLink::preview(int64_t newer_than) {
  const std::lock_guard lock(impl_->mutex);
  return impl_->newest && impl_->newest->number != newer_than ? impl_->newest : std::nullopt;
}

void BusRigLink::watched() { impl_->watched_s = rig::host_now_s(); }

void BusRigLink::arm(const std::string& who) {
  impl_->need_rig();
  const std::lock_guard lock(impl_->arm_mutex);
  if (!impl_->current().has("arm")) refuse("arm", "this rig has none");
  if (impl_->records) refuse("arm", "a trial is being recorded");
  impl_->lease.reset();
  const int stops_before = impl_->stops;
  impl_->arm_client = std::make_unique<session::RigClient>(impl_->current());
  impl_->lease = std::make_unique<session::ArmLease>(*impl_->arm_client, who);
  if (impl_->stops != stops_before) {  // that stop may not have reached the daemon, which was away perhaps
    impl_->let_go();
    throw std::runtime_error("arm: stopped at the console while it was being armed");
  }
  impl_->armed_since_us = rig::host_now_us();
  impl_->armed = true;
}

void BusRigLink::disarm() {
  const std::lock_guard lock(impl_->arm_mutex);
  impl_->let_go();
}

// The stop itself first: it must not wait for anything else, nor its answer for an arming that still asks. Where the
// daemon cannot be reached the page says that the stop is not confirmed; whatever is armed or recorded from here ends
// all the same.
void BusRigLink::stop(const std::string& why) {
  std::exception_ptr failed;
  impl_->cancel = true;
  ++impl_->stops;
  try {
    impl_->stop_arm(why);
  } catch (...) { failed = std::current_exception(); }
  if (const std::unique_lock lock(impl_->arm_mutex, std::try_to_lock); lock) impl_->let_go();
  if (failed) std::rethrow_exception(failed);
}

void BusRigLink::reset(const std::string& who) {
  const auto state = impl_->need_rig()->state();
  if (!state.contains("arm") || !state["arm"].value("latched", false)) refuse("reset", "no stop holds");
  arm::ControlClient(arm::control_socket(impl_->current())).reset(state["arm"]["stop_number"], who);
}

void BusRigLink::record(const json& wanted) {
  const session::TrialPlan trial = trial_of(wanted);
  impl_->need_rig();
  if (impl_->records.exchange(true)) refuse("record", "a trial is being recorded");
  try {
    if (fs::exists(impl_->options.recordings / trial.name)) refuse("trial name", "{} is there already", trial.name);
    const calib::StoredCalibration calibration = calib::read_calibration(impl_->options.calibration);
    if (!calibration.projector) refuse(impl_->options.calibration.string(), "has no projector");
    impl_->robot = trial.kind == trial::Experiment::robot;
    if (impl_->robot) {
      if (!impl_->armed) refuse("record", "a robot trial moves the arm: arm it first");
      // The trial takes the arm over; that somebody armed it here still counts.
      const std::lock_guard lock(impl_->arm_mutex);
      impl_->lease.reset();
      impl_->arm_client.reset();
    }
    if (impl_->recorder.joinable()) impl_->recorder.join();
    impl_->cancel = false;
    {
      const std::lock_guard lock(impl_->mutex);
      impl_->recording = {{"running", true},
                          {"trial", trial.name},
                          {"kind", trial::to_text(trial.kind)},
                          {"done", 0.0},
                          {"message", "begins"}};
    }
    const session::RigOptics optics{calibration.camera, *calibration.projector};
    impl_->recorder = std::thread([impl = impl_.get(), trial, optics] {
      impl->run_recording(trial, optics);
      if (impl->robot.exchange(false)) impl->armed = false;
    });
  } catch (...) {
    impl_->records = false;
    throw;
  }
}

void BusRigLink::stop_recording() { impl_->cancel = true; }

void BusRigLink::answer(int64_t prompt_id, const std::string& text) {
  static const std::vector<std::string> known = {"done", "repeat", "skip", "stop", "reset"};
  if (std::find(known.begin(), known.end(), text) == known.end())
    refuse("answer", "found {:.40}, expected done, repeat, skip, stop or reset", text);
  selvedge_rig::operator_answer_t message{};
  message.utime = rig::host_now_us();
  message.prompt_id = prompt_id;
  message.answer = text;
  impl_->need_rig()->bus().publish(rig::kOperatorAnswer, message);
}

bool BusRigLink::armed_here() const { return impl_->armed || (impl_->records && impl_->robot); }

}  // namespace selvedge::console
