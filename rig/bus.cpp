#include "rig/bus.h"

#include <exception>
#include <stdexcept>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "files/bad_input.h"
#include "rig/network.h"

namespace selvedge::rig {

namespace {

std::string lcm_url(const BusConfiguration& configuration) {
  if (!configuration.log_file.empty()) return "file://" + configuration.log_file + "?speed=0";
  return fmt::format("udpm://239.255.76.67:{}?ttl=0&recv_buf_size={}", configuration.port,
                     configuration.receive_buffer_bytes);
}

void check_network(const BusConfiguration& configuration) {
  if (!multicast_works(static_cast<uint16_t>(configuration.port))) refuse("bus", "{}", multicast_advice());
  const int granted = granted_receive_buffer_bytes(configuration.receive_buffer_bytes);
  if (granted < configuration.receive_buffer_bytes)
    spdlog::warn("bus: the kernel grants {} of {} bytes of receive buffer, messages may be lost under load; mend with "
                 "sudo sysctl -w net.core.rmem_max={}",
                 granted, configuration.receive_buffer_bytes, configuration.receive_buffer_bytes);
}

}  // namespace

Bus::Bus(const BusConfiguration& configuration) {
  if (configuration.log_file.empty()) check_network(configuration);
  const std::string url = lcm_url(configuration);
  lcm_ = lcm_create(url.c_str());
  if (lcm_ == nullptr) refuse("bus", "LCM cannot open {}", url);
}

Bus::~Bus() {
  stopping_ = true;
  if (thread_.joinable()) thread_.join();
  lcm_destroy(lcm_);
}

void Bus::start() {
  thread_ = std::thread([this] {
    while (!stopping_ && handle(0.05)) {}
  });
}

bool Bus::handle(double timeout_s) {
  return lcm_handle_timeout(lcm_, static_cast<int>(timeout_s * 1e3)) >= 0;
}

ChannelCount Bus::count(const std::string& channel) const {
  const std::lock_guard lock(mutex_);
  ChannelCount sum;
  for (const auto& subscription : subscriptions_) {
    if (subscription->channel != channel) continue;
    sum.received += subscription->count.received;
    sum.lost += subscription->count.lost;
    sum.undecodable += subscription->count.undecodable;
    sum.failed += subscription->count.failed;
  }
  return sum;
}

void Bus::publish_bytes(const std::string& channel, const std::vector<uint8_t>& bytes) {
  if (lcm_publish(lcm_, channel.c_str(), bytes.data(), static_cast<unsigned>(bytes.size())) != 0)
    throw std::runtime_error(fmt::format("bus: LCM refuses {} bytes on channel {}", bytes.size(), channel));
}

int64_t Bus::next_sequence(const std::string& channel) {
  const std::lock_guard lock(mutex_);
  return ++sequences_[channel];
}

void Bus::subscribe_bytes(const std::string& channel, int queue,
                          std::function<bool(const void*, int, Subscription&)> decode_and_handle) {
  auto subscription = std::make_unique<Subscription>();
  subscription->bus = this;
  subscription->channel = channel;
  subscription->decode_and_handle = std::move(decode_and_handle);
  lcm_subscription_t* handle = lcm_subscribe(lcm_, channel.c_str(), &Bus::on_message, subscription.get());
  if (handle == nullptr) refuse("bus", "LCM cannot subscribe to channel {}", channel);
  lcm_subscription_set_queue_capacity(handle, queue);
  const std::lock_guard lock(mutex_);
  subscriptions_.push_back(std::move(subscription));
}

void Bus::on_message(const lcm_recv_buf_t* buffer, const char*, void* subscription) {
  static_cast<Subscription*>(subscription)->receive(buffer->data, static_cast<int>(buffer->data_size));
}

// A number at or below the last one means that the publisher started anew (or repeats itself), not a loss.
void Bus::Subscription::note_sequence(int64_t sequence) {
  const std::lock_guard lock(bus->mutex_);
  if (last_sequence > 0 && sequence > last_sequence) count.lost += sequence - last_sequence - 1;
  last_sequence = sequence;
}

// The decoder throws std::length_error over sizes that lie, and the handler may throw anything; LCM is C and
// must see none of it.
void Bus::Subscription::receive(const void* data, int size) noexcept {
  int64_t ChannelCount::* outcome = &ChannelCount::received;
  try {
    if (!decode_and_handle(data, size, *this)) outcome = &ChannelCount::undecodable;
  } catch (const std::length_error&) {
    outcome = &ChannelCount::undecodable;
  } catch (const std::exception& error) {
    outcome = &ChannelCount::failed;
    spdlog::error("bus: handler of {}: {}", channel, error.what());
  } catch (...) {
    outcome = &ChannelCount::failed;
  }
  const std::lock_guard lock(bus->mutex_);
  count.*outcome += 1;
}

}  // namespace selvedge::rig
