// The kernel's filter before the bus's receive socket: packets of this host's own network, and no piece of a message
// that lies outside it.
//
// LCM receives on 0.0.0.0, whatever the `ttl` it sends with, and hands out no socket. Its sockets are found among this
// process's: UDP over IPv4, bound to the bus's port. The filter (classic BPF) lets through what came over lo and
// multicast that this host sent and looped back to itself; another host's packets never reach LCM's code. Between the
// socket's making and the filter, once a process, lies about a millisecond in which they do.
// Pieces of large messages whose offset lies beyond the message's size make LCM 1.3.1 write outside its memory (LCM's
// pull request 628, open); they are dropped whoever sends them.
// Source: socket(7) SO_ATTACH_FILTER, packet(7), linux/filter.h (SKF_AD_IFINDEX, SKF_AD_PKTTYPE);
// the packets: LCM's "UDP multicast protocol description".
#pragma once

#include <cstdint>

namespace selvedge::rig {

// Puts the filter before each such socket. Returns how many there are; throws BadInput where there is none, or the
// kernel will not: a bus that hears everybody must not look like one that does not.
int hear_this_host_alone(uint16_t port);

}  // namespace selvedge::rig
