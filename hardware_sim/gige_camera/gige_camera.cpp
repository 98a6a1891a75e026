#include "hardware_sim/gige_camera/gige_camera.h"

#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <mutex>
#include <thread>

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "files/bad_input.h"
#include "hardware_sim/gige_camera/big_endian.h"
#include "hardware_sim/gige_camera/registers.h"
#include "hardware_sim/gige_camera/stream.h"

namespace selvedge::sim {

namespace {

constexpr uint16_t kControlPort = 3956;
constexpr uint32_t kOwnAddress = 0x0024;  // bootstrap register of the current IP address
constexpr uint8_t kCommandKey = 0x42, kErrorType = 0x80, kAckRequired = 0x01;
constexpr uint16_t kDiscovery = 0x0002, kResend = 0x0040, kReadRegister = 0x0080, kWriteRegister = 0x0082,
                   kReadMemory = 0x0084, kWriteMemory = 0x0086;
constexpr size_t kDiscoveryBytes = 0xf8, kLargestRead = 540, kCommandHeaderBytes = 8;

using Bytes = std::vector<uint8_t>;

double host_now_s() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

void sleep_until_host(double host_s) {
  timespec due{};
  due.tv_sec = static_cast<time_t>(std::floor(host_s));
  due.tv_nsec = static_cast<long>((host_s - std::floor(host_s)) * 1e9);
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, nullptr) == EINTR) {}
}

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
  GvcpError execute(uint16_t command, const uint8_t* data, size_t size, bool controller, const sockaddr_in& from,
                    Bytes& reply);
  GvcpError write(uint32_t address, const uint8_t* bytes, size_t size, const sockaddr_in& from);
  GvcpError take_control(uint32_t privilege, const sockaddr_in& from);
  void release_control();
  void act(Effect effect);

  // Acquisition.
  void expose_frames();
  bool wait_for_start(double& start_host_s);
  void expose(double start_host_s);
  void start();
  void stop();
  void queue_trigger(double host_s);

  const GigeCameraOptions options;
  const ImageSource image_at;
  Registers registers;
  Stream stream;
  int control_socket = -1, broadcast_socket = -1;

  std::atomic<bool> ending{false};
  std::atomic<bool> running{false};

  // Of the control thread alone.
  sockaddr_in controller{};
  bool controlled = false;
  double last_heard_host_s = 0;
  sockaddr_in last_from{};
  uint16_t last_id = 0;
  Bytes last_answer;
  std::mt19937 random;

  mutable std::mutex mutex;  // guards all below
  std::condition_variable changed;
  std::deque<double> triggers;   // host times of edges not yet exposed
  double next_free_start_s = 0;
  double busy_until_s = 0;       // end of the exposure and read-out of the last trigger
  uint16_t block_id = 0;
  GigeCameraFaults faults;
  GigeCameraCounts counts;
  double clock_start_host_s, clock_base_s;  // device_s = clock_base_s + (host_s − start)·(1 + drift)
  std::optional<double> ptp_since_host_s;   // switched on then

  std::thread control_thread, exposure_thread;

  bool follows_master(double host_s) const {
    return ptp_since_host_s && options.ptp_master_offset_s && host_s >= *ptp_since_host_s + options.ptp_settle_s;
  }

  int64_t ticks(double host_s) const {
    const std::lock_guard lock(mutex);
    if (follows_master(host_s)) return std::llround((host_s + *options.ptp_master_offset_s) * 1e9);
    return std::llround((clock_base_s + (host_s - clock_start_host_s) * (1 + options.clock_drift_ppm * 1e-6)) * 1e9);
  }
};

