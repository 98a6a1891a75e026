// Another network namespace, joined to the bus's by a cable (a veth pair): a host beside the rig's, as the kernel
// tells. It knows the key, so the kernel's filter alone keeps it out.
//
// Namespaces of the test's own, in a user namespace: no root, and nothing of the host's network is touched.
#include "rig/bus_filter.h"

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>
#include <thread>

#include <arpa/inet.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "rig/bus.h"
#include "tests/refusal.h"
#include "tests/rig/raw_lcm.h"
#include "tests/rig/temporary_folder.h"

namespace selvedge::rig {
namespace {

using selvedge_rig::corner_sample_t;

constexpr int kPort = 17120;
constexpr int64_t kLocal = 1, kForeign = 666;

struct Heard {
  int64_t local = 0, foreign = 0, refused = 0, dropped_by_kernel = 0;
};

void require(bool done, const std::string& what) {
  if (!done) throw std::runtime_error(fmt::format("{}: {}", what, std::strerror(errno)));
}

void run(const std::string& command) { require(std::system(command.c_str()) == 0, command); }

void write_text(const char* path, const std::string& text) {
  std::ofstream file(path);
  file << text << std::flush;
  require(file.good(), path);
}

// The user becomes root of namespaces that are gone with the process.
void enter_private_network() {
  const auto user = ::geteuid();
  const auto group = ::getegid();
  require(::unshare(CLONE_NEWUSER | CLONE_NEWNET) == 0, "a user namespace, which this test needs");
  write_text("/proc/self/setgroups", "deny");
  write_text("/proc/self/uid_map", fmt::format("0 {} 1", user));
  write_text("/proc/self/gid_map", fmt::format("0 {} 1", group));
}

// LCM's packet for a message that fits in one: magic, number, channel, bytes.
std::vector<uint8_t> lcm_packet(const std::vector<uint8_t>& message) {
  std::vector<uint8_t> packet = {'L', 'C', '0', '2', 0, 0, 0, 1};
  packet.insert(packet.end(), kChannel, kChannel + std::strlen(kChannel) + 1);
  packet.insert(packet.end(), message.begin(), message.end());
  return packet;
}

// The other host: true messages to the group and to the rig's address, until it is killed.
[[noreturn]] void be_the_other_host(const BusKey& key, int ready, int go) {
  require(::prctl(PR_SET_PDEATHSIG, SIGKILL) == 0 && ::unshare(CLONE_NEWNET) == 0, "the other host's network");
  char byte = 0;
  require(::write(ready, &byte, 1) == 1 && ::read(go, &byte, 1) == 1, "the other host's start");
  run("ip link set lo up && ip addr add 10.0.0.2/24 dev there && ip link set there up && "
      "ip route add default via 10.0.0.1");
  std::vector<uint8_t> message = encoded(one_corner(1, kForeign));
  BusSignature(key).sign(kChannel, message);
  const std::vector<uint8_t> packet = lcm_packet(message);
  RawLcm lcm(multicast_url(kPort, 1));
  const int unicast = ::socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in rig{AF_INET, htons(kPort), {}, {}};
  ::inet_pton(AF_INET, "10.0.0.1", &rig.sin_addr);
  for (;;) {
    lcm.send(kChannel, message);
    ::sendto(unicast, packet.data(), packet.size(), 0, reinterpret_cast<const sockaddr*>(&rig), sizeof rig);
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
}

// The last column of the row of the bus's port: packets that reached a socket and went no further.
int64_t dropped_by_kernel() {
  std::ifstream table("/proc/thread-self/net/udp");
  int64_t sum = 0;
  for (std::string line; std::getline(table, line);) {
    if (line.find(fmt::format(":{:04X} ", kPort)) == std::string::npos) continue;
    sum += std::stoll(line.substr(line.find_last_of(' ', line.find_last_not_of(' '))));
  }
  return sum;
}

// The rig's host: a bus between its own messages and the other host's, until enough of both have come or been dropped.
Heard be_the_rig(const std::string& route, const BusConfiguration& configuration) {
  enter_private_network();
  int ready[2], go[2];
  require(::pipe(ready) == 0 && ::pipe(go) == 0, "pipes");
  const BusKey key = shared_bus_key(configuration.key_file);
  const pid_t other = ::fork();
  require(other >= 0, "the other host");
  if (other == 0) be_the_other_host(key, ready[1], go[0]);
  char byte = 0;
  require(::read(ready[0], &byte, 1) == 1, "the other host's readiness");
  run(
      fmt::format("ip link set lo up && ip link add here type veth peer name there netns {} && "
                  "ip addr add 10.0.0.1/24 dev here && ip link set here up && ip route add {}",
                  other, route));
  Heard heard;
  Bus receiver(configuration), sender(configuration);
  receiver.subscribe<corner_sample_t>(kChannel, [&](const corner_sample_t& sample) {
    (sample.frame_number == kLocal ? heard.local : heard.foreign) += 1;
  });
  // The group's packets come by the cable in any case, also where the rig's own go over lo.
  const int member = ::socket(AF_INET, SOCK_DGRAM, 0);
  ip_mreq membership{};
  ::inet_pton(AF_INET, "239.255.76.67", &membership.imr_multiaddr);
  ::inet_pton(AF_INET, "10.0.0.1", &membership.imr_interface);
  const bool joined = ::setsockopt(member, IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership) == 0;
  require(joined || errno == EADDRINUSE, "membership");
  require(::write(go[1], &byte, 1) == 1, "the other host's start");
  corner_sample_t sample = one_corner(0, kLocal);
  for (const int64_t end = host_now_us() + 60'000'000; host_now_us() < end;) {
    sender.publish(kChannel, sample);
    for (int i = 0; i < 10; ++i) receiver.handle(0.001);
    heard.refused = receiver.count(kChannel).refused;
    heard.dropped_by_kernel = dropped_by_kernel();
    if (heard.local >= 20 && heard.foreign + heard.refused + heard.dropped_by_kernel >= 200) break;
  }
  ::kill(other, SIGKILL);
  ::waitpid(other, nullptr, 0);
  return heard;
}

// be_the_rig in a process of its own: the test's stays in its network.
Heard heard_with(const std::string& route, const BusConfiguration& configuration) {
  int out[2];
  require(::pipe(out) == 0, "a pipe");
  const pid_t rig = ::fork();
  require(rig >= 0, "the rig's process");
  if (rig == 0) {
    ::close(out[0]);
    try {
      const Heard heard = be_the_rig(route, configuration);
      ::_exit(::write(out[1], &heard, sizeof heard) == sizeof heard ? 0 : 1);
    } catch (const std::exception& error) {
      fmt::print(stderr, "{}\n", error.what());
      ::_exit(1);
    }
  }
  ::close(out[1]);
  Heard heard;
  const bool whole = ::read(out[0], &heard, sizeof heard) == sizeof heard;
  ::close(out[0]);
  int status = 0;
  ::waitpid(rig, &status, 0);
  EXPECT_TRUE(whole && status == 0) << "the namespaces did not come up; the cause stands above";
  return heard;
}

class BusFilter : public ::testing::TestWithParam<const char*> {
 protected:
  BusConfiguration configuration() const {
    BusConfiguration result;
    result.port = kPort;
    result.key_file = folder_.path() / "bus.key";
    result.receive_buffer_bytes = 65536;
    return result;
  }
  TemporaryFolder folder_;
};

TEST_P(BusFilter, KeepsOutTheHostAtTheOtherEndOfTheCable) {
  const Heard heard = heard_with(GetParam(), configuration());
  fmt::print("local {}, foreign {}, refused {}, dropped by the kernel {}\n", heard.local, heard.foreign, heard.refused,
             heard.dropped_by_kernel);
  EXPECT_GE(heard.local, 20);
  EXPECT_GE(heard.dropped_by_kernel, 200) << "nothing came from the other host: this test would show nothing";
  EXPECT_EQ(heard.foreign, 0);
  EXPECT_EQ(heard.refused, 0);
}

INSTANTIATE_TEST_SUITE_P(Routes, BusFilter, ::testing::Values("default via 10.0.0.2 dev here", "224.0.0.0/4 dev lo"),
                         [](const auto& route) { return route.index == 0 ? "OverTheCable" : "OverLoopback"; });

TEST(BusFilterSearch, WithoutASocketIsAnError) {
  EXPECT_THAT(refusal_of([] { hear_this_host_alone(17121); }), ::testing::HasSubstr("bound to port 17121"));
}

}  // namespace
}  // namespace selvedge::rig
