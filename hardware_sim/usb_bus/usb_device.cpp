#include "hardware_sim/usb_bus/usb_device.h"

#include <sys/ioctl.h>

#include <linux/usbdevice_fs.h>
#include <umockdev.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <map>
#include <mutex>
#include <set>
#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace selvedge::hardware_sim {

namespace {

constexpr uint8_t kIn = 0x80;
constexpr auto kLongestReap = std::chrono::milliseconds(1);
constexpr size_t kSetupBytes = 8, kLargestUrb = 64u << 20;
// Standard requests and what they name (USB 2.0, chapter 9).
constexpr uint8_t kGetDescriptor = 6, kSetFeature = 3, kClearFeature = 1, kToEndpoint = 2, kStandardIn = 0x80;
constexpr uint8_t kStringDescriptor = 3;
constexpr uint16_t kEnglish = 0x0409;

std::string node_of(const UsbIdentity& identity) { return fmt::format("/dev/bus/usb/001/{:03}", identity.number); }

std::string description(const UsbIdentity& identity) {
  return fmt::format(
      "P: /devices/pci0000:00/usb1/1-{0}\nN: bus/usb/001/{1:03}\nE: SUBSYSTEM=usb\nE: DRIVER=usb\nE: BUSNUM=001\nE: "
      "DEVNUM={1:03}\n"
      "E: DEVNAME={2}\nE: DEVTYPE=usb_device\nA: bConfigurationValue=1\\n\nA: busnum=1\\n\nA: devnum={1}\\n\nA: "
      "speed={3}\\n\n"
      "H: descriptors={4:02X}\n",
      identity.number - 1, identity.number, node_of(identity), identity.speed_mbit,
      fmt::join(identity.descriptors, ""));
}

usbdevfs_urb& urb_of(UMockdevIoctlData* data) { return *reinterpret_cast<usbdevfs_urb*>(data->data); }

// The buffer of a URB as it is in the client's memory; nullptr where the client lied about it.
uint8_t* buffer_of(UMockdevIoctlData* data) {
  UMockdevIoctlData* buffer = umockdev_ioctl_data_resolve(data, offsetof(usbdevfs_urb, buffer),
                                                          static_cast<gsize>(urb_of(data).buffer_length), nullptr);
  if (buffer == nullptr) return nullptr;
  uint8_t* bytes = buffer->data;
  umockdev_ioctl_data_unref(buffer);  // the URB holds it
  return bytes;
}

}  // namespace

class UsbDevice::Bus {
 public:
  Bus(const UsbIdentity& identity, std::function<void(uint8_t, const UsbBytes&)> on_out)
      : identity_(identity), on_out_(std::move(on_out)) {
    // umockdev_in_mock_environment() of 0.17 says no even under the wrapper.
    const char* preload = std::getenv("LD_PRELOAD");
    if (preload == nullptr || std::strstr(preload, "umockdev-preload") == nullptr)
      throw std::runtime_error("the emulated USB bus needs umockdev-wrapper");
    testbed_ = umockdev_testbed_new();
    handler_ = umockdev_ioctl_base_new();
    g_signal_connect_after(handler_, "handle-ioctl", G_CALLBACK(&Bus::on_ioctl), this);
    g_signal_connect_after(handler_, "client-vanished", G_CALLBACK(&Bus::on_vanished), this);
    GError* error = nullptr;
    umockdev_testbed_attach_ioctl(testbed_, node_of(identity_).c_str(), handler_, &error);
    if (error == nullptr) umockdev_testbed_add_from_string(testbed_, description(identity_).c_str(), &error);
    if (error != nullptr) {
      const std::string text = error->message;
      g_error_free(error);
      throw std::runtime_error("umockdev: " + text);
    }
  }
  ~Bus() {
    umockdev_testbed_detach_ioctl(testbed_, node_of(identity_).c_str(), nullptr);
    g_signal_handlers_disconnect_by_data(handler_, this);
    for (auto& [endpoint, urbs] : waiting_)
      for (const Urb& urb : urbs) umockdev_ioctl_data_unref(urb.data);
    for (auto& [client, urbs] : finished_)
      for (auto* data : urbs) umockdev_ioctl_data_unref(data);
    g_object_unref(handler_);
    g_object_unref(testbed_);
  }

