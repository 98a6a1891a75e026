// TCP, UDP and Unix sockets that close themselves and never block for longer than they are told.
//
// Every wait has a time limit in seconds. A peer that went away shows as Disconnected, never as SIGPIPE.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace selvedge::wire {

// The peer closed the connection, cannot be reached, or took nothing for longer than the limit.
class Disconnected : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class Socket {
 public:
  Socket() = default;
  explicit Socket(int descriptor) : descriptor_(descriptor) {}
  Socket(Socket&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
  Socket& operator=(Socket&& other) noexcept;
  ~Socket() { close(); }

  bool is_open() const { return descriptor_ >= 0; }
  int descriptor() const { return descriptor_; }
  void close();

  // True where reading would not wait; false after timeout_s.
  bool readable(double timeout_s) const;
  // What is there, up to the size of `into`. Throws Disconnected where the peer closed.
  size_t receive(std::span<std::uint8_t> into) const;
  // All of `bytes`. Throws Disconnected where that takes longer than timeout_s.
  void send(std::span<const std::uint8_t> bytes, double timeout_s = 1) const;

 private:
  int descriptor_ = -1;
};

// host: an IPv4 address or a name. Throws Disconnected naming host and port.
Socket connect_tcp(const std::string& host, int port, double timeout_s);

// Listens on address:port; port 0 lets the system choose. Throws std::runtime_error where the port is taken.
Socket listen_tcp(const std::string& address, int port);
Socket listen_seqpacket(const std::filesystem::path& path);
Socket connect_seqpacket(const std::filesystem::path& path);
// A stream over a path, for every user whom the folders let through. Throws std::runtime_error where somebody listens
// there already; what a process that is gone left behind is replaced.
Socket listen_unix(const std::filesystem::path& path);
Socket connect_unix(const std::filesystem::path& path);
std::optional<Socket> accept(const Socket& listener, double timeout_s);

// A UDP socket bound to address:port (0: any), and one connected to a peer.
Socket bind_udp(const std::string& address, int port);
Socket connect_udp(const std::string& host, int port);
// A UDP socket that receives what is sent to group:port, on every interface.
Socket join_multicast(const std::string& group, int port);
// One datagram and who sent it; the answer goes to that peer.
struct Datagram {
  std::vector<std::uint8_t> bytes;
  std::uint32_t address = 0;  // IPv4, network order
  std::uint16_t port = 0;     // network order
};
Datagram receive_datagram(const Socket& socket);
void send_datagram(const Socket& socket, const Datagram& datagram);

// Port a listening or bound socket got.
int local_port(const Socket& socket);
// IPv4 addresses of the two ends, "" where there is none; and of a host by its name. The last throws Disconnected.
std::string local_address(const Socket& socket);
std::string peer_address(const Socket& socket);
std::string address_of(const std::string& host);
// A TCP peer that acknowledges nothing for so long is gone.
void set_patience(const Socket& socket, double seconds);

}  // namespace selvedge::wire
