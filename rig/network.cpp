#include "rig/network.h"

#include <cerrno>
#include <cstring>
#include <fstream>

#include <arpa/inet.h>
#include <net/if.h>
#include <net/route.h>
#include <netinet/in.h>
#include <poll.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include "files/bad_input.h"

namespace selvedge::rig {

namespace {

constexpr const char* kGroup = "239.255.76.67";

class Socket {
 public:
  Socket() : descriptor_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {}
  ~Socket() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  operator int() const { return descriptor_; }

 private:
  int descriptor_;
};

sockaddr_in address(const char* ip, uint16_t port) {
  sockaddr_in result{};
  result.sin_family = AF_INET;
  result.sin_port = htons(port);
  ::inet_pton(AF_INET, ip, &result.sin_addr);
  return result;
}

bool write_text(const char* path, const std::string& text) {
  std::ofstream file(path);
  file << text << std::flush;
  return file.good();
}

// lo up, and 224.0.0.0/4 through it.
bool set_up_loopback() {
  Socket control;
  ifreq request{};
  std::strcpy(request.ifr_name, "lo");
  if (::ioctl(control, SIOCGIFFLAGS, &request) != 0) return false;
  request.ifr_flags |= IFF_UP | IFF_RUNNING;
  if (::ioctl(control, SIOCSIFFLAGS, &request) != 0) return false;

  rtentry route{};
  char device[] = "lo";
  const sockaddr_in destination = address("224.0.0.0", 0), mask = address("240.0.0.0", 0);
  std::memcpy(&route.rt_dst, &destination, sizeof destination);
  std::memcpy(&route.rt_genmask, &mask, sizeof mask);
  route.rt_flags = RTF_UP;
  route.rt_dev = device;
  return ::ioctl(control, SIOCADDRT, &route) == 0 || errno == EEXIST;
}

bool enter_private_network() {
  const auto user = ::getuid();
  const auto group = ::getgid();
  if (::unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) return false;
  // Root inside, so that lo can be set up; files keep their owner.
  return write_text("/proc/self/setgroups", "deny") && write_text("/proc/self/uid_map", fmt::format("0 {} 1", user)) &&
         write_text("/proc/self/gid_map", fmt::format("0 {} 1", group)) && set_up_loopback();
}

}  // namespace

bool multicast_works(uint16_t port) {
  Socket receiver, sender;
  const int yes = 1, ttl = 0;
  ::setsockopt(receiver, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  ::setsockopt(receiver, SOL_SOCKET, SO_REUSEPORT, &yes, sizeof yes);
  const sockaddr_in local = address("0.0.0.0", port), group = address(kGroup, port);
  if (::bind(receiver, reinterpret_cast<const sockaddr*>(&local), sizeof local) != 0) return false;
  ip_mreq membership{};
  membership.imr_multiaddr = group.sin_addr;
  if (::setsockopt(receiver, IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership) != 0) return false;
  ::setsockopt(sender, IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof ttl);

  // Not an LCM packet: whoever else listens on the port drops it.
  const std::string probe = fmt::format("selvedge probe {}", ::getpid());
  if (::sendto(sender, probe.data(), probe.size(), 0, reinterpret_cast<const sockaddr*>(&group), sizeof group) < 0)
    return false;
  for (pollfd ready{receiver, POLLIN, 0}; ::poll(&ready, 1, 1000) > 0;) {
    char answer[64];
    const ssize_t size = ::recv(receiver, answer, sizeof answer, 0);
    if (size >= 0 && probe == std::string(answer, static_cast<size_t>(size))) return true;
  }
  return false;
}

std::string multicast_advice() {
  return "this host has no route for multicast, which the bus needs; run once:\n"
         "    sudo ip route add 224.0.0.0/4 dev lo";
}

bool ensure_local_multicast(uint16_t port) {
  if (multicast_works(port)) return false;
  if (enter_private_network() && multicast_works(port)) return true;
  refuse("bus", "{}", multicast_advice());
}

int granted_receive_buffer_bytes(int wanted_bytes) {
  Socket socket;
  int granted = 0;
  socklen_t size = sizeof granted;
  ::setsockopt(socket, SOL_SOCKET, SO_RCVBUF, &wanted_bytes, sizeof wanted_bytes);
  ::getsockopt(socket, SOL_SOCKET, SO_RCVBUF, &granted, &size);
  return granted / 2;  // the kernel doubles the request for its own bookkeeping
}

}  // namespace selvedge::rig
