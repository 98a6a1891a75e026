// The simulated camera against clients that are not ours: Aravis's own tools, unmodified, and bytes that no client
// would send.
#include <string>

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "files/bad_input.h"
#include "tests/camera/bench.h"
#include "tests/camera/clients.h"
#include "tests/needs_package.h"

namespace selvedge::sim {
namespace {

using camera::installed;
using camera::number_after;
using camera::output;
using ::testing::HasSubstr;

std::unique_ptr<GigeCamera> camera(const std::string& address, GigeCameraOptions options = {}) {
  options.address = address;
  return std::make_unique<GigeCamera>(options, [options](double time_s, uint8_t* pixels) {
    camera::paint(time_s, pixels, static_cast<size_t>(options.width_px) * static_cast<size_t>(options.height_px));
    return true;
  });
}

TEST(GigeCamera, ArvToolReadsAndWritesFeatures) {
  SELVEDGE_NEEDS(installed("arv-tool-0.8"), "aravis-tools-cli", "arv-tool on the simulated camera");
  const auto device = camera("127.0.4.1");
  const std::string text = output(
      "arv-tool-0.8 -a 127.0.4.1 control Width Height PixelFormat ExposureTime=5000 "
      "ExposureTime AcquisitionFrameRate=12.5 AcquisitionFrameRate DeviceModelName "
      "GevTimestampControlLatch GevTimestampValue TriggerSource=Line0 TriggerSource");
  EXPECT_THAT(text, AllOf(HasSubstr("Width = 640"), HasSubstr("Height = 480"), HasSubstr("PixelFormat = Mono8"),
                          HasSubstr("ExposureTime = 5000"), HasSubstr("AcquisitionFrameRate = 12.5"),
                          HasSubstr("Simulated GigE camera"), HasSubstr("TriggerSource = Line0")));
  EXPECT_GT(number_after(text, "GevTimestampValue"), 0) << text;
  EXPECT_THAT(output("arv-tool-0.8 -a 127.0.4.1 control Width=100"), HasSubstr("invalid-parameter"));
  EXPECT_THAT(
      output(
          "arv-tool-0.8 -a 127.0.4.1 control PtpEnable=true PtpEnable PtpDataSetLatch PtpStatus PtpOffsetFromMaster"),
      AllOf(HasSubstr("PtpEnable = true"), HasSubstr("PtpStatus = Listening"), HasSubstr("PtpOffsetFromMaster = 0")));
}

TEST(GigeCamera, ArvCameraTestStreamsFromIt) {
  SELVEDGE_NEEDS(installed("arv-camera-test-0.8"), "aravis-tools", "arv-camera-test on the simulated camera");
  const auto device = camera("127.0.4.2");
  GigeCameraFaults faults;
  faults.stream_loss = 0.01;
  device->set_faults(faults);
  const std::string text = output(
      "timeout 60 arv-camera-test-0.8 -n 127.0.4.2 --no-packet-socket -i 9000 "
      "--packet-request-ratio=2 --duration 2");
  const int64_t whole = number_after(text, "n_completed_buffers"), failed = number_after(text, "n_failures");
  EXPECT_GT(whole, 20) << text;
  EXPECT_LT(failed, whole / 2) << text;  // its own socket buffer is small, so a busy machine costs frames
  EXPECT_GT(number_after(text, "n_resent_packets"), 0) << text;
  EXPECT_GT(device->counts().packets_resent, 0);
}

TEST(GigeCamera, IsFoundByBroadcast) {
  SELVEDGE_NEEDS(installed("arv-tool-0.8"), "aravis-tools-cli", "arv-tool on the simulated camera");
  GigeCameraOptions options;
  options.serial = "FINDME";
  const auto device = camera("127.0.4.3", options);
  const std::string text = output("arv-tool-0.8");
  if (text.find("No device found") != std::string::npos)
    GTEST_SKIP() << "skipped: this host's loopback carries no broadcast";
  EXPECT_THAT(text, HasSubstr("FINDME"));
}

// A client of our own, byte by byte.
class RawClient {
 public:
  explicit RawClient(const std::string& address) : socket_(::socket(AF_INET, SOCK_DGRAM, 0)) {
    sockaddr_in device{};
    device.sin_family = AF_INET;
    device.sin_port = htons(3956);
    ::inet_pton(AF_INET, address.c_str(), &device.sin_addr);
    ::connect(socket_, reinterpret_cast<sockaddr*>(&device), sizeof device);
  }
  ~RawClient() { ::close(socket_); }
  std::vector<uint8_t> ask(const std::vector<uint8_t>& request, int timeout_ms = 5000) {
    ::send(socket_, request.data(), request.size(), 0);
    pollfd ready{socket_, POLLIN, 0};
    if (::poll(&ready, 1, timeout_ms) <= 0) return {};
    std::vector<uint8_t> answer(2048);
    answer.resize(static_cast<size_t>(::recv(socket_, answer.data(), answer.size(), 0)));
    return answer;
  }

