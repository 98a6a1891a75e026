#include "rig/bus.h"

#include <exception>
#include <stdexcept>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "files/bad_input.h"
#include "rig/bus_filter.h"
#include "rig/network.h"
#include "rig/runtime_folder.h"

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
    spdlog::warn(
        "bus: the kernel grants {} of {} bytes of receive buffer, messages may be lost under load; mend with "
        "sudo sysctl -w net.core.rmem_max={}",
        granted, configuration.receive_buffer_bytes, configuration.receive_buffer_bytes);
}

}  // namespace

Bus::Bus(const BusConfiguration& configuration) {
  if (configuration.log_file.empty()) {
    check_network(configuration);
    port_ = static_cast<uint16_t>(configuration.port);
    key_file_ = configuration.key_file.empty() ? (runtime_folder() / "bus.key").string() : configuration.key_file;
    signature_.emplace(shared_bus_key(key_file_));
  }
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

bool Bus::handle(double timeout_s) { return lcm_handle_timeout(lcm_, static_cast<int>(timeout_s * 1e3)) >= 0; }

ChannelCount Bus::count(const std::string& channel) const {
  const std::lock_guard lock(mutex_);
  ChannelCount sum;
  for (const auto& subscription : subscriptions_) {
    if (subscription->channel != channel) continue;
    sum.received += subscription->count.received;
    sum.lost += subscription->count.lost;
    sum.undecodable += subscription->count.undecodable;
    sum.failed += subscription->count.failed;
    sum.refused += subscription->count.refused;
    sum.repeated += subscription->count.repeated;
  }
  return sum;
}

void Bus::publish_bytes(const std::string& channel, std::vector<uint8_t> bytes) {
  if (signature_) signature_->sign(channel, bytes);
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
  // LCM makes its receive socket in the first lcm_subscribe.
  if (signature_ && subscriptions_.empty()) hear_this_host_alone(port_);
  const std::lock_guard lock(mutex_);
  subscriptions_.push_back(std::move(subscription));
}

void Bus::on_message(const lcm_recv_buf_t* buffer, const char* channel, void* subscription) {
  const auto* bytes = static_cast<const uint8_t*>(buffer->data);
  static_cast<Subscription*>(subscription)->receive(channel, bytes, buffer->data_size);
}

// 1 means that the publisher started anew, any other number at or below the last that an old message came again.
void Bus::Subscription::note_sequence(int64_t sequence) {
  const std::lock_guard lock(bus->mutex_);
  if (sequence > 1 && sequence <= last_sequence) {
    count.repeated += 1;
    return;
  }
  if (last_sequence > 0 && sequence > last_sequence) count.lost += sequence - last_sequence - 1;
  last_sequence = sequence;
}

// The decoder throws std::length_error over sizes that lie, and the handler may throw anything; LCM is C and
// must see none of it.
void Bus::Subscription::receive(const char* from, const uint8_t* data, size_t size) noexcept {
  int64_t ChannelCount::*outcome = &ChannelCount::received;
  try {
    if (bus->signature_ && !bus->signature_->holds(from, data, size)) {
      refuse_message(from);
      return;
    }
    if (ends_in_trailer(data, size)) size -= BusSignature::kTrailerBytes;
    if (!decode_and_handle(data, static_cast<int>(size), *this)) outcome = &ChannelCount::undecodable;
  } catch (const std::length_error&) { outcome = &ChannelCount::undecodable; } catch (const std::exception& error) {
    outcome = &ChannelCount::failed;
    spdlog::error("bus: handler of {}: {}", channel, error.what());
  } catch (...) { outcome = &ChannelCount::failed; }
  const std::lock_guard lock(bus->mutex_);
  count.*outcome += 1;
}

// Said once a channel: a process of another user, or one that still has a key since deleted, looks like silence
// otherwise.
void Bus::Subscription::refuse_message(const char* from) {
  {
    const std::lock_guard lock(bus->mutex_);
    if (++count.refused > 1) return;
  }
  spdlog::warn("bus: a message on {} is not signed with the key in {}; it is dropped, and so is each like it", from,
               bus->key_file_);
}

}  // namespace selvedge::rig
