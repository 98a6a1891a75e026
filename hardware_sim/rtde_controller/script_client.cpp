#include "hardware_sim/rtde_controller/script_client.h"

#include <algorithm>
#include <array>

#include "rig/wire/bytes.h"

namespace selvedge::hardware_sim {

namespace {
constexpr size_t kPacket = 8 * 4;
constexpr std::int32_t kServoJ = 1;
constexpr double kExtrapolated_s = 0.02;  // beyond that the script keeps the last target
}  // namespace

void ScriptClient::stop() {
  socket_.close();
  received_.clear();
  last_.reset();
  before_.reset();
}

void ScriptClient::connect(double now_s) {
  if (now_s < next_try_s_) return;
  next_try_s_ = now_s + reconnect_s_;
  try {
    socket_ = wire::connect_tcp(host_, port_, 0.05);
    packet_s_ = now_s;
    timeout_s_ = 1;  // until the first packet says otherwise
  } catch (const wire::Disconnected&) {
    // Nobody listens yet.
  }
}

void ScriptClient::read(double now_s, int joints) {
  while (socket_.readable(0)) {
    std::array<std::uint8_t, 4096> part;
    const size_t got = socket_.receive(part);
    received_.insert(received_.end(), part.begin(), part.begin() + static_cast<long>(got));
  }
  while (received_.size() >= kPacket) {
    wire::BigReader reader{std::span<const std::uint8_t>(received_).first(kPacket)};
    timeout_s_ = 1e-3 * reader.number<std::int32_t>();
    Target target{now_s, Eigen::VectorXd::Zero(joints)};
    for (int joint = 0; joint < 6; ++joint) {
      const double angle = 1e-6 * reader.number<std::int32_t>();
      if (joint < joints) target.q_rad[joint] = angle;
    }
    packet_s_ = now_s;
    if (reader.number<std::int32_t>() == kServoJ) {
      before_ = last_;
      last_ = std::move(target);
      ++set_points_;
    } else {
      last_.reset();
      before_.reset();
    }
    received_.erase(received_.begin(), received_.begin() + kPacket);
  }
}

std::optional<Eigen::VectorXd> ScriptClient::servo_target(double now_s, int joints) {
  try {
    if (!socket_.is_open()) connect(now_s);
    if (socket_.is_open()) read(now_s, joints);
  } catch (const wire::Disconnected&) { stop(); }
  if (!socket_.is_open()) return std::nullopt;
  if (timeout_s_ > 0 && now_s - packet_s_ > timeout_s_) {
    ++timed_out_;
    stop();
    return std::nullopt;
  }
  if (!last_) return std::nullopt;
  if (!before_ || last_->time_s - before_->time_s < 1e-3) return last_->q_rad;
  const double ahead_s = std::min(now_s - last_->time_s, kExtrapolated_s);
  return last_->q_rad + (last_->q_rad - before_->q_rad) * (ahead_s / (last_->time_s - before_->time_s));
}

}  // namespace selvedge::hardware_sim
