#include "rig/bus_filter.h"

#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <string>
#include <system_error>

#include <linux/filter.h>
#include <linux/if_packet.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include "files/bad_input.h"

namespace selvedge::rig {

namespace {

bool is_bound_udp(int descriptor, uint16_t port) {
  int type = 0;
  socklen_t size = sizeof type;
  if (::getsockopt(descriptor, SOL_SOCKET, SO_TYPE, &type, &size) != 0 || type != SOCK_DGRAM) return false;
  sockaddr_in address{};
  size = sizeof address;
  return ::getsockname(descriptor, reinterpret_cast<sockaddr*>(&address), &size) == 0 &&
         address.sin_family == AF_INET && ntohs(address.sin_port) == port;
}

// The program reads what the kernel knows of a packet (SKF_AD_…) and the packet itself from its UDP header on.
// LCM's packets: "LC02" opens a message in one piece; "LC03" a piece of a larger one, with number, size of the message
// and offset of the piece behind it. LCM adds offset and length in 32 bits before it looks whether they lie within the
// message: an offset beyond the size passes where the sum wraps. Sizes above 2^28 it refuses itself.
void attach_filter(int descriptor) {
  const unsigned lo = ::if_nametoindex("lo");
  if (lo == 0) refuse("bus", "this host has no interface lo: {}", std::strerror(errno));
  constexpr uint32_t kInterface = static_cast<uint32_t>(SKF_AD_OFF + SKF_AD_IFINDEX);
  constexpr uint32_t kPacketType = static_cast<uint32_t>(SKF_AD_OFF + SKF_AD_PKTTYPE);
  constexpr uint32_t kMagicAt = 8, kSizeAt = 16, kOffsetAt = 20;
  constexpr uint32_t kPieceMagic = 0x4c433033;
  sock_filter program[] = {
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kInterface), BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, lo, 2, 0),
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kPacketType), BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, PACKET_LOOPBACK, 0, 7),
      // Of this host: a whole message, or a piece within its message.
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kMagicAt), BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, kPieceMagic, 0, 4),
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kOffsetAt), BPF_STMT(BPF_MISC | BPF_TAX, 0),
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kSizeAt), BPF_JUMP(BPF_JMP | BPF_JGT | BPF_X, 0, 0, 1),
      BPF_STMT(BPF_RET | BPF_K, 0xffffffff),  // all of it
      BPF_STMT(BPF_RET | BPF_K, 0),           // none
  };
  const sock_fprog filter{sizeof program / sizeof *program, program};
  if (::setsockopt(descriptor, SOL_SOCKET, SO_ATTACH_FILTER, &filter, sizeof filter) != 0)
    refuse("bus", "the kernel takes no filter for the bus's socket: {}", std::strerror(errno));
}

}  // namespace

int hear_this_host_alone(uint16_t port) {
  int found = 0;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd", error)) {
    const std::string name = entry.path().filename().string();
    int descriptor = -1;
    std::from_chars(name.data(), name.data() + name.size(), descriptor);
    if (!is_bound_udp(descriptor, port)) continue;
    attach_filter(descriptor);
    ++found;
  }
  if (found == 0)
    refuse("bus", "no UDP socket of this process is bound to port {}{}{}, expected LCM's: it would hear other hosts",
           port, error ? ", /proc/self/fd: " : "", error ? error.message() : "");
  return found;
}

}  // namespace selvedge::rig
