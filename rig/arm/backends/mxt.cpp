// Mitsubishi MELFA real-time external control over UDP: one packet of 196 bytes each way a cycle.
//
// The robot's program has run `Mxt`. The first packets only watch (command 0); set-points are absolute joint
// angles (command 1), and once there was one, one follows every cycle. The reply brings the filtered joints in
// dat1 and the encoders in dat2.
// A daemon that dies must stop the arm, so the controller's own time-out is tried at connecting: it is told once to
// stay where it is commanded to be, hears nothing for controller_timeout_s, and must have given up by then. Its program
// is then started again by whoever started it, or starts itself again; until it answers anew nothing arms. A controller
// that still answers is refused.
// Source: tork-a/melfa_robot (Apache-2.0), strdef.h.
#include <cmath>
#include <thread>

#include <spdlog/spdlog.h>

#include "rig/arm/arm.h"
#include "rig/arm/backends/mxt_packet.h"
#include "rig/clock.h"
#include "rig/wire/bytes.h"
#include "rig/wire/socket.h"

namespace selvedge::arm {

namespace {

constexpr int kMxtPort = 10000;
constexpr double kPeriod_s = 0.0071;
constexpr double kMxtSilence_s = 0.5;
constexpr std::uint32_t kLate_cycles = 4;  // a reply may be so late
constexpr double kGrace_cycles = 3;        // of the controller, beyond its time-out
constexpr double kProgram_s = 60;          // for its program to be started again

class Mxt final : public Arm {
 public:
  explicit Mxt(const ArmOptions& options)
      : options_(options), socket_(wire::connect_udp(options.host, options.port == 0 ? kMxtPort : options.port)) {
    await_reply(options.connect_timeout_s);
    require_time_out();
  }
  ~Mxt() override {
    try {
      socket_.send(mxt::encode({.command = mxt::end, .count = ++count_}));
    } catch (const wire::Disconnected&) {
      // Nobody there to say goodbye to.
    }
  }

  std::optional<ArmSample> cycle(const std::optional<Eigen::VectorXd>& set_point_rad, double timeout_s) override {
    keep_beat();
    mxt::Request request;
    request.count = ++count_;
    if (set_point_rad) {
      request.command = mxt::move;
      for (long joint = 0; joint < set_point_rad->size(); ++joint)
        request.joint_rad[joint] = static_cast<float>((*set_point_rad)[joint]);
    }
    const double sent_s = rig::host_now_s();
    socket_.send(mxt::encode(request));
    const double end_s = sent_s + timeout_s;
    while (socket_.readable(std::max(0.0, end_s - rig::host_now_s()))) {
      std::array<std::uint8_t, 2048> bytes;
      const size_t got = socket_.receive(bytes);
      const auto reply = mxt::decode(std::span(bytes).first(got), options_.joints);
      if (count_ - reply.count > kLate_cycles) {
        if (rig::host_now_s() > end_s) break;  // old ones without end do not hold the cycle up
        continue;
      }
      answered_s_ = rig::host_now_s();
      commanded_rad_ = reply.command_rad;
      return to_sample(reply, reply.count == count_ ? 0.5 * (sent_s + answered_s_) : answered_s_);
    }
    if (answered_s_ > 0 && rig::host_now_s() - answered_s_ > kMxtSilence_s)
      throw wire::Disconnected("mxt: the controller stopped answering (alarm, or its program ended)");
    return std::nullopt;
  }

  double period_s() const override { return kPeriod_s; }

 private:
  void await_reply(double limit_s) {
    for (const double end_s = rig::host_now_s() + limit_s; !cycle(std::nullopt, 0.1);)
      if (rig::host_now_s() > end_s)
        throw wire::Disconnected(fmt::format("mxt: {} does not answer within {} s", options_.host, limit_s));
  }

  // Throws WireError where the controller does not give up by itself.
  void require_time_out() {
    cycle(commanded_rad_, 0.1);
    std::this_thread::sleep_for(
        std::chrono::duration<double>(options_.controller_timeout_s + kGrace_cycles * kPeriod_s));
    answered_s_ = 0;
    last_.reset();
    if (cycle(std::nullopt, 0.1))
      throw wire::WireError(fmt::format(
          "mxt: {} still answers after {} s without a packet: nothing would stop the arm if this "
          "daemon died. Set the controller's time-out (MXTTOUT, in cycles of 7.1 ms) to at most {}",
          options_.host, options_.controller_timeout_s, std::floor(options_.controller_timeout_s / kPeriod_s)));
    spdlog::info("mxt: {} gives up within {} s of silence; waiting for its program to be started again", options_.host,
                 options_.controller_timeout_s);
    await_reply(kProgram_s);
  }

  void keep_beat() {
    const double now_s = rig::host_now_s();
    next_s_ = std::max(next_s_ + kPeriod_s, now_s - kPeriod_s);
    if (next_s_ > now_s) std::this_thread::sleep_for(std::chrono::duration<double>(next_s_ - now_s));
  }

  ArmSample to_sample(const mxt::Reply& reply, double time_s) {
    ArmSample sample;
    sample.time_s = time_s;
    sample.q_rad = reply.encoder_rad;
    sample.qd_rad_s = Eigen::VectorXd::Zero(reply.encoder_rad.size());
    if (last_) sample.qd_rad_s = (sample.q_rad - last_->q_rad) / std::max(1e-4, time_s - last_->time_s);
    sample.ready = true;
    last_ = sample;
    return sample;
  }

  ArmOptions options_;
  wire::Socket socket_;
  std::uint32_t count_ = 0;
  double next_s_ = 0, answered_s_ = 0;
  std::optional<ArmSample> last_;
  std::optional<Eigen::VectorXd> commanded_rad_;
};

}  // namespace

std::unique_ptr<Arm> connect_mxt(const ArmOptions& options) {
  if (options.joints < 1 || options.joints > 8) throw std::invalid_argument("mxt: 1 to 8 joints");
  return std::make_unique<Mxt>(options);
}

}  // namespace selvedge::arm
