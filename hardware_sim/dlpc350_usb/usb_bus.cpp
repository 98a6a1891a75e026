#include "hardware_sim/dlpc350_usb/usb_bus.h"

#include <sys/ioctl.h>

#include <linux/usbdevice_fs.h>
#include <umockdev.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <stdexcept>
#include <thread>

#include "rig/clock.h"

namespace selvedge::hardware_sim {

namespace {

constexpr const char* kNode = "/dev/bus/usb/001/002";
constexpr unsigned char kIn = 0x80;

// 0451:6401, one configuration, one HID interface, endpoints 0x01 out and 0x81 in of 64 bytes each millisecond.
constexpr const char* kDescription =
    "P: /devices/pci0000:00/usb1/1-1\n"
    "N: bus/usb/001/002\n"
    "E: SUBSYSTEM=usb\n"
    "E: DRIVER=usb\n"
    "E: BUSNUM=001\n"
    "E: DEVNUM=002\n"
    "E: DEVNAME=/dev/bus/usb/001/002\n"
    "E: DEVTYPE=usb_device\n"
    "A: bConfigurationValue=1\\n\n"
    "A: busnum=1\\n\n"
    "A: devnum=2\\n\n"
    "A: speed=12\\n\n"
    "H: descriptors="
    "12010002000000405104016400010000000109022900010100C0320904000002030000000921110100012222000705010340000107058103400001\n";

usbdevfs_urb* urb_of(UMockdevIoctlData* data) { return reinterpret_cast<usbdevfs_urb*>(data->data); }

}  // namespace

class Dlpc350Usb::Bus {
 public:
  explicit Bus(const Dlpc350Options& options) : device(options) {
    // umockdev_in_mock_environment() of 0.17 says no even under the wrapper.
    const char* preload = std::getenv("LD_PRELOAD");
    if (preload == nullptr || std::strstr(preload, "umockdev-preload") == nullptr)
      throw std::runtime_error("the emulated USB bus needs umockdev-wrapper");
    testbed_ = umockdev_testbed_new();
    handler_ = umockdev_ioctl_base_new();
    g_signal_connect_after(handler_, "handle-ioctl", G_CALLBACK(&Bus::on_ioctl), this);
    GError* error = nullptr;
    umockdev_testbed_attach_ioctl(testbed_, kNode, handler_, &error);
    if (error == nullptr) umockdev_testbed_add_from_string(testbed_, kDescription, &error);
    if (error != nullptr) {
      const std::string text = error->message;
      g_error_free(error);
      throw std::runtime_error("umockdev: " + text);
    }
  }
  ~Bus() {
    umockdev_testbed_detach_ioctl(testbed_, kNode, nullptr);
    for (auto* list : {&waiting_in_, &finished_})
      for (auto* urb : *list) umockdev_ioctl_data_unref(urb);
    g_object_unref(handler_);
    g_object_unref(testbed_);
  }

  Dlpc350Device device;
  std::atomic<bool> unplugged = false, hangs = false;

 private:
  // On umockdev's own thread, one call at a time.
  static gboolean on_ioctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, Bus* bus) {
    return bus->handle(client) ? TRUE : FALSE;
  }

  bool handle(UMockdevIoctlClient* client) {
    UMockdevIoctlData* argument = umockdev_ioctl_client_get_arg(client);
    switch (umockdev_ioctl_client_get_request(client)) {
      case USBDEVFS_GET_CAPABILITIES:
        tell_capabilities(argument);
        return complete(client, 0);
      case USBDEVFS_GETDRIVER:  // no kernel driver holds the interface
        return complete(client, ENODATA);
      case USBDEVFS_CLAIMINTERFACE:
      case USBDEVFS_DISCONNECT_CLAIM:
      case USBDEVFS_RELEASEINTERFACE:
      case USBDEVFS_CLEAR_HALT:
      case USBDEVFS_IOCTL:
        return complete(client, unplugged ? ENODEV : 0);
      case USBDEVFS_SUBMITURB:
        return complete(client, submit(argument));
      case USBDEVFS_REAPURB:
      case USBDEVFS_REAPURBNDELAY:
        return complete(client, reap(argument));
      case USBDEVFS_DISCARDURB:
        return complete(client, discard(argument));
      default:
        return complete(client, ENOTTY);
    }
  }

  static bool complete(UMockdevIoctlClient* client, int error) {
    umockdev_ioctl_client_complete(client, error == 0 ? 0 : -1, error);
    return true;
  }