 private:
  int socket_;
};

TEST(GigeCamera, AnswersWithTheStandardsErrors) {
  const auto device = camera("127.0.4.5");
  RawClient client("127.0.4.5");
  const auto error = [&](std::vector<uint8_t> request) {
    const auto answer = client.ask(request);
    return answer.size() < 2 ? -1 : answer[0] << 8 | answer[1];
  };
  const std::vector<uint8_t> take_control = {0x42, 1, 0, 0x82, 0, 8, 0, 1, 0, 0, 0x0a, 0, 0, 0, 0, 2};
  EXPECT_EQ(error({0x42, 1, 0, 0x99, 0, 0, 0, 9}), 0x8001);                              // no such command
  EXPECT_EQ(error({0x42, 1, 0, 0x80, 0, 4, 0, 10, 0, 0, 0, 2}), 0x8005);                 // alignment
  EXPECT_EQ(error({0x42, 1, 0, 0x80, 0, 4, 0, 11, 0x7f, 0, 0, 0}), 0x8003);              // address
  EXPECT_EQ(error({0x42, 1, 0, 0x82, 0, 8, 0, 12, 0, 1, 0, 0x2c, 0, 0, 0, 1}), 0x8006);  // not in control
  EXPECT_EQ(error(take_control), 0);
  EXPECT_EQ(error({0x42, 1, 0, 0x82, 0, 8, 0, 13, 0, 0, 0, 0, 0, 0, 0, 1}), 0x8004);     // read-only
  EXPECT_EQ(error({0x42, 1, 0, 0x82, 0, 8, 0, 14, 0, 1, 0, 0x2c, 0, 0, 0, 9}), 0x8002);  // out of range
  RawClient stranger("127.0.4.5");
  const auto denied = stranger.ask(take_control);
  ASSERT_GE(denied.size(), 2u);
  EXPECT_EQ(denied[1], 0x06);
}

TEST(GigeCamera, LivesThroughHostilePackets) {
  const auto device = camera("127.0.4.6");
  RawClient client("127.0.4.6");
  for (size_t size = 0; size < 64; ++size) client.ask(std::vector<uint8_t>(size, 0xff), 0);
  // Valid headers whose bodies lie.
  for (const uint8_t command : {0x02, 0x40, 0x80, 0x82, 0x84, 0x86}) {
    for (uint8_t size = 0; size < 24; ++size) {
      std::vector<uint8_t> request = {0x42, 1, 0, command, 0, size, 1, size};
      request.resize(8 + size, 0xfe);
      client.ask(request, 0);
    }
  }
  RawClient honest("127.0.4.6");
  const auto answer = honest.ask({0x42, 1, 0, 0x80, 0, 4, 0x12, 0x34, 0, 0, 0x09, 0x04});
  ASSERT_EQ(answer.size(), 12u);
  EXPECT_EQ(answer[11], 1);  // one stream channel
  EXPECT_GT(device->counts().commands_refused, 100);
}

TEST(GigeCamera, RefusesAnAddressThatIsTaken) {
  const auto device = camera("127.0.4.7");
  EXPECT_THROW(camera("127.0.4.7"), BadInput);
  EXPECT_THROW(camera("not an address"), BadInput);
}

}  // namespace
}  // namespace selvedge::sim
