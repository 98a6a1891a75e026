// Whether this machine can carry the bus (UDP multicast that stays on the host), and a private network that
// always can.
//
// LCM needs a route to 239.255.76.67. A default route is enough; a host with lo alone needs
//   sudo ip route add 224.0.0.0/4 dev lo
// A process that has no such route and no root can still make its own network namespace (unshare -rn) with
// lo up and that route; its children share it. That network reaches no real device, so only the simulated
// rig and the tests use it.
#pragma once

#include <cstdint>
#include <string>

namespace selvedge::rig {

// Sends one multicast datagram (ttl 0) to itself on `port` and waits up to a second for it.
bool multicast_works(uint16_t port);

// The text a person needs where multicast_works says no.
std::string multicast_advice();

// Leaves alone a host where multicast works. Elsewhere moves this process into a private network.
// Call first in main: the kernel refuses a process that has threads. Throws BadInput with the advice where
// neither works. Returns true where the process moved.
bool ensure_local_multicast(uint16_t port);

// What the kernel grants of a wanted socket receive buffer, bytes.
int granted_receive_buffer_bytes(int wanted_bytes);

}  // namespace selvedge::rig