  static void tell_capabilities(UMockdevIoctlData* argument) {
    UMockdevIoctlData* value = umockdev_ioctl_data_resolve(argument, 0, sizeof(guint32), nullptr);
    const guint32 capabilities = USBDEVFS_CAP_BULK_CONTINUATION | USBDEVFS_CAP_NO_PACKET_SIZE_LIM | USBDEVFS_CAP_REAP_AFTER_DISCONNECT;
    std::memcpy(value->data, &capabilities, sizeof capabilities);
    umockdev_ioctl_data_unref(value);
  }

  int submit(UMockdevIoctlData* argument) {
    if (unplugged) return ENODEV;
    UMockdevIoctlData* data = umockdev_ioctl_data_resolve(argument, 0, sizeof(usbdevfs_urb), nullptr);
    usbdevfs_urb* urb = urb_of(data);
    UMockdevIoctlData* buffer =
        umockdev_ioctl_data_resolve(data, offsetof(usbdevfs_urb, buffer), static_cast<gsize>(urb->buffer_length), nullptr);
    const bool sound = urb->type == USBDEVFS_URB_TYPE_INTERRUPT && urb->buffer_length == static_cast<int>(projector::report_bytes);
    if (sound && (urb->endpoint & kIn) != 0) {
      waiting_in_.push_back(data);
    } else if (sound) {
      projector::Report report;
      std::memcpy(report.data(), buffer->data, report.size());
      if (!hangs)
        for (const auto& reply : device.on_report(report, rig::host_now_s())) replies_.push_back(reply);
      finish(data, 0, urb->buffer_length);
    }
    if (buffer != nullptr) umockdev_ioctl_data_unref(buffer);
    if (!sound) umockdev_ioctl_data_unref(data);
    answer_reads();
    return sound ? 0 : EINVAL;
  }

  void answer_reads() {
    while (!waiting_in_.empty() && !replies_.empty()) {
      UMockdevIoctlData* data = waiting_in_.front();
      waiting_in_.pop_front();
      std::memcpy(urb_of(data)->buffer, replies_.front().data(), projector::report_bytes);
      replies_.pop_front();
      finish(data, 0, static_cast<int>(projector::report_bytes));
    }
  }

  void finish(UMockdevIoctlData* data, int status, int length) {
    urb_of(data)->status = status;
    urb_of(data)->actual_length = length;
    finished_.push_back(data);
  }

  int reap(UMockdevIoctlData* argument) {
    if (unplugged)
      while (!waiting_in_.empty()) {
        finish(waiting_in_.front(), -ESHUTDOWN, 0);
        waiting_in_.pop_front();
      }
    if (finished_.empty()) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      return unplugged ? ENODEV : EAGAIN;
    }
    UMockdevIoctlData* data = finished_.front();
    finished_.pop_front();
    UMockdevIoctlData* pointer = umockdev_ioctl_data_resolve(argument, 0, sizeof(void*), nullptr);
    umockdev_ioctl_data_set_ptr(pointer, 0, data);
    umockdev_ioctl_data_unref(pointer);
    return 0;
  }

  int discard(UMockdevIoctlData* argument) {
    void* address = nullptr;
    std::memcpy(&address, argument->data, sizeof address);
    const auto found = std::find_if(waiting_in_.begin(), waiting_in_.end(), [&](const UMockdevIoctlData* data) {
      return data->client_addr == reinterpret_cast<gulong>(address);
    });
    if (found == waiting_in_.end()) return EINVAL;
    finish(*found, -ENOENT, 0);
    waiting_in_.erase(found);
    return 0;
  }

  UMockdevTestbed* testbed_ = nullptr;
  UMockdevIoctlBase* handler_ = nullptr;
  std::deque<UMockdevIoctlData*> waiting_in_, finished_;
  std::deque<projector::Report> replies_;
};

Dlpc350Usb::Dlpc350Usb(const Dlpc350Options& options) : bus_(std::make_unique<Bus>(options)) {}
Dlpc350Usb::~Dlpc350Usb() = default;
Dlpc350Device& Dlpc350Usb::device() { return bus_->device; }
void Dlpc350Usb::unplug() { bus_->unplugged = true; }
void Dlpc350Usb::hang() { bus_->hangs = true; }
void Dlpc350Usb::replug() { bus_->unplugged = false; }

}  // namespace selvedge::hardware_sim