  void send(uint8_t endpoint, UsbBytes transfer) {
    const std::lock_guard lock(mutex_);
    if (unplugged_ || transfer.empty()) return;
    waiting_bytes_[endpoint] += transfer.size();
    to_fetch_[endpoint].push_back({std::move(transfer), 0});
    changed_.notify_all();
  }
  size_t waiting_bytes(uint8_t endpoint) const {
    const std::lock_guard lock(mutex_);
    const auto found = waiting_bytes_.find(endpoint);
    return found == waiting_bytes_.end() ? 0 : found->second;
  }
  void discard(uint8_t endpoint) {
    const std::lock_guard lock(mutex_);
    to_fetch_.erase(endpoint);
    waiting_bytes_.erase(endpoint);
  }
  void plug(bool in) {
    const std::lock_guard lock(mutex_);
    unplugged_ = !in;
    to_fetch_.clear();
    waiting_bytes_.clear();
    halted_.clear();
    claims_.clear();
    changed_.notify_all();
  }
  void halt(uint8_t endpoint) {
    const std::lock_guard lock(mutex_);
    halted_.insert(endpoint);
    changed_.notify_all();
  }

 private:
  using Client = UMockdevIoctlClient*;
  struct Urb {
    Client client;
    UMockdevIoctlData* data;
  };
  struct Transfer {
    UsbBytes bytes;
    size_t fetched;
  };

  // On umockdev's own thread, one call at a time.
  static gboolean on_ioctl(UMockdevIoctlBase*, Client client, Bus* bus) {
    const int error = bus->handle(client);
    umockdev_ioctl_client_complete(client, error == 0 ? 0 : -1, error);
    return TRUE;
  }
  static void on_vanished(UMockdevIoctlBase*, Client client, Bus* bus) { bus->forget(client); }

  int handle(Client client) {
    UMockdevIoctlData* argument = umockdev_ioctl_client_get_arg(client);
    const auto request = static_cast<unsigned>(umockdev_ioctl_client_get_request(client));
    switch (request) {
      case USBDEVFS_GET_CAPABILITIES:
        return put_word(argument, USBDEVFS_CAP_BULK_SCATTER_GATHER | USBDEVFS_CAP_NO_PACKET_SIZE_LIM |
                                      USBDEVFS_CAP_REAP_AFTER_DISCONNECT);
      case USBDEVFS_GETDRIVER: return ENODATA;  // no kernel driver holds the interface
      case USBDEVFS_CLAIMINTERFACE: return claim(client, word(argument, sizeof(unsigned)));
      case USBDEVFS_DISCONNECT_CLAIM: return claim(client, word(argument, sizeof(usbdevfs_disconnect_claim)));
      case USBDEVFS_RELEASEINTERFACE: return release(client, word(argument, sizeof(unsigned)));
      case USBDEVFS_CLEAR_HALT: return clear_halt(static_cast<uint8_t>(word(argument, sizeof(unsigned))));
      case USBDEVFS_IOCTL: {
        const std::lock_guard lock(mutex_);
        return unplugged_ ? ENODEV : 0;
      }
      case USBDEVFS_SUBMITURB: return submit(client, argument);
      case USBDEVFS_REAPURB:
      case USBDEVFS_REAPURBNDELAY: return reap(client, argument);
      case USBDEVFS_DISCARDURB: return discard(client, argument);
      default: return ENOTTY;
    }
  }

  // The first word of an argument that points to `bytes`.
  static unsigned word(UMockdevIoctlData* argument, size_t bytes) {
    unsigned value = 0;
    if (UMockdevIoctlData* data = umockdev_ioctl_data_resolve(argument, 0, bytes, nullptr)) {
      std::memcpy(&value, data->data, sizeof value);
      umockdev_ioctl_data_unref(data);
    }
    return value;
  }
  static int put_word(UMockdevIoctlData* argument, guint32 value) {
    UMockdevIoctlData* data = umockdev_ioctl_data_resolve(argument, 0, sizeof value, nullptr);
    if (data == nullptr) return EFAULT;
    std::memcpy(data->data, &value, sizeof value);
    umockdev_ioctl_data_unref(data);
    return 0;
  }

  int claim(Client client, unsigned interface) {
    const std::lock_guard lock(mutex_);
    if (unplugged_) return ENODEV;
    const auto [held, free] = claims_.try_emplace(interface, client);
    return free || held->second == client ? 0 : EBUSY;
  }
  int release(Client client, unsigned interface) {
    const std::lock_guard lock(mutex_);
    const auto held = claims_.find(interface);
    if (held == claims_.end() || held->second != client) return unplugged_ ? ENODEV : EINVAL;
    claims_.erase(held);
    return 0;
  }
  int clear_halt(uint8_t endpoint) {
    const std::lock_guard lock(mutex_);
    if (unplugged_) return ENODEV;
    halted_.erase(endpoint);
    return 0;
  }

