#include "hardware_sim/datastream_server/datastream_server.h"

#include <poll.h>
#include <sys/prctl.h>

#include <algorithm>
#include <array>
#include <deque>
#include <mutex>
#include <thread>

#include "hardware_sim/datastream_server/frame_packet.h"
#include "rig/clock.h"
#include "rig/wire/bytes.h"
#include "rig/wire/socket.h"

namespace selvedge::hardware_sim {
namespace {

struct Client {
  wire::Socket socket;
  std::vector<std::uint8_t> received;
  bool streaming = false;
  bool wants_one = false;
  int generation = -1;  // of the names it was told
};

// A frame on its way: it leaves the system at due_s.
struct Leaving {
  double due_s;
  datastream::Frame frame;
};

}  // namespace

class DatastreamServer::Loop {
 public:
  Loop(const DatastreamServerOptions& options, std::function<std::vector<NamedPoint>(double)> markers_at)
      : options_(options), markers_at_(std::move(markers_at)),
        listener_(wire::listen_tcp(options.address, options.port)), mocap_(options), start_s_(rig::host_now_s()),
        thread_([this] { run(); }) {}

  ~Loop() {
    stopping_ = true;
    thread_.join();
  }

  int port() const { return wire::local_port(listener_); }
  DatastreamServerCounts counts() const {
    const std::lock_guard lock(mutex_);
    return counts_;
  }
  void cut_connections() { cut_ = true; }
  void stall(double seconds) { stalled_until_s_ = rig::host_now_s() + seconds; }
  void hide(double seconds) { hidden_until_s_ = rig::host_now_s() + seconds; }

 private:
  void run() {
    ::prctl(PR_SET_TIMERSLACK, 1);  // ns; a system that states its latency keeps to it
    while (!stopping_) {
      wait();
      accept_clients();
      for (auto& client : clients_) serve(client);
      if (cut_.exchange(false)) cut_all();
      // One at a time: where looking takes longer than a period, frames come late, but they come.
      if (rig::host_now_s() >= start_s_ + next_sample_ / options_.rate_hz) take_sample();
      while (!leaving_.empty() &&
             rig::host_now_s() >= std::max<double>(leaving_.front().due_s, stalled_until_s_) - options_.awake_s) {
        while (rig::host_now_s() < leaving_.front().due_s) {}
        for (auto& client : clients_) send_frame(client, leaving_.front().frame);
        leaving_.pop_front();
      }
      std::erase_if(clients_, [](const Client& client) { return !client.socket.is_open(); });
    }
  }

  // Until a socket has something or the next sample or departure is due.
  void wait() const {
    std::vector<pollfd> entries{{listener_.descriptor(), POLLIN, 0}};
    for (const auto& client : clients_) entries.push_back({client.socket.descriptor(), POLLIN, 0});
    double until_s = start_s_ + next_sample_ / options_.rate_hz;
    if (!leaving_.empty())
      until_s = std::min(until_s, std::max<double>(leaving_.front().due_s, stalled_until_s_) - options_.awake_s);
    const double left_s = std::clamp(until_s - rig::host_now_s(), 0.0, 0.02);
    const timespec limit{0, static_cast<long>(left_s * 1e9)};
    ::ppoll(entries.data(), entries.size(), &limit, nullptr);
  }

  void accept_clients() {
    while (auto socket = wire::accept(listener_, 0)) {
      Client client;
      client.socket = std::move(*socket);
      guarded(client, [&] { client.socket.send(datastream::supported_packet(), 0.05); });
      clients_.push_back(std::move(client));
      count(&DatastreamServerCounts::clients);
    }
  }

  // Runs `action`; a client that is gone or talks nonsense loses its connection, nobody else's.
  template <class Action>
  void guarded(Client& client, Action&& action) {
    try {
      action();
    } catch (const std::exception&) {
      client.socket.close();
      count(&DatastreamServerCounts::disconnects);
    }
  }

  void serve(Client& client) {
    guarded(client, [&] {
      while (client.socket.is_open() && client.socket.readable(0)) {
        std::array<std::uint8_t, 4096> part;
        const size_t got = client.socket.receive(part);
        client.received.insert(client.received.end(), part.begin(), part.begin() + static_cast<long>(got));
        while (take_request(client)) {}
      }
    });
  }

