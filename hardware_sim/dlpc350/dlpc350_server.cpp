#include "hardware_sim/dlpc350/dlpc350_server.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "rig/clock.h"

namespace selvedge::hardware_sim {

namespace {

void sleep_until(double host_time_s) {
  const double left_s = host_time_s - rig::host_now_s();
  if (left_s > 0) std::this_thread::sleep_for(std::chrono::duration<double>(left_s));
}

}  // namespace

Dlpc350Server::Dlpc350Server(const std::filesystem::path& socket_path, const Dlpc350Options& options,
                             std::function<void(const TriggerEdge&)> on_trigger)
    : device_(options), path_(socket_path), listener_(wire::listen_seqpacket(socket_path)),
      on_trigger_(std::move(on_trigger)), server_([this] { serve(); }) {
  if (on_trigger_) trigger_ = std::thread([this] { drive_trigger(); });
}

Dlpc350Server::~Dlpc350Server() {
  stopping_ = true;
  server_.join();
  if (trigger_.joinable()) trigger_.join();
  std::error_code ignored;
  std::filesystem::remove(path_, ignored);
}

void Dlpc350Server::hang(double seconds) { hangs_until_s_ = rig::host_now_s() + seconds; }

// One client at a time, as with a claimed USB interface; the next one waits in the queue.
void Dlpc350Server::serve() {
  wire::Socket client;
  while (!stopping_) {
    if (disconnect_.exchange(false)) client.close();
    try {
      if (!client.is_open()) {
        if (auto next = wire::accept(listener_, 0.02)) client = std::move(*next);
        continue;
      }
      if (!client.readable(0.02)) continue;
      projector::Report report{};
      const size_t got = client.receive(report);
      if (rig::host_now_s() < hangs_until_s_ || got != projector::report_bytes) continue;
      for (const auto& reply : device_.on_report(report, rig::host_now_s())) client.send(reply);
    } catch (const wire::Disconnected&) { client.close(); }
  }
}

void Dlpc350Server::drive_trigger() {
  double last_rise_s = -1;
  while (!stopping_) {
    const auto sequence = device_.running();
    // The next picture whose rising edge is still to come; a late thread skips none of them.
    double number = 0;
    if (sequence) {
      const double first_s = sequence->start_s + sequence->trigger_delay_s;
      if (last_rise_s >= first_s - 1e-9) number = std::round((last_rise_s - first_s) / sequence->period_s) + 1;
    }
    const bool over = sequence && !sequence->repeat && number >= static_cast<double>(sequence->pictures.size());
    if (!sequence || over) {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
      continue;
    }
    const double rise_s = sequence->start_s + sequence->trigger_delay_s + number * sequence->period_s;
    sleep_until(rise_s);
    const auto still = device_.running();
    if (!still || still->start_s != sequence->start_s) continue;
    on_trigger_({rise_s, true});
    last_rise_s = rise_s;
    // With exposure equal to period the line falls just before it rises again.
    const double fall_s = rise_s + std::min(sequence->exposure_s, sequence->period_s - 20e-6);
    sleep_until(fall_s);
    on_trigger_({fall_s, false});
  }
}

}  // namespace selvedge::hardware_sim