  int submit(Client client, UMockdevIoctlData* argument) {
    UMockdevIoctlData* data = umockdev_ioctl_data_resolve(argument, 0, sizeof(usbdevfs_urb), nullptr);
    if (data == nullptr) return EFAULT;
    const usbdevfs_urb urb = urb_of(data);
    std::unique_lock lock(mutex_);
    const auto refuse = [&](int error) { return umockdev_ioctl_data_unref(data), error; };
    if (unplugged_) return refuse(ENODEV);
    if (urb.buffer_length < 0 || static_cast<size_t>(urb.buffer_length) > kLargestUrb) return refuse(EINVAL);
    switch (urb.type) {
      case USBDEVFS_URB_TYPE_CONTROL:
        if (static_cast<size_t>(urb.buffer_length) < kSetupBytes) return refuse(EINVAL);
        control(client, data);
        return 0;
      case USBDEVFS_URB_TYPE_BULK:
      case USBDEVFS_URB_TYPE_INTERRUPT: break;
      default: return refuse(EINVAL);
    }
    if ((urb.endpoint & kIn) != 0) {
      waiting_[urb.endpoint].push_back({client, data});
      return 0;
    }
    if (halted_.count(urb.endpoint)) {
      finish(client, data, -EPIPE, 0);
      return 0;
    }
    const uint8_t* bytes = urb.buffer_length > 0 ? buffer_of(data) : nullptr;
    const UsbBytes sent(bytes, bytes ? bytes + urb.buffer_length : bytes);
    finish(client, data, 0, urb.buffer_length);
    lock.unlock();
    on_out_(urb.endpoint, sent);
    return 0;
  }

  // Endpoint 0: string descriptors, and halting an endpoint.
  void control(Client client, UMockdevIoctlData* data) {
    uint8_t* bytes = buffer_of(data);
    if (bytes == nullptr) return finish(client, data, -EFAULT, 0);
    const uint8_t type = bytes[0], request = bytes[1];
    const auto value = static_cast<uint16_t>(bytes[2] | bytes[3] << 8),
               index = static_cast<uint16_t>(bytes[4] | bytes[5] << 8);
    if (type == kStandardIn && request == kGetDescriptor && value >> 8 == kStringDescriptor) {
      const UsbBytes string = string_descriptor(value & 0xff);
      const size_t room = static_cast<size_t>(urb_of(data).buffer_length) - kSetupBytes,
                   count = std::min(room, string.size());
      std::memcpy(bytes + kSetupBytes, string.data(), count);
      return string.empty() ? finish(client, data, -EPIPE, 0) : finish(client, data, 0, static_cast<int>(count));
    }
    if (type == kToEndpoint && request == kSetFeature) halted_.insert(static_cast<uint8_t>(index));
    else if (type == kToEndpoint && request == kClearFeature) halted_.erase(static_cast<uint8_t>(index));
    else return finish(client, data, -EPIPE, 0);
    finish(client, data, 0, 0);
  }

  // Length, type, then UTF-16; index 0 lists the languages. Empty: there is no such string.
  UsbBytes string_descriptor(size_t index) const {
    UsbBytes bytes = {0, kStringDescriptor};
    const auto append = [&](uint16_t unit) {
      bytes.insert(bytes.end(), {static_cast<uint8_t>(unit), static_cast<uint8_t>(unit >> 8)});
    };
    if (index == 0) append(kEnglish);
    else if (index <= identity_.strings.size())
      for (const char letter : identity_.strings[index - 1]) append(static_cast<uint8_t>(letter));
    else return {};
    bytes[0] = static_cast<uint8_t>(bytes.size());
    return bytes;
  }

  void finish(Client client, UMockdevIoctlData* data, int status, int length) {
    urb_of(data).status = status;
    urb_of(data).actual_length = length;
    finished_[client].push_back(data);
  }