  bool take_request(Client& client) {
    wire::LittleReader reader(client.received);
    if (reader.left() < 8) return false;
    const auto id = reader.number<std::uint32_t>(), length = reader.number<std::uint32_t>();
    if (id != 0x1a2b0001 || length > 65536) throw wire::WireError("not a request");
    if (reader.left() < length) return false;
    wire::LittleReader objects = reader.part(length);
    while (objects.left() > 0) {
      const auto object = objects.number<std::uint32_t>();
      wire::LittleReader body = objects.part(objects.number<std::uint32_t>());
      if (object == 100001) client.generation = -1;  // the wanted set changed: say the names again
      if (object == 100002) client.streaming = body.number<std::uint8_t>() != 0, client.wants_one = !client.streaming;
      if (object == 100008) client.wants_one = true;
      if (object == 42) client.socket.send(datastream::ping_packet(body.number<std::uint64_t>()), 0.05);
    }
    client.received.erase(client.received.begin(), client.received.begin() + static_cast<long>(8 + length));
    return true;
  }

  void take_sample() {
    const double t = start_s_ + next_sample_ / options_.rate_hz;
    const auto number = static_cast<std::uint32_t>(++next_sample_);
    std::vector<NamedPoint> points = markers_at_(t);
    for (const auto& point : points)
      if (!point.name.empty()) declared_.ids(point.subject, point.name);
    auto seen = mocap_.see(std::move(points), t);
    {
      const std::lock_guard lock(mutex_);
      static_cast<MocapCounts&>(counts_) = mocap_.counts();
    }
    if (!seen) return;
    if (t < hidden_until_s_) seen->clear();
    datastream::Frame frame;
    frame.number = number;
    frame.rate_hz = options_.rate_hz;
    frame.latency_s = options_.stated_latency_s < 0 ? options_.latency_s : options_.stated_latency_s;
    frame.seen = std::move(*seen);
    leaving_.push_back({mocap_.leaves_at_s(t), std::move(frame)});
  }

  void send_frame(Client& client, const datastream::Frame& frame) {
    if (!client.socket.is_open() || !(client.streaming || client.wants_one)) return;
    guarded(client, [&] {
      const bool with_static = client.generation != declared_.generation;
      client.socket.send(datastream::frame_packet(frame, declared_, with_static), 0.05);
      client.generation = declared_.generation;
      client.wants_one = false;
    });
  }

  void cut_all() {
    for (auto& client : clients_) {
      guarded(client, [&] {
        const auto packet = datastream::supported_packet();
        client.socket.send(std::span(packet).first(packet.size() / 2), 0.05);
      });
      client.socket.close();
      count(&DatastreamServerCounts::disconnects);
    }
  }

  void count(std::int64_t DatastreamServerCounts::*what) {
    const std::lock_guard lock(mutex_);
    ++(counts_.*what);
  }

  const DatastreamServerOptions options_;
  const std::function<std::vector<NamedPoint>(double)> markers_at_;
  const wire::Socket listener_;
  SimulatedMocap mocap_;
  const double start_s_;
  std::int64_t next_sample_ = 0;
  datastream::Declared declared_;
  std::deque<Leaving> leaving_;
  std::vector<Client> clients_;
  std::atomic<bool> stopping_ = false, cut_ = false;
  std::atomic<double> stalled_until_s_ = 0, hidden_until_s_ = 0;
  mutable std::mutex mutex_;
  DatastreamServerCounts counts_;
  std::thread thread_;
};

DatastreamServer::DatastreamServer(const DatastreamServerOptions& options,
                                   std::function<std::vector<NamedPoint>(double)> markers_at)
    : loop_(std::make_unique<Loop>(options, std::move(markers_at))) {}
DatastreamServer::~DatastreamServer() = default;
int DatastreamServer::port() const { return loop_->port(); }
DatastreamServerCounts DatastreamServer::counts() const { return loop_->counts(); }
void DatastreamServer::cut_connections() { loop_->cut_connections(); }
void DatastreamServer::stall(double seconds) { loop_->stall(seconds); }
void DatastreamServer::hide(double seconds) { loop_->hide(seconds); }

}  // namespace selvedge::hardware_sim
