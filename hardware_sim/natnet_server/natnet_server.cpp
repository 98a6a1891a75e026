#include "hardware_sim/natnet_server/natnet_server.h"

#include <poll.h>
#include <sys/prctl.h>

#include <algorithm>
#include <atomic>
#include <deque>
#include <mutex>
#include <thread>

#include "hardware_sim/natnet_server/natnet_messages.h"
#include "rig/clock.h"
#include "rig/wire/bytes.h"
#include "rig/wire/socket.h"

namespace selvedge::hardware_sim {

namespace {

constexpr double kClientForgotten_s = 5;

struct Client {
  std::uint32_t address;
  std::uint16_t port;
  double heard_s;
};

struct Leaving {
  double due_s, taken_s;
  std::int32_t number;
  std::vector<NamedPoint> seen;
};

}  // namespace

class NatnetServer::Loop {
 public:
  Loop(const NatnetServerOptions& options, std::function<std::vector<NamedPoint>(double)> markers_at)
      : options_(options), markers_at_(std::move(markers_at)),
        mocap_(options), bitstream_{options.major, options.minor},
        socket_(wire::bind_udp(options.address, options.port)), start_s_(rig::host_now_s()),
        thread_([this] { run(); }) {}
  ~Loop() {
    stopping_ = true;
    thread_.join();
  }

  int port() const { return wire::local_port(socket_); }
  MocapCounts counts() const {
    const std::lock_guard lock(mutex_);
    return counts_;
  }
  std::atomic<double> silent_until_s = 0;

 private:
  void run() {
    ::prctl(PR_SET_TIMERSLACK, 1);  // ns; a system that states its latency keeps to it
    while (!stopping_) {
      wait();
      while (socket_.readable(0)) answer(wire::receive_datagram(socket_));
      if (rig::host_now_s() < silent_until_s) clients_.clear();
      if (rig::host_now_s() >= sample_due_s()) take_sample();
      while (!leaving_.empty() && rig::host_now_s() >= leaving_.front().due_s) {
        send_frame(leaving_.front());
        leaving_.pop_front();
      }
      std::erase_if(clients_,
                    [](const Client& client) { return rig::host_now_s() - client.heard_s > kClientForgotten_s; });
    }
  }

  double sample_due_s() const { return start_s_ + next_sample_ / options_.rate_hz; }

  void wait() const {
    pollfd entry{socket_.descriptor(), POLLIN, 0};
    double until_s = sample_due_s();
    if (!leaving_.empty()) until_s = std::min(until_s, leaving_.front().due_s);
    const timespec limit{0, static_cast<long>(std::clamp(until_s - rig::host_now_s(), 0.0, 0.02) * 1e9)};
    ::ppoll(&entry, 1, &limit, nullptr);
  }

  std::uint64_t ticks(double host_s) const {
    const double own_s =
        (host_s - start_s_) * (1 + 1e-6 * options_.clock_drift_ppm) + start_s_ + options_.clock_offset_s;
    return static_cast<std::uint64_t>(own_s * options_.ticks_per_s);
  }

  // A request that makes no sense gets no answer.
  void answer(const wire::Datagram& datagram) {
    const double now_s = rig::host_now_s();
    if (now_s < silent_until_s) return;
    try {
      wire::LittleReader reader(datagram.bytes);
      const auto id = reader.number<std::uint16_t>();
      reader.number<std::uint16_t>();
      const auto reply = [&](std::vector<std::uint8_t> bytes) {
        wire::send_datagram(socket_, {std::move(bytes), datagram.address, datagram.port});
      };
      if (id == 0 || id == 10) remember(datagram, now_s);
      if (id == 0) reply(natnet::server_info(bitstream_, options_.ticks_per_s));
      if (id == 4) reply(natnet::model_definition(bitstream_, sets_));
      if (id == 12) {
        wire::LittleWriter echo;
        echo.number<std::uint64_t>(reader.number<std::uint64_t>()).number<std::uint64_t>(ticks(now_s));
        reply(natnet::message(13, echo.bytes()));
      }
      if (id == 2 && reader.text(std::min<size_t>(9, reader.left())) == "FrameRate")
        reply(natnet::message(3, wire::LittleWriter().number<float>(static_cast<float>(options_.rate_hz)).bytes()));
    } catch (const wire::WireError&) {}
  }

  void remember(const wire::Datagram& datagram, double now_s) {
    for (auto& client : clients_)
      if (client.address == datagram.address && client.port == datagram.port) {
        client.heard_s = now_s;
        return;
      }
    clients_.push_back({datagram.address, datagram.port, now_s});
  }

  void take_sample() {
    const double t = sample_due_s();
    const auto number = static_cast<std::int32_t>(++next_sample_);
    std::vector<NamedPoint> points = markers_at_(t);
    for (const auto& point : points)
      if (!point.name.empty()) declare(point);
    auto seen = mocap_.see(std::move(points), t);
    {
      const std::lock_guard lock(mutex_);
      counts_ = mocap_.counts();
    }
    if (seen) leaving_.push_back({mocap_.leaves_at_s(t), t, number, std::move(*seen)});
  }

  void declare(const NamedPoint& point) {
    auto set =
        std::find_if(sets_.begin(), sets_.end(), [&](const auto& entry) { return entry.first == point.subject; });
    if (set == sets_.end()) set = sets_.insert(sets_.end(), {point.subject, {}});
    if (std::find(set->second.begin(), set->second.end(), point.name) != set->second.end()) return;
    set->second.push_back(point.name);
    model_changed_ = true;
  }

  void send_frame(const Leaving& leaving) {
    const double sent_s = leaving.taken_s + options_.latency_s;  // jitter comes after the time stamp
    const auto bytes =
        natnet::frame(bitstream_, leaving.number, sets_, leaving.seen, options_.fill_hidden, model_changed_,
                      {ticks(leaving.taken_s), ticks(leaving.taken_s + 0.5 * options_.latency_s), ticks(sent_s)});
    model_changed_ = model_changed_ && clients_.empty();
    for (const auto& client : clients_) wire::send_datagram(socket_, {bytes, client.address, client.port});
  }

  const NatnetServerOptions options_;
  const std::function<std::vector<NamedPoint>(double)> markers_at_;
  SimulatedMocap mocap_;
  const natnet::Bitstream bitstream_;
  const wire::Socket socket_;
  const double start_s_;
  std::int64_t next_sample_ = 0;
  natnet::MarkerSets sets_;
  bool model_changed_ = false;
  std::vector<Client> clients_;
  std::deque<Leaving> leaving_;
  mutable std::mutex mutex_;
  MocapCounts counts_;
  std::atomic<bool> stopping_ = false;
  std::thread thread_;
};

NatnetServer::NatnetServer(const NatnetServerOptions& options,
                           std::function<std::vector<NamedPoint>(double)> markers_at)
    : loop_(std::make_unique<Loop>(options, std::move(markers_at))) {}
NatnetServer::~NatnetServer() = default;
int NatnetServer::port() const { return loop_->port(); }
MocapCounts NatnetServer::counts() const { return loop_->counts(); }
void NatnetServer::fall_silent(double seconds) { loop_->silent_until_s = rig::host_now_s() + seconds; }

}  // namespace selvedge::hardware_sim
