#include <algorithm>

#include "rig/projector/backends/report_transport.h"
#include "rig/wire/socket.h"

namespace selvedge::projector {

namespace {

// A SOCK_SEQPACKET socket keeps reports apart as USB does.
class SocketTransport final : public ReportTransport {
 public:
  explicit SocketTransport(const std::filesystem::path& path) : socket_(wire::connect_seqpacket(path)) {}

  void write(const Report& report) override { socket_.send(report); }

  std::optional<Report> read(double timeout_s) override {
    if (!socket_.readable(timeout_s)) return std::nullopt;
    Report report{};
    socket_.receive(report);
    return report;
  }

 private:
  wire::Socket socket_;
};

}  // namespace

std::unique_ptr<ReportTransport> open_socket_transport(const std::filesystem::path& path) {
  return std::make_unique<SocketTransport>(path);
}

}  // namespace selvedge::projector
