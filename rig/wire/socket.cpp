#include "rig/wire/socket.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <memory>

#include <fmt/format.h>

namespace selvedge::wire {
namespace {

std::string error_text() { return std::strerror(errno); }

bool wait_for(int descriptor, short events, double timeout_s) {
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::duration<double>(timeout_s);
  for (;;) {
    const double left_s = std::max(0.0, std::chrono::duration<double>(end - Clock::now()).count());
    pollfd entry{descriptor, events, 0};
    const int ready = ::poll(&entry, 1, static_cast<int>(std::ceil(left_s * 1e3)));
    if (ready > 0) return true;
    if (ready == 0) return false;
    if (errno != EINTR) throw Disconnected("poll: " + error_text());
  }
}

sockaddr_in resolve(const std::string& host, int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  if (::inet_pton(AF_INET, host.c_str(), &address.sin_addr) == 1) return address;
  addrinfo hints{};
  hints.ai_family = AF_INET;
  addrinfo* found = nullptr;
  if (::getaddrinfo(host.c_str(), nullptr, &hints, &found) != 0 || found == nullptr)
    throw Disconnected(fmt::format("{}: no address of that name", host));
  address.sin_addr = reinterpret_cast<sockaddr_in*>(found->ai_addr)->sin_addr;
  ::freeaddrinfo(found);
  return address;
}

const sockaddr* plain(const sockaddr_in& address) { return reinterpret_cast<const sockaddr*>(&address); }

Socket make(int domain, int type) {
  Socket socket(::socket(domain, type | SOCK_CLOEXEC, 0));
  if (!socket.is_open()) throw std::runtime_error("socket: " + error_text());
  return socket;
}

void set_no_delay(const Socket& socket) {
  const int on = 1;
  ::setsockopt(socket.descriptor(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
}

sockaddr_un unix_address(const std::filesystem::path& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string text = path.string();
  if (text.size() >= sizeof address.sun_path)
    throw std::runtime_error(
        fmt::format("{}: a socket's path has at most {} characters", text, sizeof address.sun_path - 1));
  text.copy(address.sun_path, text.size());
  return address;
}

}  // namespace

Socket& Socket::operator=(Socket&& other) noexcept {
  if (this != &other) {
    close();
    descriptor_ = std::exchange(other.descriptor_, -1);
  }
  return *this;
}

void Socket::close() {
  if (descriptor_ >= 0) ::close(std::exchange(descriptor_, -1));
}

bool Socket::readable(double timeout_s) const { return wait_for(descriptor_, POLLIN, timeout_s); }

size_t Socket::receive(std::span<std::uint8_t> into) const {
  for (;;) {
    const ssize_t got = ::recv(descriptor_, into.data(), into.size(), 0);
    if (got > 0) return static_cast<size_t>(got);
    if (got == 0) throw Disconnected("the peer closed the connection");
    if (errno != EINTR) throw Disconnected("receive: " + error_text());
  }
}

void Socket::send(std::span<const std::uint8_t> bytes, double timeout_s) const {
  while (!bytes.empty()) {
    if (!wait_for(descriptor_, POLLOUT, timeout_s))
      throw Disconnected(fmt::format("the peer took nothing for {} s", timeout_s));
    const ssize_t sent = ::send(descriptor_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent >= 0) bytes = bytes.subspan(static_cast<size_t>(sent));
    else if (errno != EINTR && errno != EAGAIN) throw Disconnected("send: " + error_text());
  }
}

Socket connect_tcp(const std::string& host, int port, double timeout_s) {
  const sockaddr_in address = resolve(host, port);
  Socket socket = make(AF_INET, SOCK_STREAM);
  const int flags = ::fcntl(socket.descriptor(), F_GETFL);
  ::fcntl(socket.descriptor(), F_SETFL, flags | O_NONBLOCK);
  if (::connect(socket.descriptor(), plain(address), sizeof address) != 0) {
    if (errno != EINPROGRESS) throw Disconnected(fmt::format("{}:{}: {}", host, port, error_text()));
    if (!wait_for(socket.descriptor(), POLLOUT, timeout_s))
      throw Disconnected(fmt::format("{}:{}: no answer within {} s", host, port, timeout_s));
    int error = 0;
    socklen_t size = sizeof error;
    ::getsockopt(socket.descriptor(), SOL_SOCKET, SO_ERROR, &error, &size);
    if (error != 0) throw Disconnected(fmt::format("{}:{}: {}", host, port, std::strerror(error)));
  }
  ::fcntl(socket.descriptor(), F_SETFL, flags);
  set_no_delay(socket);
  return socket;
}

Socket listen_tcp(const std::string& address, int port) {
  const sockaddr_in local = resolve(address, port);
  Socket socket = make(AF_INET, SOCK_STREAM);
  const int on = 1;
  ::setsockopt(socket.descriptor(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  if (::bind(socket.descriptor(), plain(local), sizeof local) != 0 || ::listen(socket.descriptor(), 8) != 0)
    throw std::runtime_error(fmt::format("{}:{}: {}", address, port, error_text()));
  return socket;
}

namespace {

Socket listen_at(const std::filesystem::path& path, int type) {
  const sockaddr_un local = unix_address(path);
  Socket socket = make(AF_UNIX, type);
  std::filesystem::remove(path);
  if (::bind(socket.descriptor(), reinterpret_cast<const sockaddr*>(&local), sizeof local) != 0 ||
      ::listen(socket.descriptor(), 8) != 0)
    throw std::runtime_error(fmt::format("{}: {}", path.string(), error_text()));
  return socket;
}

Socket connect_at(const std::filesystem::path& path, int type) {
  const sockaddr_un peer = unix_address(path);
  Socket socket = make(AF_UNIX, type);
  if (::connect(socket.descriptor(), reinterpret_cast<const sockaddr*>(&peer), sizeof peer) != 0)
    throw Disconnected(fmt::format("{}: {}", path.string(), error_text()));
  return socket;
}

}  // namespace

Socket listen_seqpacket(const std::filesystem::path& path) { return listen_at(path, SOCK_SEQPACKET); }
Socket connect_seqpacket(const std::filesystem::path& path) { return connect_at(path, SOCK_SEQPACKET); }

Socket listen_unix(const std::filesystem::path& path) {
  bool taken = true;
  try {
    connect_at(path, SOCK_STREAM);
  } catch (const Disconnected&) {
    taken = false;  // nobody there, or what one that is gone left behind
  }
  if (taken) throw std::runtime_error(fmt::format("{}: another process listens there", path.string()));
  Socket socket = listen_at(path, SOCK_STREAM);
  // Folders decide who reaches it, and the listener who may do what.
  ::chmod(path.c_str(), 0666);
  return socket;
}

Socket connect_unix(const std::filesystem::path& path) { return connect_at(path, SOCK_STREAM); }

std::optional<Socket> accept(const Socket& listener, double timeout_s) {
  if (!listener.readable(timeout_s)) return std::nullopt;
  Socket socket(::accept4(listener.descriptor(), nullptr, nullptr, SOCK_CLOEXEC));
  if (!socket.is_open()) return std::nullopt;
  set_no_delay(socket);
  return socket;
}

Socket bind_udp(const std::string& address, int port) {
  const sockaddr_in local = resolve(address, port);
  Socket socket = make(AF_INET, SOCK_DGRAM);
  if (::bind(socket.descriptor(), plain(local), sizeof local) != 0)
    throw std::runtime_error(fmt::format("{}:{}: {}", address, port, error_text()));
  return socket;
}

Socket connect_udp(const std::string& host, int port) {
  const sockaddr_in peer = resolve(host, port);
  Socket socket = make(AF_INET, SOCK_DGRAM);
  if (::connect(socket.descriptor(), plain(peer), sizeof peer) != 0)
    throw Disconnected(fmt::format("{}:{}: {}", host, port, error_text()));
  return socket;
}

Socket join_multicast(const std::string& group, int port) {
  Socket socket = make(AF_INET, SOCK_DGRAM);
  const int on = 1;
  ::setsockopt(socket.descriptor(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  // Bound to the group itself, or datagrams to any other group on that port would come in too.
  const sockaddr_in address = resolve(group, port);
  ip_mreq membership{};
  membership.imr_multiaddr = address.sin_addr;
  if (::bind(socket.descriptor(), plain(address), sizeof address) != 0 ||
      ::setsockopt(socket.descriptor(), IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership) != 0)
    throw Disconnected(fmt::format("{}:{}: {}", group, port, error_text()));
  return socket;
}

Datagram receive_datagram(const Socket& socket) {
  Datagram datagram;
  datagram.bytes.resize(65536);
  sockaddr_in from{};
  socklen_t size = sizeof from;
  const ssize_t got = ::recvfrom(socket.descriptor(), datagram.bytes.data(), datagram.bytes.size(), 0,
                                 reinterpret_cast<sockaddr*>(&from), &size);
  if (got < 0) throw Disconnected("receive: " + error_text());
  datagram.bytes.resize(static_cast<size_t>(got));
  datagram.address = from.sin_addr.s_addr;
  datagram.port = from.sin_port;
  return datagram;
}

void send_datagram(const Socket& socket, const Datagram& datagram) {
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_addr.s_addr = datagram.address;
  to.sin_port = datagram.port;
  // A peer that is gone answers with an ICMP error on a later call; for UDP that is no failure of ours.
  ::sendto(socket.descriptor(), datagram.bytes.data(), datagram.bytes.size(), MSG_NOSIGNAL, plain(to), sizeof to);
}

int local_port(const Socket& socket) {
  sockaddr_in address{};
  socklen_t size = sizeof address;
  ::getsockname(socket.descriptor(), reinterpret_cast<sockaddr*>(&address), &size);
  return ntohs(address.sin_port);
}

namespace {

std::string text_of(const sockaddr_in& address) {
  char text[INET_ADDRSTRLEN] = "";
  if (address.sin_family == AF_INET) ::inet_ntop(AF_INET, &address.sin_addr, text, sizeof text);
  return text;
}

}  // namespace

std::string local_address(const Socket& socket) {
  sockaddr_in address{};
  socklen_t size = sizeof address;
  ::getsockname(socket.descriptor(), reinterpret_cast<sockaddr*>(&address), &size);
  return text_of(address);
}

std::string peer_address(const Socket& socket) {
  sockaddr_in address{};
  socklen_t size = sizeof address;
  ::getpeername(socket.descriptor(), reinterpret_cast<sockaddr*>(&address), &size);
  return text_of(address);
}

std::string address_of(const std::string& host) { return text_of(resolve(host, 0)); }

void set_patience(const Socket& socket, double seconds) {
  const unsigned milliseconds = static_cast<unsigned>(std::lround(seconds * 1e3));
  ::setsockopt(socket.descriptor(), IPPROTO_TCP, TCP_USER_TIMEOUT, &milliseconds, sizeof milliseconds);
}

}  // namespace selvedge::wire
