#include <libusb.h>

#include <fmt/format.h>

#include "rig/projector/backends/report_transport.h"
#include "rig/wire/socket.h"

namespace selvedge::projector {

namespace {

constexpr std::uint16_t kVendor = 0x0451, kProduct = 0x6401;
constexpr int kInterface = 0;
constexpr unsigned kWriteTimeout_ms = 1000;

void check(int status, const char* what) {
  if (status < 0)
    throw wire::Disconnected(
        fmt::format("usb {:04x}:{:04x}: {}: {}", kVendor, kProduct, what, libusb_error_name(status)));
}

class UsbTransport final : public ReportTransport {
 public:
  UsbTransport() {
    check(libusb_init(&context_), "init");
    handle_ = libusb_open_device_with_vid_pid(context_, kVendor, kProduct);
    if (handle_ == nullptr) {
      libusb_exit(context_);
      throw wire::Disconnected(fmt::format(
          "usb {:04x}:{:04x}: not found, or no permission (data/udev/70-selvedge.rules gives it)", kVendor, kProduct));
    }
    try {
      // The kernel's HID driver holds the interface of a device like this one.
      libusb_set_auto_detach_kernel_driver(handle_, 1);
      check(libusb_claim_interface(handle_, kInterface), "claim interface");
      find_endpoints();
    } catch (...) {
      close();
      throw;
    }
  }
  ~UsbTransport() override { close(); }

  void write(const Report& report) override {
    Report copy = report;
    int sent = 0;
    check(libusb_interrupt_transfer(handle_, out_, copy.data(), report_bytes, &sent, kWriteTimeout_ms), "write");
    if (sent != static_cast<int>(report_bytes))
      throw wire::Disconnected(fmt::format("usb: {} of 64 bytes written", sent));
  }

  std::optional<Report> read(double timeout_s) override {
    Report report{};
    int got = 0;
    // Zero would mean to wait for ever.
    const auto timeout_ms = std::max(1U, static_cast<unsigned>(timeout_s * 1e3));
    const int status = libusb_interrupt_transfer(handle_, in_, report.data(), report_bytes, &got, timeout_ms);
    if (status == LIBUSB_ERROR_TIMEOUT) return std::nullopt;
    check(status, "read");
    return report;
  }

 private:
  void find_endpoints() {
    libusb_config_descriptor* descriptor = nullptr;
    check(libusb_get_active_config_descriptor(libusb_get_device(handle_), &descriptor), "descriptors");
    if (descriptor->bNumInterfaces > kInterface && descriptor->interface[kInterface].num_altsetting > 0) {
      const auto& setting = descriptor->interface[kInterface].altsetting[0];
      for (int i = 0; i < setting.bNumEndpoints; ++i) {
        const auto& endpoint = setting.endpoint[i];
        if ((endpoint.bmAttributes & LIBUSB_TRANSFER_TYPE_MASK) != LIBUSB_TRANSFER_TYPE_INTERRUPT) continue;
        ((endpoint.bEndpointAddress & LIBUSB_ENDPOINT_IN) != 0 ? in_ : out_) = endpoint.bEndpointAddress;
      }
    }
    libusb_free_config_descriptor(descriptor);
    if (in_ == 0 || out_ == 0) throw wire::Disconnected("usb: the device has no pair of interrupt endpoints");
  }

  void close() {
    if (handle_ != nullptr) {
      libusb_release_interface(handle_, kInterface);
      libusb_close(handle_);
    }
    libusb_exit(context_);
  }

  libusb_context* context_ = nullptr;
  libusb_device_handle* handle_ = nullptr;
  std::uint8_t in_ = 0, out_ = 0;
};

}  // namespace

std::unique_ptr<ReportTransport> open_usb_transport() { return std::make_unique<UsbTransport>(); }

}  // namespace selvedge::projector
