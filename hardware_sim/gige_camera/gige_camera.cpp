#include "hardware_sim/gige_camera/gige_camera.h"

#include <atomic>
#include <cstring>
#include <mutex>
#include <random>
#include <thread>

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "files/bad_input.h"
#include "hardware_sim/genicam_camera/sensor.h"
#include "hardware_sim/gige_camera/big_endian.h"
#include "hardware_sim/gige_camera/registers.h"
#include "hardware_sim/gige_camera/stream.h"
#include "rig/clock.h"

namespace selvedge::sim {

namespace {

constexpr uint16_t kControlPort = 3956;
constexpr uint32_t kOwnAddress = 0x0024;  // bootstrap register of the current IP address
constexpr uint8_t kCommandKey = 0x42, kErrorType = 0x80, kAckRequired = 0x01;
constexpr uint16_t kDiscovery = 0x0002, kResend = 0x0040, kReadRegister = 0x0080, kWriteRegister = 0x0082,
                   kReadMemory = 0x0084, kWriteMemory = 0x0086;
constexpr size_t kDiscoveryBytes = 0xf8, kLargestRead = 540, kCommandHeaderBytes = 8;

using Bytes = std::vector<uint8_t>;

using rig::host_now_s;

uint16_t half(const uint8_t* bytes) { return static_cast<uint16_t>(bytes[0] << 8 | bytes[1]); }
uint32_t word(const uint8_t* bytes) { return uint32_t{half(bytes)} << 16 | half(bytes + 2); }

uint32_t parse_address(const std::string& address) {
  in_addr parsed{};
  if (::inet_pton(AF_INET, address.c_str(), &parsed) != 1)
    refuse("simulated camera", "found address \"{}\", expected an IPv4 loopback address", address);
  return ntohl(parsed.s_addr);
}

// A UDP socket on the control port of an address, -1 where the kernel refuses. shared: with other cameras.
int bound_socket(uint32_t ip_address, bool shared) {
  const int descriptor = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const int yes = 1;
  if (shared) ::setsockopt(descriptor, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  sockaddr_in local{};
  local.sin_family = AF_INET;
  local.sin_port = htons(kControlPort);
  local.sin_addr.s_addr = htonl(ip_address);
  if (::bind(descriptor, reinterpret_cast<sockaddr*>(&local), sizeof local) == 0) return descriptor;
  const int number = errno;
  ::close(descriptor);
  errno = number;
  return -1;
}

}  // namespace

struct GigeCamera::State {
  State(const GigeCameraOptions& options, ImageSource image_at);
  ~State();

  // Control.
  void serve_control();
  void answer(const uint8_t* request, size_t size, const sockaddr_in& from);
  AccessError execute(uint16_t command, const uint8_t* data, size_t size, bool controller, const sockaddr_in& from,
                      Bytes& reply);
  AccessError write(uint32_t address, const uint8_t* bytes, size_t size, const sockaddr_in& from);
  AccessError take_control(uint32_t privilege, const sockaddr_in& from);
  void release_control();
  void act(Effect effect);
  void send(SensorFrame&& frame);

  const GigeCameraOptions options;
  Registers registers;
  Stream stream;
  Sensor sensor;
  int control_socket = -1, broadcast_socket = -1;

  std::atomic<bool> ending{false};

  // Of the control thread alone.
  sockaddr_in controller{};
  bool controlled = false;
  double last_heard_host_s = 0;
  sockaddr_in last_from{};
  uint16_t last_id = 0;
  Bytes last_answer;
  std::mt19937 random;

  mutable std::mutex mutex;  // guards all below
  GigeCameraFaults faults;
  GigeCameraCounts counts;