  void answer_reads(uint8_t endpoint, std::deque<Urb>& urbs) {
    auto& transfers = to_fetch_[endpoint];
    while (!urbs.empty()) {
      const auto [client, data] = urbs.front();
      if (unplugged_) {
        finish(client, data, -ESHUTDOWN, 0);
      } else if (halted_.count(endpoint)) {
        finish(client, data, -EPIPE, 0);
      } else if (!transfers.empty()) {
        Transfer& transfer = transfers.front();
        const size_t count =
            std::min(static_cast<size_t>(urb_of(data).buffer_length), transfer.bytes.size() - transfer.fetched);
        if (uint8_t* bytes = count > 0 ? buffer_of(data) : nullptr)
          std::memcpy(bytes, transfer.bytes.data() + transfer.fetched, count);
        transfer.fetched += count;
        waiting_bytes_[endpoint] -= count;
        if (transfer.fetched == transfer.bytes.size()) transfers.pop_front();
        finish(client, data, 0, static_cast<int>(count));
      } else {
        return;
      }
      urbs.pop_front();
    }
  }

  int reap(Client client, UMockdevIoctlData* argument) {
    std::unique_lock lock(mutex_);
    auto& finished = finished_[client];
    const auto ready = [&] {
      for (auto& [endpoint, urbs] : waiting_) answer_reads(endpoint, urbs);
      return !finished.empty();
    };
    if (!ready() && !changed_.wait_for(lock, kLongestReap, ready)) return unplugged_ ? ENODEV : EAGAIN;
    UMockdevIoctlData* data = finished.front();
    finished.pop_front();
    UMockdevIoctlData* pointer = umockdev_ioctl_data_resolve(argument, 0, sizeof(void*), nullptr);
    if (pointer == nullptr) return umockdev_ioctl_data_unref(data), EFAULT;
    umockdev_ioctl_data_set_ptr(pointer, 0, data);
    umockdev_ioctl_data_unref(data);  // the answer holds it
    umockdev_ioctl_data_unref(pointer);
    return 0;
  }

  int discard(Client client, UMockdevIoctlData* argument) {
    gulong address = 0;
    std::memcpy(&address, argument->data, sizeof address);
    const std::lock_guard lock(mutex_);
    for (auto& [endpoint, urbs] : waiting_) {
      const auto found = std::find_if(urbs.begin(), urbs.end(), [&](const Urb& urb) {
        return urb.client == client && urb.data->client_addr == address;
      });
      if (found == urbs.end()) continue;
      finish(client, found->data, -ENOENT, 0);
      urbs.erase(found);
      return 0;
    }
    return EINVAL;
  }

  void forget(Client client) {
    const std::lock_guard lock(mutex_);
    for (auto& [endpoint, urbs] : waiting_)
      std::erase_if(
          urbs, [&](const Urb& urb) { return urb.client == client && (umockdev_ioctl_data_unref(urb.data), true); });
    for (auto* data : finished_[client]) umockdev_ioctl_data_unref(data);
    finished_.erase(client);
    std::erase_if(claims_, [&](const auto& held) { return held.second == client; });
  }

  const UsbIdentity identity_;
  const std::function<void(uint8_t, const UsbBytes&)> on_out_;
  UMockdevTestbed* testbed_ = nullptr;
  UMockdevIoctlBase* handler_ = nullptr;
  mutable std::mutex mutex_;  // guards all below
  std::condition_variable changed_;
  std::map<uint8_t, std::deque<Urb>> waiting_;  // reads of an endpoint
  std::map<Client, std::deque<UMockdevIoctlData*>> finished_;
  std::map<uint8_t, std::deque<Transfer>> to_fetch_;
  std::map<uint8_t, size_t> waiting_bytes_;
  std::map<unsigned, Client> claims_;
  std::set<uint8_t> halted_;
  bool unplugged_ = true;
};

UsbDevice::UsbDevice(const UsbIdentity& identity, std::function<void(uint8_t, const UsbBytes&)> on_out)
    : bus_(std::make_unique<Bus>(identity, std::move(on_out))) {}
UsbDevice::~UsbDevice() = default;
void UsbDevice::send(uint8_t endpoint, UsbBytes transfer) { bus_->send(endpoint, std::move(transfer)); }
size_t UsbDevice::waiting_bytes(uint8_t endpoint) const { return bus_->waiting_bytes(endpoint); }
void UsbDevice::discard(uint8_t endpoint) { bus_->discard(endpoint); }
void UsbDevice::unplug() { bus_->plug(false); }
void UsbDevice::plug_in() { bus_->plug(true); }
void UsbDevice::halt(uint8_t endpoint) { bus_->halt(endpoint); }

}  // namespace selvedge::hardware_sim
