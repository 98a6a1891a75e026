#include "station/talking_process.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "files/bad_input.h"

namespace selvedge::station {

namespace {

constexpr double kTalkPatience_s = 1;

int ms_until(TalkDeadline deadline) {
  const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
  return static_cast<int>(std::clamp<long>(left.count() + 1, 0, 1'000'000));
}

}  // namespace

TalkDeadline within(double seconds) {
  return std::chrono::steady_clock::now() + std::chrono::microseconds(static_cast<long>(1e6 * seconds));
}

TalkingProcess::TalkingProcess(std::string name, const std::string& command, const std::filesystem::path& log_file)
    : name_(std::move(name)) {
  // A socket, not a pipe, where we write: to one that went away it can be written without SIGPIPE.
  std::array<int, 2> in{-1, -1}, out{-1, -1};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, in.data()) != 0 || ::pipe2(out.data(), O_CLOEXEC) != 0)
    throw std::runtime_error(fmt::format("{}: no pipe: {}", name_, std::strerror(errno)));
  ::fcntl(out[1], F_SETPIPE_SZ, 1 << 20);  // fewer turns between the two; less will do
  to_ = in[0];
  from_ = out[0];
  ::fcntl(to_, F_SETFL, O_NONBLOCK);
  ::fcntl(from_, F_SETFL, O_NONBLOCK);
  child_.emplace(name_, std::vector<std::string>{"/bin/sh", "-c", command}, log_file, Streams{in[1], out[1]},
                 kTalkPatience_s);
  ::close(in[1]);
  ::close(out[1]);
}

TalkingProcess::~TalkingProcess() {
  child_.reset();
  if (to_ >= 0) ::close(to_);
  ::close(from_);
}

void TalkingProcess::refuse_its_end() {
  constexpr double kReaped_s = 1;
  if (child_->ends_within(kReaped_s)) {
    try {
      child_->require_running();
    } catch (const std::runtime_error& error) { throw BadInput(error.what()); }
  }
  refuse(name_, "closed its standard output, expected it to answer until its standard input is closed");
}

// 0: nothing is there.
size_t TalkingProcess::read_some(char* into, size_t most) {
  const ssize_t count = ::read(from_, into, most);
  if (count > 0) return static_cast<size_t>(count);
  if (count < 0 && (errno == EAGAIN || errno == EINTR)) return 0;
  refuse_its_end();
}

void TalkingProcess::take_what_came(TalkDeadline deadline) {
  if (taken_ == came_.size()) came_.clear(), taken_ = 0;
  constexpr size_t kAtOnce = 1 << 16;
  const size_t had = came_.size();
  came_.resize(had + kAtOnce);
  came_.resize(had + exchange(came_.data() + had, kAtOnce, deadline));
}

void TalkingProcess::send_some() {
  const ssize_t count = ::send(to_, unsent_.data() + sent_, unsent_.size() - sent_, MSG_NOSIGNAL);
  if (count > 0) sent_ += static_cast<size_t>(count);
  else if (errno != EAGAIN && errno != EINTR) sent_ = unsent_.size();  // it reads no more: its output tells why
  if (sent_ == unsent_.size()) unsent_.clear(), sent_ = 0;
}

// Waits until something came, and sends meanwhile.
size_t TalkingProcess::exchange(char* into, size_t most, TalkDeadline deadline) {
  for (;;) {
    std::array<pollfd, 2> ends = {pollfd{from_, POLLIN, 0}, pollfd{unsent_.empty() ? -1 : to_, POLLOUT, 0}};
    const int ready = ::poll(ends.data(), ends.size(), ms_until(deadline));
    if (ready < 0 && errno != EINTR) throw std::runtime_error(fmt::format("{}: {}", name_, std::strerror(errno)));
    if (ready == 0) refuse(name_, "did not answer within its time limit");
    if (ready < 0) continue;
    if (ends[1].revents != 0) send_some();
    if (ends[0].revents == 0) continue;
    if (const size_t count = read_some(into, most)) return count;
  }
}

std::string TalkingProcess::line(TalkDeadline deadline, size_t most_bytes) {
  size_t looked = taken_;
  for (;;) {
    const size_t end = came_.find('\n', looked);
    if (end != std::string::npos) {
      std::string text = came_.substr(taken_, end - taken_);
      taken_ = end + 1;
      return text;
    }
    if (came_.size() - taken_ > most_bytes)
      refuse(name_, "wrote more than {} bytes without an end of line, expected an answer: {}", most_bytes,
             in_quotes(std::string_view(came_).substr(taken_, 80)));
    const size_t waiting = came_.size() - taken_;
    take_what_came(deadline);
    looked = taken_ + waiting;
  }
}

void TalkingProcess::bytes(char* into, size_t count, TalkDeadline deadline) {
  const size_t there = std::min(count, came_.size() - taken_);
  std::copy_n(came_.data() + taken_, there, into);
  taken_ += there;
  for (size_t done = there; done < count;) done += exchange(into + done, count - done, deadline);
}

size_t TalkingProcess::unread() {
  pollfd end{from_, POLLIN, 0};
  if (::poll(&end, 1, 0) > 0) take_what_came(within(0));
  return came_.size() - taken_;
}

bool TalkingProcess::ends_when_told(double wait_s) {
  ::close(to_);
  to_ = -1;
  unsent_.clear();
  return child_->ends_within(wait_s);
}

}  // namespace selvedge::station
