#include "cli/verify/soak/people.h"

#include <array>
#include <chrono>
#include <fstream>
#include <sstream>

#include <fmt/format.h>
#include <selvedge_rig/operator_answer_t.hpp>
#include <spdlog/spdlog.h>

#include "rig/arm/control_link.h"
#include "rig/arm/daemon.h"
#include "rig/channels.h"
#include "rig/clock.h"

namespace selvedge::cli {

namespace {

using selvedge_rig::arm_command_t;
using selvedge_rig::arm_control_t;
using selvedge_rig::arm_status_t;

constexpr double kMotion_s = 20;       // waiting for the arm to move, before it is done anyhow
constexpr double kHeldBefore_s = 0.3;  // the arm was somebody's, if it was armed for so long without a break
constexpr double kStranger_s = 2;
constexpr double kLetGo_s = 1;   // for the arm to be let go of after whoever held it was killed
constexpr double kHeard_s = 10;  // for what the arm measured to be heard here, however busy this machine is
constexpr int kFlood = 10000, kBusFlood = 600;

void pause(double seconds) { std::this_thread::sleep_for(std::chrono::duration<double>(seconds)); }

struct Console {
  int port = 0;
  std::string token;
};

// From "http://127.0.0.1:8080/#token=…" in a console's output, the newest.
std::optional<Console> console_at(const std::filesystem::path& log) {
  std::stringstream text;
  text << std::ifstream(log).rdbuf();
  const std::string said = text.str(), before = "http://127.0.0.1:", mark = "/#token=";
  const size_t token = said.rfind(mark), start = said.rfind(before, token);
  if (token == std::string::npos || start == std::string::npos) return std::nullopt;
  const size_t end = said.find_first_of(" \n", token);
  return Console{std::atoi(said.c_str() + start + before.size()),
                 said.substr(token + mark.size(), end - token - mark.size())};
}

// The answer's status; 0 where none came.
int post(const Console& console, const std::string& path, double patience_s) {
  const std::string request = fmt::format(
      "POST {} HTTP/1.1\r\nHost: 127.0.0.1:{}\r\nX-Selvedge-Token: {}\r\nX-Selvedge-Page: soak\r\n"
      "Content-Length: 0\r\nConnection: close\r\n\r\n",
      path, console.port, console.token);
  const wire::Socket socket = wire::connect_tcp("127.0.0.1", console.port, 1);
  socket.send(std::span(reinterpret_cast<const std::uint8_t*>(request.data()), request.size()));
  std::array<std::uint8_t, 256> bytes;
  if (!socket.readable(patience_s)) return 0;
  const size_t got = socket.receive(bytes);
  const std::string answer(bytes.begin(), bytes.begin() + static_cast<long>(got));
  return answer.rfind("HTTP/1.1 ", 0) == 0 ? std::atoi(answer.c_str() + 9) : 0;
}

}  // namespace

People::People(const rig::Configuration& configuration, rig::Bus& bus, ArmAudit& audit,
               std::filesystem::path console_log, std::function<void()> kill_console, unsigned seed)
    : configuration_(configuration), bus_(bus), audit_(audit), console_log_(std::move(console_log)),
      kill_console_(std::move(kill_console)), random_(seed) {}

People::~People() { go_home(); }

void People::go_home() {
  ending_ = true;
  acts_.clear();
}

void People::hear(const arm_status_t& status) {
  const std::lock_guard lock(mutex_);
  const double now_s = rig::host_now_s();
  if (!status.armed) not_armed_s_ = 1e-6 * static_cast<double>(status.utime);
  if (!status.latched) latched_since_s_ = -1;
  else if (latched_since_s_ < 0 || status.stop_number != status_.stop_number) {
    latched_since_s_ = now_s;
    hold_s_ = std::uniform_real_distribution<double>(2, 6)(random_);
  }
  status_ = status;
}

void People::hear(const selvedge_rig::operator_prompt_t& prompt) {
  const std::lock_guard lock(mutex_);
  prompt_ = prompt;
}

std::optional<arm_status_t> People::wait_until(const std::function<bool(const arm_status_t&)>& state, double limit_s) {
  for (const double until_s = rig::host_now_s() + limit_s; !ending_ && rig::host_now_s() < until_s; pause(0.005)) {
    const std::lock_guard lock(mutex_);
    if (state(status_)) return status_;
  }
  return std::nullopt;
}

// What the arm measured after this time.
std::optional<arm_status_t> People::heard_after(double host_s) {
  return wait_until([=](const auto& status) { return 1e-6 * static_cast<double>(status.utime) > host_s; }, kHeard_s);
}

void People::violate(const std::string& what) {
  const std::lock_guard lock(mutex_);
  violations_.push_back(what);
}

std::vector<std::string> People::violations() const {
  const std::lock_guard lock(mutex_);
  return violations_;
}

void People::act(FaultKind kind, bool in_motion, std::function<void()> done) {
  acts_.emplace_back([this, kind, in_motion, done = std::move(done)] {
    try {
      const bool needs_holder = kind == FaultKind::stolen_script || kind == FaultKind::second_sender;
      if (in_motion || needs_holder)
        wait_until([](const auto& status) { return status.mode == arm_status_t::MODE_MOVING; }, kMotion_s);
      if (kind == FaultKind::operator_stop) stop_once();
      else if (kind == FaultKind::stop_in_flood) stop_in_flood();
      else if (kind == FaultKind::second_sender) second_sender();
      else if (kind == FaultKind::stolen_script) steal_script();
      else if (!use_console()) return;
      done();
    } catch (const std::exception& error) {
      spdlog::info("{}: {}", to_text(kind), error.what());  // the daemon is away just now: not done, not counted
    }
  });
}

// As a person would: again and again, until it is acknowledged.
void People::stop_once() {
  for (;;) {
    const double sent_s = rig::host_now_s();
    try {
      arm::stop_arm(configuration_, "an operator of the soak");
      return audit_.operator_stopped(sent_s);
    } catch (const std::exception&) {
      if (ending_) throw;
      pause(0.1);
    }
  }
}

// A stop, and behind it on the same connection more than anybody's queue holds; and as much on the bus.
void People::stop_in_flood() {
  const wire::Socket mad = wire::connect_unix(arm::control_socket(configuration_));
  arm_control_t message{};
  message.action = arm_control_t::STOP;
  message.reason = "an operator, in a flood";
  const double sent_s = rig::host_now_s();
  mad.send(arm::encode_frame(arm::FrameKind::control, message));
  audit_.operator_stopped(sent_s);
  try {
    for (int i = 0; i < kFlood && !ending_; ++i) {
      message.action = i % 2 == 0 ? arm_control_t::ARM : arm_control_t::DISARM;
      message.sequence = i;
      message.utime = rig::host_now_us();
      mad.send(arm::encode_frame(arm::FrameKind::control, message));
    }
  } catch (const wire::Disconnected&) {
    // It reads none of its answers, so the daemon hangs up on it.
  }
  const std::vector<uint8_t> junk(100, 7);
  for (int i = 0; i < kBusFlood && !ending_; ++i) bus_.publish_bytes(rig::channel("arm", rig::kCommand), junk);
}

void People::second_sender() {
  arm::ControlClient second(arm::control_socket(configuration_));
  arm_command_t command{};
  command.lease_s = 0.1;
  command.action = arm_command_t::FOLLOW;
  for (int i = 0; i < 50 && !ending_; ++i) {
    command.trajectory_id = i % 3;
    second.command(command);
    try {
      second.disarm("a second sender");
      violate("a second sender disarmed the arm");
    } catch (const arm::ControlRefused&) {}
    try {
      second.arm("a second sender");
      const double armed_s = rig::host_now_s();
      if (!heard_after(armed_s)) return;
      // Legitimate only where nobody held it just before.
      const std::lock_guard lock(mutex_);
      if (armed_s - not_armed_s_ > kHeldBefore_s)
        violations_.push_back("a second sender was armed while another held the arm");
      return;  // its connection ends, and with it the hold
    } catch (const arm::ControlRefused&) {}
    pause(0.01);
  }
}

// Reads what a robot's script would be told to do.
void People::steal_script() {
  if (!wait_until([](const auto& status) { return status.armed != 0; }, kMotion_s))
    throw std::runtime_error("the arm was never armed");
  const int port = arm::read_configuration(configuration_.section("arm")).controller.script_port;
  const wire::Socket stranger = wire::connect_tcp("127.0.0.1", port, 1);
  std::array<std::uint8_t, 256> bytes;
  try {
    for (const double until_s = rig::host_now_s() + kStranger_s; !ending_ && rig::host_now_s() < until_s;)
      if (stranger.readable(0.1) && stranger.receive(bytes) > 0)
        return violate("a stranger at the script port was sent set-points");
  } catch (const wire::Disconnected&) {
    // turned away
  }
}

// A console arms the arm, or stops it where somebody else holds it, and is killed. Another may hold the arm soon after.
bool People::use_console() {
  const auto console = console_at(console_log_);
  if (!console) return false;
  const int armed = post(*console, "/api/arm", 15);
  if (armed == 0) return false;
  const double sent_s = rig::host_now_s();
  if (armed != 200 && post(*console, "/api/stop", 5) == 200) audit_.operator_stopped(sent_s);
  const auto held = armed == 200 ? heard_after(rig::host_now_s()) : std::nullopt;
  kill_console_();
  if (!held || !held->armed) return armed != 200;
  const auto after = heard_after(rig::host_now_s() + kLetGo_s);
  if (after && after->holder == held->holder)
    violate("the arm was still armed a second after the console that held it was killed");
  return after.has_value();
}

void People::look() {
  std::optional<int64_t> stop_number;
  std::optional<int64_t> prompt_id;
  {
    const std::lock_guard lock(mutex_);
    const double now_s = rig::host_now_s();
    if (latched_since_s_ < 0 || now_s - tried_s_ < 1 || now_s - latched_since_s_ < hold_s_) return;
    tried_s_ = now_s;
    stop_number = status_.stop_number;
    if (prompt_.step == "reset_stop" && now_s - 1e-6 * static_cast<double>(prompt_.utime) < 1)
      prompt_id = prompt_.prompt_id;
  }
  audit_.operator_reset(rig::host_now_s());
  ++resets_;
  try {
    if (prompt_id) {
      selvedge_rig::operator_answer_t answer{};
      answer.utime = rig::host_now_us();
      answer.prompt_id = *prompt_id;
      answer.answer = "reset";
      bus_.publish(rig::kOperatorAnswer, answer);
    } else {
      arm::ControlClient(arm::control_socket(configuration_)).reset(*stop_number, "an operator of the soak");
    }
  } catch (const std::exception& error) {
    spdlog::info("reset: {}", error.what());  // it is tried again
  }
}

}  // namespace selvedge::cli
