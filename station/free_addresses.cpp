#include "station/free_addresses.h"

#include <random>
#include <stdexcept>

#include <fmt/format.h>

#include "rig/wire/socket.h"

namespace selvedge::station {

namespace {

constexpr int kGvcpPort = 3956;
constexpr int kTries = 200;

bool udp_is_free(const std::string& address, int port) {
  try {
    wire::bind_udp(address, port);
    return true;
  } catch (const std::exception&) { return false; }
}

}  // namespace

int free_tcp_port() { return wire::local_port(wire::listen_tcp("127.0.0.1", 0)); }

int free_bus_port() {
  std::random_device random;
  for (int i = 0; i < kTries; ++i) {
    const int port = 20000 + static_cast<int>(random() % 10000);
    if (udp_is_free("0.0.0.0", port)) return port;
  }
  throw std::runtime_error("no free UDP port between 20000 and 29999");
}

std::string free_camera_address() {
  std::random_device random;
  for (int i = 0; i < kTries; ++i) {
    const std::string address = fmt::format("127.{}.{}.{}", 16 + random() % 200, random() % 256, 1 + random() % 254);
    if (udp_is_free(address, kGvcpPort)) return address;
  }
  throw std::runtime_error("no loopback address on which UDP port 3956 is free");
}

}  // namespace selvedge::station
