// Universal Robots: state over RTDE, motion through the script of the maker's external control.
//
// The script runs on the robot and connects to script_port here; each cycle it reads one set-point and calls
// servoj with it. Where the packets stop for longer than the time-out that each of them carries, the script
// ends and the robot stops: a dead daemon stops the arm.
// The script is taken from `host` alone. One connection at a time: another while the first lives is turned away and
// told as an intruder. That a script has ended is told before the next is taken. A script whose robot went without a
// word is given up after a second, so that it may come again.
#include <array>
#include <cmath>

#include "rig/arm/arm.h"
#include "rig/arm/backends/rtde_packages.h"
#include "rig/clock.h"
#include "rig/wire/socket.h"

namespace selvedge::arm {

namespace {

constexpr int kRtdePort = 30004;
constexpr std::int32_t kRunning = 7, kSafetyNormal = 1;
constexpr double kPatience_s = 1;  // for a script that acknowledges nothing
constexpr int kAtOnce = 16;        // connections, and parts of what the script says, that a cycle looks at

class Rtde final : public Arm {
 public:
  explicit Rtde(const ArmOptions& options)
      : options_(options), robot_address_(wire::address_of(options.host)),
        listener_(wire::listen_tcp(script_address(options), options.script_port)),
        state_(
            wire::connect_tcp(options.host, options.port == 0 ? kRtdePort : options.port, options.connect_timeout_s)),
        clock_({.ticks_per_s = 1e6}) {
    negotiate();
  }

  std::optional<ArmSample> cycle(const std::optional<Eigen::VectorXd>& set_point_rad, double timeout_s) override {
    accept_script();
    send_set_point(set_point_rad);
    const double end_s = rig::host_now_s() + timeout_s;
    // Where we are late, the newest state counts; but a controller that never pauses does not hold the cycle up.
    std::optional<rtde::State> newest;
    while (const auto package = next_package(newest ? 0 : end_s - rig::host_now_s())) {
      if (package->type == rtde::data) newest = rtde::decode_state(package->payload, recipe_);
      if (rig::host_now_s() > end_s) break;
    }
    if (!newest) return std::nullopt;
    return to_sample(*newest);
  }

  double period_s() const override { return 1 / options_.rate_hz; }

 private:
  void negotiate() {
    wire::BigWriter protocol, outputs, none;
    protocol.number<std::uint16_t>(2);
    if (ask(rtde::negotiate, protocol).payload != std::vector<std::uint8_t>{1})
      throw wire::WireError("rtde: the controller does not speak protocol version 2");
    outputs.number<double>(options_.rate_hz).text(rtde::output_names);
    const auto recipe = ask(rtde::setup_outputs, outputs);
    wire::BigReader reader(recipe.payload);
    recipe_ = reader.number<std::uint8_t>();
    const std::string types = reader.text(reader.left());
    if (types != rtde::output_types)
      throw wire::WireError(
          fmt::format("rtde: {} are offered as {}, expected {}", rtde::output_names, types, rtde::output_types));
    if (ask(rtde::start, none).payload != std::vector<std::uint8_t>{1})
      throw wire::WireError("rtde: the controller refuses to start");
  }

  // The answer to a request has the request's type; messages may come in between.
  rtde::Package ask(char type, const wire::BigWriter& payload) {
    state_.send(rtde::encode(type, payload));
    const double end_s = rig::host_now_s() + options_.connect_timeout_s;
    while (auto package = next_package(end_s - rig::host_now_s()))
      if (package->type == type) return *package;
    throw wire::Disconnected(fmt::format("rtde: no answer to '{}' within {} s", type, options_.connect_timeout_s));
  }

  std::optional<rtde::Package> next_package(double timeout_s) {
    const double end_s = rig::host_now_s() + timeout_s;
    for (;;) {
      if (auto package = rtde::take_package(received_)) return package;
      if (!state_.readable(std::max(0.0, end_s - rig::host_now_s()))) return std::nullopt;
      std::array<std::uint8_t, 4096> part;
      const size_t got = state_.receive(part);
      arrival_us_ = rig::host_now_us();
      received_.insert(received_.end(), part.begin(), part.begin() + static_cast<long>(got));
    }
  }

  static std::string script_address(const ArmOptions& options) {
    if (!options.script_address.empty()) return options.script_address;
    return wire::local_address(wire::connect_udp(options.host, kRtdePort));
  }

  void accept_script() {
    // First what the script we have says: where it has ended, another may follow it.
    try {
      std::array<std::uint8_t, 256> ignored;
      for (int i = 0; i < kAtOnce && script_.is_open() && script_.readable(0); ++i) script_.receive(ignored);
    } catch (const wire::Disconnected&) { end_script(); }
    if (script_ended_) return;
    for (int i = 0; i < kAtOnce; ++i) {
      auto next = wire::accept(listener_, 0);
      if (!next) return;
      const std::string from = wire::peer_address(*next);
      if (from != robot_address_) {
        intruder_ = fmt::format("{} connected to the script port, which is for {} alone", from, robot_address_);
      } else if (script_.is_open()) {
        intruder_ = "a second connection to the script port while the robot's script is connected";
      } else {
        script_ = std::move(*next);
        wire::set_patience(script_, kPatience_s);
      }
    }
  }

  void send_set_point(const std::optional<Eigen::VectorXd>& set_point_rad) {
    if (!script_.is_open()) return;
    try {
      script_.send(rtde::encode_set_point(set_point_rad ? set_point_rad->data() : nullptr, set_point_rad.has_value(),
                                          options_.controller_timeout_s),
                   0.02);
    } catch (const wire::Disconnected&) { end_script(); }
  }

  // Another may follow it once that has been told: what it was sent to do, the next must not go on with.
  void end_script() {
    script_.close();
    script_ended_ = true;
  }

  ArmSample to_sample(const rtde::State& state) {
    const auto ticks = static_cast<std::int64_t>(std::llround(state.timestamp_s * 1e6));
    clock_.add(ticks, arrival_us_);
    ArmSample sample;
    sample.time_s = clock_.map() ? clock_.map()->host_s(ticks) : 1e-6 * static_cast<double>(arrival_us_);
    sample.q_rad = Eigen::Map<const Eigen::VectorXd>(state.q_rad, 6);
    sample.qd_rad_s = Eigen::Map<const Eigen::VectorXd>(state.qd_rad_s, 6);
    sample.protective_stop = state.safety_mode != kSafetyNormal;
    if (sample.protective_stop) sample.not_ready = fmt::format("the robot's safety mode is {}", state.safety_mode);
    else if (state.robot_mode != kRunning)
      sample.not_ready = fmt::format("the robot's mode is {}, not running", state.robot_mode);
    else if (!script_.is_open()) sample.not_ready = "the robot's external control script is not connected";
    sample.ready = sample.not_ready.empty();
    sample.intruder = std::exchange(intruder_, "");
    script_ended_ = false;
    return sample;
  }

  ArmOptions options_;
  const std::string robot_address_;
  wire::Socket listener_, state_, script_;
  std::string intruder_;
  bool script_ended_ = false;  // and no sample has told of it yet
  std::vector<std::uint8_t> received_;
  std::int64_t arrival_us_ = 0;
  std::uint8_t recipe_ = 0;
  rig::PassiveClock clock_;
};

}  // namespace

std::unique_ptr<Arm> connect_rtde(const ArmOptions& options) {
  if (options.joints != 6) throw std::invalid_argument("rtde: a Universal Robots arm has 6 joints");
  return std::make_unique<Rtde>(options);
}

}  // namespace selvedge::arm