  std::thread control_thread;
};

GigeCamera::State::State(const GigeCameraOptions& given, ImageSource source)
    : options(given), registers(given, parse_address(given.address)),
      stream(given.address, given.link_bits_per_s, given.seed),
      sensor({given.width_px, given.height_px, given.readout_s, given.clock_offset_s, given.clock_drift_ppm}, registers,
             std::move(source), [this](SensorFrame&& frame) { send(std::move(frame)); }),
      random(given.seed + 1) {
  registers.set_word(reg::kSourcePort, stream.port());
  control_socket = bound_socket(registers.word(kOwnAddress), false);
  if (control_socket < 0)
    refuse("simulated camera", "cannot bind {}:{}: {}", options.address, kControlPort, std::strerror(errno));
  // Discovery by broadcast; without it the camera is still found by its address.
  broadcast_socket = bound_socket(INADDR_BROADCAST, true);
  control_thread = std::thread([this] { serve_control(); });
}

GigeCamera::State::~State() {
  ending = true;
  control_thread.join();
  ::close(control_socket);
  if (broadcast_socket >= 0) ::close(broadcast_socket);
}

// ---------------------------------------------------------------- control

void GigeCamera::State::serve_control() {
  while (!ending) {
    pollfd ready[2] = {{control_socket, POLLIN, 0}, {broadcast_socket, POLLIN, 0}};
    ::poll(ready, 2, 20);
    for (const pollfd& socket : ready) {
      if ((socket.revents & POLLIN) == 0) continue;
      uint8_t request[2048];
      sockaddr_in from{};
      socklen_t from_size = sizeof from;
      const ssize_t size =
          ::recvfrom(socket.fd, request, sizeof request, 0, reinterpret_cast<sockaddr*>(&from), &from_size);
      if (size > 0) answer(request, static_cast<size_t>(size), from);
    }
    // A client that has gone silent loses control, and the stream ends.
    const double timeout_s = 1e-3 * registers.word(reg::kHeartbeatTimeout_ms);
    if (controlled && host_now_s() - last_heard_host_s > timeout_s) release_control();
  }
}

void GigeCamera::State::answer(const uint8_t* request, size_t size, const sockaddr_in& from) {
  {
    const std::lock_guard lock(mutex);
    ++counts.commands;
    if (faults.unplugged || std::uniform_real_distribution<>()(random) < faults.control_loss) return;
    if (size < kCommandHeaderBytes || request[0] != kCommandKey || half(request + 4) != size - kCommandHeaderBytes) {
      ++counts.commands_refused;
      return;
    }
  }
  const uint16_t command = half(request + 2), id = half(request + 6);
  const bool same_sender = from.sin_addr.s_addr == last_from.sin_addr.s_addr && from.sin_port == last_from.sin_port;
  const bool is_controller =
      controlled && from.sin_addr.s_addr == controller.sin_addr.s_addr && from.sin_port == controller.sin_port;
  if (is_controller) last_heard_host_s = host_now_s();

  // A repeated request lost its answer on the way; doing it twice could trigger twice.
  if (command != kResend && command != kDiscovery && same_sender && id == last_id && !last_answer.empty()) {
    ::sendto(control_socket, last_answer.data(), last_answer.size(), 0, reinterpret_cast<const sockaddr*>(&from),
             sizeof from);
    return;
  }
  Bytes reply;
  const AccessError error =
      execute(command, request + kCommandHeaderBytes, size - kCommandHeaderBytes, is_controller, from, reply);
  if (error != AccessError::none) {
    reply.clear();
    const std::lock_guard lock(mutex);
    ++counts.commands_refused;
  }
  if (command == kResend || (request[1] & kAckRequired) == 0) return;
  const uint16_t acknowledge = static_cast<uint16_t>(command + 1);
  Bytes packet = {error == AccessError::none ? uint8_t{0} : kErrorType,
                  static_cast<uint8_t>(error),
                  static_cast<uint8_t>(acknowledge >> 8),
                  static_cast<uint8_t>(acknowledge),
                  static_cast<uint8_t>(reply.size() >> 8),
                  static_cast<uint8_t>(reply.size()),
                  static_cast<uint8_t>(id >> 8),
                  static_cast<uint8_t>(id)};
  packet.insert(packet.end(), reply.begin(), reply.end());
  ::sendto(control_socket, packet.data(), packet.size(), 0, reinterpret_cast<const sockaddr*>(&from), sizeof from);
  last_from = from;
  last_id = id;
  last_answer = std::move(packet);
}

AccessError GigeCamera::State::execute(uint16_t command, const uint8_t* data, size_t size, bool is_controller,
                                       const sockaddr_in& from, Bytes& reply) {
  const auto read = [&](uint32_t address, size_t count) {
    const size_t begin = reply.size();
    reply.resize(begin + count);
    return registers.read(address, reply.data() + begin, count);
  };
  switch (command) {
    case kDiscovery: return read(0, kDiscoveryBytes);
    case kReadRegister: {
      if (size == 0 || size % 4 != 0) return AccessError::invalid_header;
      for (size_t i = 0; i < size; i += 4)
        if (const auto error = read(word(data + i), 4); error != AccessError::none) return error;
      return AccessError::none;
    }
    case kWriteRegister: {
      if (size == 0 || size % 8 != 0) return AccessError::invalid_header;
      for (size_t i = 0; i < size; i += 8) {
        if (!is_controller && word(data + i) != reg::kControlPrivilege) return AccessError::access_denied;
        if (const auto error = write(word(data + i), data + i + 4, 4, from); error != AccessError::none) return error;
      }
      put32(reply, static_cast<uint32_t>(size / 8));
      return AccessError::none;
    }
    case kReadMemory: {
      if (size != 8) return AccessError::invalid_header;
      const size_t count = half(data + 6);
      if (count == 0 || count > kLargestRead) return AccessError::invalid_parameter;
      put32(reply, word(data));
      return read(word(data), count);
    }
    case kWriteMemory: {
      if (size < 8 || size % 4 != 0) return AccessError::invalid_header;
      if (!is_controller) return AccessError::access_denied;
      put32(reply, static_cast<uint32_t>(size - 4));
      return write(word(data), data + 4, size - 4, from);
    }
    case kResend:
      if (size != 12) return AccessError::invalid_header;
      // Clients ask from the socket that receives the stream, not from the one that controls.
      if (!controlled || from.sin_addr.s_addr != controller.sin_addr.s_addr) return AccessError::access_denied;
      stream.resend(half(data + 2), word(data + 4) & 0xffffff, word(data + 8) & 0xffffff);
      return AccessError::none;
    default: return AccessError::not_implemented;
  }
}

AccessError GigeCamera::State::write(uint32_t address, const uint8_t* bytes, size_t size, const sockaddr_in& from) {
  if (address == reg::kControlPrivilege && size == 4) return take_control(word(bytes), from);
  Effect effect;
  const AccessError error = registers.write(address, bytes, size, effect);
  if (error == AccessError::none) act(effect);
  return error;
}

AccessError GigeCamera::State::take_control(uint32_t privilege, const sockaddr_in& from) {
  const bool is_controller =
      controlled && from.sin_addr.s_addr == controller.sin_addr.s_addr && from.sin_port == controller.sin_port;
  if (controlled && !is_controller) return AccessError::access_denied;
  if (privilege == 0) {
    release_control();
    return AccessError::none;
  }
  controlled = true;
  controller = from;
  last_heard_host_s = host_now_s();
  registers.set_word(reg::kControlPrivilege, privilege);
  return AccessError::none;
}

void GigeCamera::State::release_control() {
  controlled = false;
  registers.set_word(reg::kControlPrivilege, 0);
  registers.set_word(reg::kStreamPort, 0);
  sensor.stop();
}

void GigeCamera::State::act(Effect effect) {
  const auto aim = [this] {
    stream.set_destination(registers.word(reg::kStreamAddress), static_cast<uint16_t>(registers.word(reg::kStreamPort)),
                           registers.word(reg::kPacketSize) & 0xffff);
  };
  switch (effect) {
    case Effect::nothing: break;
    case Effect::latch:
      registers.set_long(reg::kTimestampLatched, static_cast<uint64_t>(sensor.ticks(host_now_s())));
      break;
    case Effect::reset_clock: sensor.reset_clock(); break;
    case Effect::ptp_switch:
      if (registers.word(reg::kPtpEnable) == 0) sensor.run_freely();
      else if (options.ptp_master_offset_s)
        sensor.follow_master(host_now_s() + options.ptp_settle_s, *options.ptp_master_offset_s);
      break;
    case Effect::ptp_latch: {
      const PtpState state = registers.word(reg::kPtpEnable) == 0  ? PtpState::disabled
                             : sensor.follows_master(host_now_s()) ? PtpState::slave
                                                                   : PtpState::listening;
      registers.set_word(reg::kPtpStatus, static_cast<uint32_t>(state));
      registers.set_long(reg::kPtpOffset_ns, 0);
      break;
    }
    case Effect::test_packet:
      aim();
      stream.send_test_packet(registers.word(reg::kPacketSize) & 0xffff);
      break;
    case Effect::start:
      aim();
      sensor.start();
      break;
    case Effect::stop: sensor.stop(); break;
    case Effect::software_trigger:
      if (registers.word(reg::kTriggerSource) == 1) sensor.trigger(host_now_s());
      break;
  }
}

// On the sensor's thread. Block ids run from 1 to 65535 and begin again.
void GigeCamera::State::send(SensorFrame&& exposed) {
  auto frame = std::make_shared<StreamFrame>();
  frame->block_id = static_cast<uint16_t>((exposed.number - 1) % 0xffff + 1);
  frame->ticks = exposed.ticks;
  frame->width_px = options.width_px;
  frame->height_px = options.height_px;
  frame->pixels = std::move(exposed.pixels);
  stream.send(std::move(frame));
}

// ---------------------------------------------------------------- the device's face

GigeCamera::GigeCamera(const GigeCameraOptions& options, ImageSource image_at)
    : state_(std::make_unique<State>(options, std::move(image_at))) {}
GigeCamera::~GigeCamera() = default;

void GigeCamera::trigger_edge(double host_s) {
  if (state_->registers.word(reg::kTriggerSource) == 0) state_->sensor.trigger(host_s);
}

void GigeCamera::set_faults(const GigeCameraFaults& faults) {
  state_->stream.set_faults(faults);
  const std::lock_guard lock(state_->mutex);
  state_->faults = faults;
}

void GigeCamera::step_clock(double by_s) { state_->sensor.step_clock(by_s); }

bool GigeCamera::streaming() const { return state_->sensor.running(); }

GigeCameraCounts GigeCamera::counts() const {
  GigeCameraCounts counts;
  {
    const std::lock_guard lock(state_->mutex);
    counts = state_->counts;
  }
  counts.frames = state_->sensor.frames();
  counts.missed_exposures = state_->sensor.missed_exposures();
  state_->stream.count(counts);
  return counts;
}

int64_t GigeCamera::device_ticks(double host_s) const { return state_->sensor.ticks(host_s); }

}  // namespace selvedge::sim
