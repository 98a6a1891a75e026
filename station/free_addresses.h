// Ports and loopback addresses that nobody uses, so that several simulated rigs run side by side.
//
// Free means: could be bound a moment ago. Two processes that ask in the same moment may get the same; the one
// that binds second says so.
#pragma once

#include <string>

namespace selvedge::station {

int free_tcp_port();
// For the bus: nobody on this host listens to it, not even with a shared address.
int free_bus_port();
// 127.x.y.z on which UDP port 3956, which GigE Vision fixes, is free.
std::string free_camera_address();

}  // namespace selvedge::station
