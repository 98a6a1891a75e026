// The bus: LCM over UDP multicast that stays on the host, with our message types.
//
// Every message carries a sequence number that publish() sets, one count a channel; a subscriber's step above
// 1 is counted as lost messages. Handlers run on the bus's own thread and may throw: the error is counted
// and logged, and the bus lives on. So it does over messages that cannot be decoded.
// Packets of other hosts are dropped by the kernel (rig/bus_filter.h), messages without the signature of this user's
// key by the bus (rig/bus_signature.h, rig/bus_key.h). A replayed log is believed as it is, signed or not.
// Frames at full rate do not belong here; see rig/camera/frame_ring.h.
// Measured limits and set-up: docs/devices.md. LCM: lcm-proj.github.io, version 1.3.1.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <lcm/lcm.h>

#include "rig/bus_signature.h"

namespace selvedge::rig {

struct BusConfiguration {
  int port = 7667;                     // UDP; two rigs on one host differ in it (the group does not isolate)
  int receive_buffer_bytes = 4194304;  // asked of the kernel for the socket
  std::string log_file;                // where set, this LCM log is replayed instead of the network
  std::string key_file;                // the user's secret; empty: bus.key in the runtime folder (rig/runtime_folder.h)
};

struct ChannelCount {
  int64_t received = 0;     // decoded and handled
  int64_t lost = 0;         // sum of the steps in sequence numbers beyond 1
  int64_t undecodable = 0;  // wrong type, truncated, or sizes that lie
  int64_t failed = 0;       // the handler threw
  int64_t refused = 0;      // not signed, or not with this user's key for this channel
  int64_t repeated = 0;     // of the received: number not above the last, nor 1 as of a publisher that starts anew
};

class Bus {
 public:
  // Throws BadInput where the host cannot carry multicast, with the command that mends it, and where the key will not
  // do.
  explicit Bus(const BusConfiguration& configuration);
  ~Bus();
  Bus(const Bus&) = delete;
  Bus& operator=(const Bus&) = delete;

  // Sets message.sequence, signs and sends. From any thread. Throws std::runtime_error where LCM refuses.
  template <class Message>
  void publish(const std::string& channel, Message& message) {
    message.sequence = next_sequence(channel);
    std::vector<uint8_t> bytes(static_cast<size_t>(message.getEncodedSize()));
    message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    publish_bytes(channel, std::move(bytes));
  }

  // Calls handler(const Message&) on the bus thread. queue: messages LCM holds while handlers are busy.
  // Subscribe before start(). Throws BadInput where the kernel will not keep other hosts out.
  template <class Message>
  void subscribe(const std::string& channel, std::function<void(const Message&)> handler, int queue = 256) {
    subscribe_bytes(channel, queue, [handler = std::move(handler)](const void* data, int size, Subscription& own) {
      Message message;
      if (message.decode(data, 0, size) != size) return false;
      own.note_sequence(message.sequence);
      handler(message);
      return true;
    });
  }

  // Runs the handlers on a thread of their own until destruction.
  void start();
  // Alternative to start(): waits up to timeout_s for messages and runs their handlers here.
  // A replayed log returns false at its end.
  bool handle(double timeout_s);

  ChannelCount count(const std::string& channel) const;

  // Signs and sends bytes as they are; tests use it to send what no publisher would.
  void publish_bytes(const std::string& channel, std::vector<uint8_t> bytes);

 private:
  struct Subscription {
    Bus* bus = nullptr;
    std::string channel;
    std::function<bool(const void*, int, Subscription&)> decode_and_handle;
    ChannelCount count;
    int64_t last_sequence = 0;
    void note_sequence(int64_t sequence);
    void receive(const char* channel, const uint8_t* data, size_t size) noexcept;
    void refuse_message(const char* channel);
  };
  static void on_message(const lcm_recv_buf_t* buffer, const char* channel, void* subscription);

  void subscribe_bytes(const std::string& channel, int queue,
                       std::function<bool(const void*, int, Subscription&)> decode_and_handle);
  int64_t next_sequence(const std::string& channel);

  uint16_t port_ = 0;
  std::string key_file_;
  std::optional<BusSignature> signature_;  // none where a log is replayed
  lcm_t* lcm_ = nullptr;
  std::vector<std::unique_ptr<Subscription>> subscriptions_;
  std::map<std::string, int64_t> sequences_;
  mutable std::mutex mutex_;  // guards sequences_ and the counts
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace selvedge::rig
