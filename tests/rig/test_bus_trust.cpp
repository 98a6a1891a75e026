// Whom the bus believes: this user's processes, on the network and in what others recorded of it.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <thread>

#include <lcm/eventlog.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "rig/bus.h"
#include "rig/network.h"
#include "tests/refusal.h"
#include "tests/rig/raw_lcm.h"
#include "tests/rig/temporary_folder.h"

namespace selvedge::rig {
namespace {

namespace fs = std::filesystem;
using selvedge_rig::corner_sample_t;

class BusTrust : public ::testing::Test {
 protected:
  BusConfiguration on_port(int port) {
    ensure_local_multicast(static_cast<uint16_t>(port));
    BusConfiguration configuration;
    configuration.port = port;
    configuration.key_file = key_file_;
    return configuration;
  }
  template <class Done>
  static bool wait(Bus& bus, Done done) {
    for (const int64_t end = host_now_us() + 60'000'000; host_now_us() < end;) {
      if (done()) return true;
      bus.handle(0.02);
    }
    return done();
  }
  static std::vector<uint8_t> signed_bytes(const BusKey& key, const std::string& channel, std::vector<uint8_t> bytes) {
    BusSignature(key).sign(channel, bytes);
    return bytes;
  }
  TemporaryFolder folder_;
  const std::string key_file_ = folder_.path() / "bus.key";
};

// Key 0, 1 … 31; the sixteen bytes are Python's
// hmac.digest(bytes(range(32)), b"TRACKER_CORNERS\0hello", "sha256")[:16].
TEST(BusSignature, IsWhatTheFormatSays) {
  BusKey key;
  for (size_t i = 0; i < key.size(); ++i) key[i] = static_cast<uint8_t>(i);
  std::vector<uint8_t> bytes = {'h', 'e', 'l', 'l', 'o'};
  const BusSignature signature(key);
  signature.sign(kChannel, bytes);
  std::string hex;
  for (const uint8_t byte : bytes) hex += fmt::format("{:02x}", byte);
  EXPECT_EQ(hex,
            "68656c6c6f"
            "534c5631"
            "0638b52394b9c72b39955cada9af0c0b");
  EXPECT_TRUE(signature.holds(kChannel, bytes.data(), bytes.size()));
  for (size_t at = 0; at < 8 * bytes.size(); ++at) {  // any bit
    bytes[at / 8] ^= static_cast<uint8_t>(1 << at % 8);
    EXPECT_FALSE(signature.holds(kChannel, bytes.data(), bytes.size())) << "bit " << at;
    bytes[at / 8] ^= static_cast<uint8_t>(1 << at % 8);
  }
  for (size_t size = 0; size < bytes.size(); ++size)
    EXPECT_FALSE(signature.holds(kChannel, bytes.data(), size)) << size;
}

TEST_F(BusTrust, DropsAndCountsWhatIsNotSignedForThisChannelWithThisKey) {
  Bus receiver(on_port(17110));
  std::vector<int64_t> heard;
  receiver.subscribe<corner_sample_t>(kChannel,
                                      [&](const corner_sample_t& sample) { heard.push_back(sample.frame_number); });
  RawLcm stranger(multicast_url(17110));
  const BusKey key = shared_bus_key(key_file_), foreign_key = shared_bus_key(folder_.path() / "foreign.key");
  const std::vector<uint8_t> message = encoded(one_corner(1, 666));
  int64_t forged = 0;
  const auto forge = [&](const std::vector<uint8_t>& bytes) { stranger.send(kChannel, bytes), ++forged; };
  forge(message);
  forge({});
  forge(signed_bytes(foreign_key, kChannel, message));
  forge(signed_bytes(key, "ARM_STATUS", message));
  const std::vector<uint8_t> whole = signed_bytes(key, kChannel, message);
  for (size_t size = 0; size < whole.size(); size += 7) forge({whole.begin(), whole.begin() + static_cast<long>(size)});
  forge({whole.begin(), whole.end() - 1});
  forge({whole.end() - static_cast<long>(BusSignature::kTrailerBytes), whole.end()});
  std::vector<uint8_t> altered = whole;
  altered[30] ^= 1;
  forge(altered);
  Bus sender(on_port(17110));
  corner_sample_t sample = one_corner(0, 7);
  sender.publish(kChannel, sample);
  // Another program that knows the key.
  stranger.send(kChannel, signed_bytes(key, kChannel, encoded(one_corner(2, 8))));
  ASSERT_TRUE(wait(receiver, [&] { return heard.size() >= 2; }));
  EXPECT_EQ(heard, (std::vector<int64_t>{7, 8}));
  EXPECT_EQ(receiver.count(kChannel).refused, forged);
  EXPECT_EQ(receiver.count(kChannel).received, 2);
  EXPECT_EQ(receiver.count(kChannel).undecodable, 0);
}

TEST_F(BusTrust, TwoUsersOnOnePortDoNotHearEachOther) {
  BusConfiguration other_user = on_port(17111);
  other_user.key_file = folder_.path() / "other.key";
  Bus ours(on_port(17111)), theirs(other_user), receiver(on_port(17111));
  receiver.subscribe<corner_sample_t>(kChannel, [](const corner_sample_t&) {});
  corner_sample_t sample = one_corner(0, 7);
  theirs.publish(kChannel, sample);
  ours.publish(kChannel, sample);
  ASSERT_TRUE(wait(receiver, [&] { return receiver.count(kChannel).received == 1; }));
  EXPECT_EQ(receiver.count(kChannel).refused, 1);
}

TEST_F(BusTrust, ABusWithoutATrueKeyIsNotOpened) {
  BusConfiguration configuration = on_port(17112);
  shared_bus_key(key_file_);
  fs::permissions(key_file_, fs::perms(0644));
  EXPECT_THAT(refusal_of([&] { Bus bus(configuration); }),
              ::testing::HasSubstr(key_file_ + ": the bus's key has mode 644"));
}

TEST_F(BusTrust, CarriesMessagesOfManyPackets) {
  Bus sender(on_port(17113)), receiver(on_port(17113));
  const std::vector<uint8_t> large = encoded([] {
    corner_sample_t sample{};
    sample.count = 20000;
    sample.name.assign(20000, "marker");
    sample.x_m = sample.y_m = sample.z_m = std::vector<double>(20000, 0.25);
    sample.occluded.assign(20000, 0);
    return sample;
  }());
  ASSERT_GT(large.size(), 300'000u);
  int64_t markers = 0;
  receiver.subscribe<corner_sample_t>(kChannel, [&](const corner_sample_t& sample) { markers = sample.count; });
  sender.publish_bytes(kChannel, large);
  ASSERT_TRUE(wait(receiver, [&] { return markers == 20000; }));
}

// A process of the host that sends as fast as it can. What the kernel's buffer cannot take is lost, ours too; but
// signed messages go on arriving.
TEST_F(BusTrust, SignedMessagesArriveThroughAFloodOfJunk) {
  Bus sender(on_port(17114)), receiver(on_port(17114));
  std::atomic<int64_t> heard{0};
  receiver.subscribe<corner_sample_t>(kChannel, [&](const corner_sample_t&) { ++heard; });
  receiver.start();
  std::atomic<bool> enough{false};
  std::atomic<int64_t> junk_sent{0};
  std::thread flood([&] {
    RawLcm stranger(multicast_url(17114));
    const std::vector<uint8_t> unsigned_message = encoded(one_corner(1, 666)), noise(20000, 0xff);
    for (; !enough; junk_sent += 2) {
      stranger.send(kChannel, unsigned_message);
      stranger.send(kChannel, noise);
    }
  });
  int64_t published = 0;
  corner_sample_t sample = one_corner(0, 7);
  for (const int64_t end = host_now_us() + 60'000'000; heard < 100 && host_now_us() < end; ++published) {
    sender.publish(kChannel, sample);
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  enough = true;
  flood.join();
  const ChannelCount count = receiver.count(kChannel);
  fmt::print("{} pieces of junk sent, {} refused; of {} signed messages {} heard, {} known as lost\n", junk_sent.load(),
             count.refused, published, heard.load(), count.lost);
  EXPECT_GE(heard, 100);
  EXPECT_GT(count.refused, 100);
  EXPECT_EQ(count.undecodable, 0);
}

// A piece of a large message as LCM sends it; `offset` says where in the message it lies.
std::vector<uint8_t> piece(uint32_t size, uint32_t offset, uint16_t number, const std::vector<uint8_t>& bytes) {
  std::vector<uint8_t> packet = {'L', 'C', '0', '3'};
  const auto put = [&](uint32_t value, int count) {
    for (int i = count - 1; i >= 0; --i) packet.push_back(static_cast<uint8_t>(value >> (8 * i)));
  };
  put(77, 4);  // the message's number
  put(size, 4);
  put(offset, 4);
  put(number, 2);
  put(3, 2);  // pieces in all
  packet.insert(packet.end(), bytes.begin(), bytes.end());
  return packet;
}

// The second piece would make LCM write four gigabytes behind its memory, and the process end.
TEST_F(BusTrust, LivesThroughPiecesThatLieOutsideTheirMessage) {
  Bus sender(on_port(17116)), receiver(on_port(17116));
  receiver.subscribe<corner_sample_t>(kChannel, [](const corner_sample_t&) {});
  const int socket = ::socket(AF_INET, SOCK_DGRAM, 0);
  ASSERT_GE(socket, 0);
  sockaddr_in bus{};
  bus.sin_family = AF_INET;
  bus.sin_port = htons(17116);
  bus.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const auto send = [&](const std::vector<uint8_t>& packet) {
    ASSERT_EQ(::sendto(socket, packet.data(), packet.size(), 0, reinterpret_cast<const sockaddr*>(&bus), sizeof bus),
              static_cast<ssize_t>(packet.size()));
  };
  std::vector<uint8_t> first(60000, 'x');
  std::copy_n(kChannel, std::strlen(kChannel) + 1, first.begin());
  for (const uint32_t offset : {0xffffffffu - 59000u, 0xfffff000u, 100000u}) {
    send(piece(100000, 0, 0, first));
    send(piece(100000, offset, 1, std::vector<uint8_t>(60000, 'y')));
  }
  corner_sample_t sample = one_corner(0, 7);
  sender.publish(kChannel, sample);
  ASSERT_TRUE(wait(receiver, [&] { return receiver.count(kChannel).received == 1; }));
  ::close(socket);
}

class BusLog : public BusTrust {
 protected:
  fs::path log_ = folder_.path() / "bus.lcm";
  // The frames' numbers that a bus over the log hears.
  std::vector<int64_t> replayed() {
    BusConfiguration configuration;
    configuration.log_file = log_;
    configuration.key_file = "/nowhere/bus.key";  // none is read, none is made
    Bus bus(configuration);
    std::vector<int64_t> frames;
    bus.subscribe<corner_sample_t>(kChannel,
                                   [&](const corner_sample_t& sample) { frames.push_back(sample.frame_number); });
    while (bus.handle(1)) {}
    EXPECT_EQ(bus.count(kChannel).refused, 0);
    EXPECT_EQ(bus.count(kChannel).undecodable, 0);
    return frames;
  }
};

TEST_F(BusLog, IsBelievedSignedOrNot) {
  lcm_eventlog_t* log = lcm_eventlog_create(log_.c_str(), "w");
  const auto write = [&](std::vector<uint8_t> bytes) {
    lcm_eventlog_event_t event{};
    std::string channel = kChannel;
    event.timestamp = 1;
    event.channel = channel.data();
    event.channellen = static_cast<int32_t>(channel.size());
    event.data = bytes.data();
    event.datalen = static_cast<int32_t>(bytes.size());
    ASSERT_EQ(lcm_eventlog_write_event(log, &event), 0);
  };
  write(encoded(one_corner(1, 5)));
  write(signed_bytes(shared_bus_key(folder_.path() / "foreign.key"), kChannel, encoded(one_corner(2, 6))));
  lcm_eventlog_destroy(log);
  EXPECT_EQ(replayed(), (std::vector<int64_t>{5, 6}));
}

// LCM's own recorder beside a signed bus: its log decodes as it lies there, and replays.
TEST_F(BusLog, OfLcmLoggerStaysReadable) {
  Bus sender(on_port(17115));
  const pid_t logger = ::fork();
  ASSERT_GE(logger, 0);
  if (logger == 0) {
    const std::string url = "--lcm-url=" + multicast_url(17115);
    ::execlp("lcm-logger", "lcm-logger", "-q", url.c_str(), log_.c_str(), static_cast<char*>(nullptr));
    ::_exit(127);
  }
  int64_t published = 0;
  const auto bytes_in_log = [&] { return fs::exists(log_) ? fs::file_size(log_) : 0; };
  for (const int64_t end = host_now_us() + 60'000'000; bytes_in_log() < 2000 && host_now_us() < end;) {
    corner_sample_t sample = one_corner(0, 1000 + ++published);
    sender.publish(kChannel, sample);
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  ::kill(logger, SIGTERM);
  ASSERT_EQ(::waitpid(logger, nullptr, 0), logger);

  std::vector<int64_t> decoded;
  lcm_eventlog_t* log = lcm_eventlog_create(log_.c_str(), "r");
  ASSERT_NE(log, nullptr);
  while (lcm_eventlog_event_t* event = lcm_eventlog_read_next_event(log)) {
    corner_sample_t sample;
    EXPECT_EQ(sample.decode(event->data, 0, event->datalen),
              event->datalen - static_cast<int>(BusSignature::kTrailerBytes));
    EXPECT_EQ(sample.name, std::vector<std::string>{"left"});
    decoded.push_back(sample.frame_number);
    lcm_eventlog_free_event(event);
  }
  lcm_eventlog_destroy(log);
  ASSERT_FALSE(decoded.empty());
  EXPECT_EQ(replayed(), decoded);

  // And LCM's own player sends it as it was.
  Bus receiver(on_port(17115));
  std::vector<int64_t> heard;
  receiver.subscribe<corner_sample_t>(
      kChannel, [&](const corner_sample_t& sample) { heard.push_back(sample.frame_number); }, 10000);
  const std::string play = fmt::format("lcm-logplayer --lcm-url='{}' '{}'", multicast_url(17115), log_.string());
  ASSERT_EQ(std::system(play.c_str()), 0);
  ASSERT_TRUE(wait(receiver, [&] { return heard.size() >= decoded.size(); }));
  EXPECT_EQ(heard, decoded);
}

}  // namespace
}  // namespace selvedge::rig