GigeCamera::State::State(const GigeCameraOptions& given, ImageSource source)
    : options(given), image_at(std::move(source)), registers(given, parse_address(given.address)),
      stream(given.address, given.link_bits_per_s, given.seed), random(given.seed + 1),
      clock_start_host_s(host_now_s()), clock_base_s(clock_start_host_s + given.clock_offset_s) {
  registers.set_word(reg::kSourcePort, stream.port());
  control_socket = bound_socket(registers.word(kOwnAddress), false);
  if (control_socket < 0)
    refuse("simulated camera", "cannot bind {}:{}: {}", options.address, kControlPort, std::strerror(errno));
  // Discovery by broadcast; without it the camera is still found by its address.
  broadcast_socket = bound_socket(INADDR_BROADCAST, true);
  control_thread = std::thread([this] { serve_control(); });
  exposure_thread = std::thread([this] { expose_frames(); });
}

GigeCamera::State::~State() {
  ending = true;
  changed.notify_all();
  control_thread.join();
  exposure_thread.join();
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
  const bool same_sender =
      from.sin_addr.s_addr == last_from.sin_addr.s_addr && from.sin_port == last_from.sin_port;
  const bool is_controller = controlled && from.sin_addr.s_addr == controller.sin_addr.s_addr &&
                             from.sin_port == controller.sin_port;
  if (is_controller) last_heard_host_s = host_now_s();

  // A repeated request lost its answer on the way; doing it twice could trigger twice.
  if (command != kResend && command != kDiscovery && same_sender && id == last_id && !last_answer.empty()) {
    ::sendto(control_socket, last_answer.data(), last_answer.size(), 0, reinterpret_cast<const sockaddr*>(&from),
             sizeof from);
    return;
  }
  Bytes reply;
  const GvcpError error = execute(command, request + kCommandHeaderBytes, size - kCommandHeaderBytes, is_controller, from, reply);
  if (error != GvcpError::none) {
    reply.clear();
    const std::lock_guard lock(mutex);
    ++counts.commands_refused;
  }
  if (command == kResend || (request[1] & kAckRequired) == 0) return;
  const uint16_t acknowledge = static_cast<uint16_t>(command + 1);
  Bytes packet = {error == GvcpError::none ? uint8_t{0} : kErrorType, static_cast<uint8_t>(error),
                  static_cast<uint8_t>(acknowledge >> 8), static_cast<uint8_t>(acknowledge),
                  static_cast<uint8_t>(reply.size() >> 8), static_cast<uint8_t>(reply.size()),
                  static_cast<uint8_t>(id >> 8), static_cast<uint8_t>(id)};
  packet.insert(packet.end(), reply.begin(), reply.end());
  ::sendto(control_socket, packet.data(), packet.size(), 0, reinterpret_cast<const sockaddr*>(&from), sizeof from);
  last_from = from;
  last_id = id;
  last_answer = std::move(packet);
}

GvcpError GigeCamera::State::execute(uint16_t command, const uint8_t* data, size_t size, bool is_controller,
                                     const sockaddr_in& from, Bytes& reply) {
  const auto read = [&](uint32_t address, size_t count) {
    const size_t begin = reply.size();
    reply.resize(begin + count);
    return registers.read(address, reply.data() + begin, count);
  };
  switch (command) {
    case kDiscovery: return read(0, kDiscoveryBytes);
    case kReadRegister: {
      if (size == 0 || size % 4 != 0) return GvcpError::invalid_header;
      for (size_t i = 0; i < size; i += 4)
        if (const auto error = read(word(data + i), 4); error != GvcpError::none) return error;
      return GvcpError::none;
    }
    case kWriteRegister: {
      if (size == 0 || size % 8 != 0) return GvcpError::invalid_header;
      for (size_t i = 0; i < size; i += 8) {
        if (!is_controller && word(data + i) != reg::kControlPrivilege) return GvcpError::access_denied;
        if (const auto error = write(word(data + i), data + i + 4, 4, from); error != GvcpError::none) return error;
      }
      put32(reply, static_cast<uint32_t>(size / 8));
      return GvcpError::none;
    }
    case kReadMemory: {
      if (size != 8) return GvcpError::invalid_header;
      const size_t count = half(data + 6);
      if (count == 0 || count > kLargestRead) return GvcpError::invalid_parameter;
      put32(reply, word(data));
      return read(word(data), count);
    }
    case kWriteMemory: {
      if (size < 8 || size % 4 != 0) return GvcpError::invalid_header;
      if (!is_controller) return GvcpError::access_denied;
      put32(reply, static_cast<uint32_t>(size - 4));
      return write(word(data), data + 4, size - 4, from);
    }
    case kResend:
      if (size != 12) return GvcpError::invalid_header;
      // Clients ask from the socket that receives the stream, not from the one that controls.
      if (!controlled || from.sin_addr.s_addr != controller.sin_addr.s_addr) return GvcpError::access_denied;
      stream.resend(half(data + 2), word(data + 4) & 0xffffff, word(data + 8) & 0xffffff);
      return GvcpError::none;
    default: return GvcpError::not_implemented;
  }
}

