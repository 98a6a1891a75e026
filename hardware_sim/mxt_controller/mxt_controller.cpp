#include "hardware_sim/mxt_controller/mxt_controller.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <random>
#include <thread>
#include <vector>

#include "hardware_sim/simulated_joints/simulated_joints.h"
#include "rig/clock.h"
#include "rig/wire/bytes.h"
#include "rig/wire/socket.h"

namespace selvedge::hardware_sim {

namespace {
constexpr size_t kPacket = 196, kTypesAt[] = {64, 108, 152};
constexpr double kSpeedFactor = 1.5, kCycle_s = 0.0071;
constexpr std::uint16_t kMove = 1, kEnd = 255, kJoint = 2;

void put(std::vector<std::uint8_t>& packet, size_t at, const std::vector<std::uint8_t>& bytes) {
  std::copy(bytes.begin(), bytes.end(), packet.begin() + static_cast<long>(at));
}
}  // namespace

class MxtController::Loop {
 public:
  Loop(const MxtControllerOptions& options, const arm::ArmModel& model)
      : joints(model, options.lag_s, rig::host_now_s()), options_(options), model_(model),
        socket_(wire::bind_udp(options.address, options.port)), random_(options.seed), filtered_rad_(model.home_rad()),
        thread_([this] { run(); }) {}
  ~Loop() {
    stopping_ = true;
    thread_.join();
  }

  int port() const { return wire::local_port(socket_); }

  SimulatedJoints joints;
  std::atomic<bool> alarm = false, restart = false;
  std::atomic<std::int64_t> set_points = 0;

 private:
  void run() {
    while (!stopping_) {
      const bool packet_waits = socket_.readable(0.002);
      const double now_s = rig::host_now_s();
      if (restart.exchange(false) || (silent_ && now_s - packet_s_ > options_.silence_s + options_.restart_s)) {
        alarm = false;
        ended_ = false;
        silent_ = false;
        command_rad_.reset();
      }
      // Silence while under command: the controller brakes and raises an alarm.
      if (command_rad_ && now_s - packet_s_ > options_.silence_s) alarm = silent_ = true;
      if (alarm || ended_) command_rad_.reset();
      joints.advance(command_rad_, now_s);
      if (packet_waits) answer(wire::receive_datagram(socket_), now_s);
    }
  }

  void answer(wire::Datagram datagram, double now_s) {
    if (datagram.bytes.size() != kPacket || alarm || ended_) return;
    wire::LittleReader reader(datagram.bytes);
    const auto command = reader.number<std::uint16_t>(), send_type = reader.number<std::uint16_t>();
    if (command == kEnd) {
      ended_ = true;
      return;
    }
    if (command == kMove && send_type == kJoint) {
      reader.take(4);
      if (!obey(reader)) {
        alarm = true;
        return;
      }
    }
    packet_s_ = now_s;
    fill_reply(datagram.bytes, now_s);
    wire::send_datagram(socket_, datagram);
  }

  bool obey(wire::LittleReader& reader) {
    Eigen::VectorXd wanted(model_.joints());
    for (long joint = 0; joint < wanted.size(); ++joint) wanted[joint] = static_cast<double>(reader.number<float>());
    const Eigen::VectorXd before = command_rad_ ? *command_rad_ : joints.joints_at(rig::host_now_s());
    for (int joint = 0; joint < model_.joints(); ++joint) {
      const arm::JointLimits& limit = model_.limits()[static_cast<size_t>(joint)];
      const bool in_range = wanted[joint] >= limit.lower_rad && wanted[joint] <= limit.upper_rad;
      // A packet may be late by two cycles; the step it brings is then as long.
      if (!in_range || std::abs(wanted[joint] - before[joint]) > kSpeedFactor * limit.speed_rad_s * 3 * kCycle_s)
        return false;
    }
    command_rad_ = wanted;
    ++set_points;
    return true;
  }

  void fill_reply(std::vector<std::uint8_t>& packet, double now_s) {
    const Eigen::VectorXd q = joints.joints_at(now_s);
    const Eigen::VectorXd commanded = command_rad_ ? *command_rad_ : q;
    filtered_rad_ += 0.3 * (commanded - filtered_rad_);
    put(packet, 8, data(wire::LittleReader(packet).text(6).substr(4), commanded, q));
    for (const size_t at : kTypesAt) {
      const std::string type(packet.begin() + static_cast<long>(at), packet.begin() + static_cast<long>(at) + 2);
      put(packet, at + 4, data(type, commanded, q));
    }
  }

  // The 40 bytes of the type asked for: 2 command joints, 5 filtered, 8 encoder; the rest is zero.
  std::vector<std::uint8_t> data(const std::string& type, const Eigen::VectorXd& commanded, const Eigen::VectorXd& q) {
    std::normal_distribution<double> noise(0, options_.encoder_noise_rad);
    wire::LittleWriter out;
    for (int joint = 0; joint < 8; ++joint) {
      double value = 0;
      if (joint < model_.joints()) {
        if (type[0] == 2) value = commanded[joint];
        if (type[0] == 5) value = filtered_rad_[joint];
        if (type[0] == 8) value = q[joint] + noise(random_);
      }
      out.number<float>(static_cast<float>(value));
    }
    out.number<std::uint64_t>(0);
    return out.bytes();
  }

  const MxtControllerOptions options_;
  const arm::ArmModel model_;
  const wire::Socket socket_;
  std::mt19937 random_;
  Eigen::VectorXd filtered_rad_;
  std::optional<Eigen::VectorXd> command_rad_;
  double packet_s_ = 0;
  bool ended_ = false, silent_ = false;
  std::atomic<bool> stopping_ = false;
  std::thread thread_;
};

MxtController::MxtController(const MxtControllerOptions& options, const arm::ArmModel& model)
    : loop_(std::make_unique<Loop>(options, model)) {}
MxtController::~MxtController() = default;
int MxtController::port() const { return loop_->port(); }
Eigen::VectorXd MxtController::joints_at(double host_time_s) const { return loop_->joints.joints_at(host_time_s); }
Eigen::Vector3d MxtController::tool_at(double host_time_s) const { return loop_->joints.tool_at(host_time_s); }
double MxtController::fastest_since(double host_time_s) const { return loop_->joints.fastest_since(host_time_s); }
std::int64_t MxtController::set_points() const { return loop_->set_points; }
bool MxtController::alarm() const { return loop_->alarm; }
void MxtController::raise_alarm() { loop_->alarm = true; }
void MxtController::restart_program() { loop_->restart = true; }
void MxtController::block_joint(int joint, bool blocked) { loop_->joints.block(joint, blocked); }

}  // namespace selvedge::hardware_sim