GvcpError GigeCamera::State::write(uint32_t address, const uint8_t* bytes, size_t size, const sockaddr_in& from) {
  if (address == reg::kControlPrivilege && size == 4) return take_control(word(bytes), from);
  Effect effect;
  const GvcpError error = registers.write(address, bytes, size, effect);
  if (error == GvcpError::none) act(effect);
  return error;
}

GvcpError GigeCamera::State::take_control(uint32_t privilege, const sockaddr_in& from) {
  const bool is_controller = controlled && from.sin_addr.s_addr == controller.sin_addr.s_addr &&
                             from.sin_port == controller.sin_port;
  if (controlled && !is_controller) return GvcpError::access_denied;
  if (privilege == 0) {
    release_control();
    return GvcpError::none;
  }
  controlled = true;
  controller = from;
  last_heard_host_s = host_now_s();
  registers.set_word(reg::kControlPrivilege, privilege);
  return GvcpError::none;
}

void GigeCamera::State::release_control() {
  controlled = false;
  registers.set_word(reg::kControlPrivilege, 0);
  registers.set_word(reg::kStreamPort, 0);
  stop();
}

void GigeCamera::State::act(Effect effect) {
  const auto aim = [this] {
    stream.set_destination(registers.word(reg::kStreamAddress), static_cast<uint16_t>(registers.word(reg::kStreamPort)),
                           registers.word(reg::kPacketSize) & 0xffff);
  };
  switch (effect) {
    case Effect::nothing: break;
    case Effect::latch: registers.set_long(reg::kTimestampLatched, static_cast<uint64_t>(ticks(host_now_s()))); break;
    case Effect::reset_clock: {
      const std::lock_guard lock(mutex);
      clock_start_host_s = host_now_s();
      clock_base_s = 0;
      break;
    }
    case Effect::ptp_switch: {
      // Switched off, the clock goes on by itself from where it is.
      const double now_s = host_now_s(), device_s = 1e-9 * static_cast<double>(ticks(now_s));
      const std::lock_guard lock(mutex);
      if (follows_master(now_s)) {
        clock_start_host_s = now_s;
        clock_base_s = device_s;
      }
      ptp_since_host_s = registers.word(reg::kPtpEnable) ? std::optional(now_s) : std::nullopt;
      break;
    }
    case Effect::ptp_latch: {
      const std::lock_guard lock(mutex);
      const PtpState state = !ptp_since_host_s ? PtpState::disabled : follows_master(host_now_s()) ? PtpState::slave : PtpState::listening;
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
      start();
      break;
    case Effect::stop: stop(); break;
    case Effect::software_trigger:
      if (registers.word(reg::kTriggerSource) == 1) queue_trigger(host_now_s());
      break;
  }
}

// ---------------------------------------------------------------- acquisition

void GigeCamera::State::start() {
  const std::lock_guard lock(mutex);
  triggers.clear();
  block_id = 0;
  next_free_start_s = host_now_s();
  busy_until_s = 0;
  running = true;
  changed.notify_all();
}

void GigeCamera::State::stop() {
  const std::lock_guard lock(mutex);
  running = false;
  changed.notify_all();
}

// A trigger that falls into an exposure or its read-out is missed, as on a real sensor.
void GigeCamera::State::queue_trigger(double host_s) {
  const double busy_s = registers.real(reg::kExposure_us) * 1e-6 + options.readout_s;
  const std::lock_guard lock(mutex);
  if (!running || registers.word(reg::kTriggerMode) != 1 || host_s < busy_until_s) {
    ++counts.missed_exposures;
    return;
  }
  busy_until_s = host_s + busy_s;
  triggers.push_back(host_s);
  changed.notify_all();
}

void GigeCamera::State::expose_frames() {
  double start_host_s = 0;
  while (!ending)
    if (wait_for_start(start_host_s)) expose(start_host_s);
}

// True with the host time at which an exposure starts (or started); false to look again.
bool GigeCamera::State::wait_for_start(double& start_host_s) {
  std::unique_lock lock(mutex);
  if (!running || (registers.word(reg::kTriggerMode) == 1 && triggers.empty())) {
    changed.wait_for(lock, std::chrono::milliseconds(20));
    return false;
  }
  if (registers.word(reg::kTriggerMode) == 1) {
    start_host_s = triggers.front();
    triggers.pop_front();
    return true;
  }
  // Running free: a source of images that is too slow costs whole periods, never the rhythm.
  const double period_s = 1 / registers.real(reg::kFrameRate_hz);
  const double busy_s = registers.real(reg::kExposure_us) * 1e-6 + options.readout_s;
  while (next_free_start_s + busy_s + period_s < host_now_s()) {
    next_free_start_s += period_s;
    ++counts.missed_exposures;
  }
  start_host_s = next_free_start_s;
  next_free_start_s += period_s;
  return true;
}

void GigeCamera::State::expose(double start_host_s) {
  const double exposure_s = registers.real(reg::kExposure_us) * 1e-6;
  auto frame = std::make_shared<StreamFrame>();
  frame->width_px = options.width_px;
  frame->height_px = options.height_px;
  frame->pixels.resize(static_cast<size_t>(options.width_px) * static_cast<size_t>(options.height_px));
  frame->ticks = ticks(start_host_s);
  sleep_until_host(start_host_s + exposure_s);
  if (!running || !image_at(start_host_s + 0.5 * exposure_s, frame->pixels.data())) return;
  sleep_until_host(start_host_s + exposure_s + options.readout_s);
  {
    const std::lock_guard lock(mutex);
    if (!running) return;
    block_id = block_id == 0xffff ? uint16_t{1} : static_cast<uint16_t>(block_id + 1);
    frame->block_id = block_id;
    if (registers.word(reg::kAcquisitionMode) == 1) running = false;
    ++counts.frames;
  }
  stream.send(std::move(frame));
}

// ---------------------------------------------------------------- the device's face

GigeCamera::GigeCamera(const GigeCameraOptions& options, ImageSource image_at)
    : state_(std::make_unique<State>(options, std::move(image_at))) {}
GigeCamera::~GigeCamera() = default;

void GigeCamera::trigger_edge(double host_s) {
  if (state_->registers.word(reg::kTriggerSource) == 0) state_->queue_trigger(host_s);
}

void GigeCamera::set_faults(const GigeCameraFaults& faults) {
  state_->stream.set_faults(faults);
  const std::lock_guard lock(state_->mutex);
  state_->faults = faults;
}

void GigeCamera::step_clock(double by_s) {
  const std::lock_guard lock(state_->mutex);
  state_->clock_base_s += by_s;
}

bool GigeCamera::streaming() const { return state_->running; }

GigeCameraCounts GigeCamera::counts() const {
  GigeCameraCounts counts;
  {
    const std::lock_guard lock(state_->mutex);
    counts = state_->counts;
  }
  state_->stream.count(counts);
  return counts;
}

int64_t GigeCamera::device_ticks(double host_s) const { return state_->ticks(host_s); }

}  // namespace selvedge::sim
