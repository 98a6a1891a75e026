#include "rig/arm/control_server.h"

#include <poll.h>
#include <pwd.h>
#include <sys/eventfd.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "files/bad_input.h"
#include "rig/clock.h"
#include "rig/wire/bytes.h"

namespace selvedge::arm {

using selvedge_rig::arm_answer_t;
using selvedge_rig::arm_command_t;
using selvedge_rig::arm_control_t;
using selvedge_rig::arm_trajectory_t;

namespace {

constexpr int kTick_ms = 20;
constexpr int64_t kNoAnswer = -1;
constexpr size_t kRead_bytes = 65536;  // of one connection, before the next has its turn
constexpr int kAcceptedAtOnce = 16;    // connections, before those that are there have their turn

std::string name_of(uid_t user) {
  std::array<char, 4096> buffer;
  passwd entry{}, *found = nullptr;
  ::getpwuid_r(user, &entry, buffer.data(), buffer.size(), &found);
  return found ? fmt::format("{} ({})", found->pw_name, user) : std::to_string(user);
}

// A reason may be anybody's: short, since every state of the arm tells it, and nothing that a terminal would obey.
std::string fit_to_tell(const std::string& reason) {
  std::string text = reason.substr(0, ControlServer::kLongestReason);
  for (char& c : text)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = ' ';
  return printable(text);
}

ControlServer::Path to_path(arm_trajectory_t message) {
  ControlServer::Path path{message.sequence, message.trajectory_id, message.utime, {}};
  path.tool.point_m.resize(3, message.points);
  for (int i = 0; i < message.points; ++i) {
    const auto k = static_cast<size_t>(i);
    path.tool.point_m.col(i) << message.x_m[k], message.y_m[k], message.z_m[k];
  }
  path.tool.time_s = std::move(message.time_s);
  return path;
}

}  // namespace

ControlServer::ControlServer(std::filesystem::path socket, std::vector<uid_t> may_move,
                             std::function<void(const std::string&)> on_stop, std::function<std::string()> settle)
    : path_(std::move(socket)), may_move_(std::move(may_move)), on_stop_(std::move(on_stop)),
      settle_(std::move(settle)), lock_(path_.string() + ".lock") {
  if (!lock_.held())
    throw std::runtime_error(
        fmt::format("{0}: another process listens there, or {0}.lock cannot be opened", path_.string()));
  listener_ = wire::listen_unix(path_);
  wake_ = wire::Socket(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  last_sender_ = rig::host_now_us();
  thread_ = std::thread([this] { run(); });
}

ControlServer::~ControlServer() {
  stopping_ = true;
  thread_.join();
  std::error_code ignored;
  std::filesystem::remove(path_, ignored);
}

void ControlServer::run() {
  while (!stopping_) {
    std::vector<pollfd> waited = {{listener_.descriptor(), POLLIN, 0}, {wake_.descriptor(), POLLIN, 0}};
    std::vector<int64_t> senders;
    for (const auto& [sender, connection] : connections_) {
      waited.push_back({connection.socket.descriptor(), POLLIN, 0});
      senders.push_back(sender);
    }
    ::poll(waited.data(), waited.size(), kTick_ms);
    for (size_t i = 0; i < senders.size(); ++i) {
      if (waited[i + 2].revents == 0) continue;
      const auto connection = connections_.find(senders[i]);
      if (!read(connection->first, connection->second)) close(connection);
    }
    send_answers(settle_());
    if (waited[0].revents != 0) accept_all();
  }
}

void ControlServer::accept_all() {
  for (int taken = 0; taken < kAcceptedAtOnce; ++taken) {
    auto socket = wire::accept(listener_, 0);
    if (!socket) return;
    ucred peer{};
    socklen_t size = sizeof peer;
    if (::getsockopt(socket->descriptor(), SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0) continue;
    if (connections_.size() >= kConnections) make_room();
    Connection& connection = connections_[++last_sender_];
    connection.socket = std::move(*socket);
    connection.user = peer.uid;
    connection.process = peer.pid;
    connection.may_move = std::find(may_move_.begin(), may_move_.end(), peer.uid) != may_move_.end();
    connection.last_s = rig::host_now_s();
  }
}

// Whoever holds the arm renews the lease a hundred times a second, so it is never the quietest; and no crowd of another
// user's drives it out.
void ControlServer::make_room() {
  std::map<uid_t, size_t> of_user;
  for (const auto& [sender, connection] : connections_) ++of_user[connection.user];
  const auto goes_before = [&](const auto& a, const auto& b) {
    const size_t many = of_user[a.second.user], more = of_user[b.second.user];
    return many != more ? many > more : a.second.last_s < b.second.last_s;
  };
  const auto goes = std::min_element(connections_.begin(), connections_.end(), goes_before);
  read(goes->first, goes->second);  // a stop that lies there unread is a stop
  close(goes);
}

void ControlServer::close(Connections::iterator connection) {
  const std::lock_guard lock(mutex_);
  messages_.push_back({connection->first, Closed{}});
  waiting_.erase(connection->first);
  connections_.erase(connection);
}

bool ControlServer::read(int64_t sender, Connection& connection) {
  std::array<std::uint8_t, kRead_bytes> part;
  const ssize_t got = ::recv(connection.socket.descriptor(), part.data(), part.size(), MSG_DONTWAIT);
  if (got < 0) return errno == EAGAIN || errno == EINTR;
  if (got == 0) return false;
  connection.last_s = rig::host_now_s();
  connection.received.insert(connection.received.end(), part.begin(), part.begin() + got);
  try {
    while (const auto frame = take_frame(connection.received)) handle(sender, connection, *frame);
  } catch (const wire::WireError& error) {
    spdlog::warn("arm: control: process {} of user {}: {}", connection.process, name_of(connection.user), error.what());
    return false;
  }
  return true;
}

void ControlServer::handle(int64_t sender, Connection& connection, const Frame& frame) {
  if (frame.kind == FrameKind::control) {
    auto control = decode_payload<arm_control_t>(frame.payload);
    if (!control) throw wire::WireError("a control message that cannot be decoded");
    if (control->action == arm_control_t::STOP) {
      on_stop_(fmt::format("{} (process {} of user {})", fit_to_tell(control->reason), connection.process,
                           name_of(connection.user)));
      const std::lock_guard lock(mutex_);
      answers_.push_back({sender, control->sequence, "", true});
      return;
    }
    control->sender = sender;
    return push(connection, {sender, *control}, control->sequence);
  }
  if (frame.kind == FrameKind::command) {
    auto command = decode_payload<arm_command_t>(frame.payload);
    if (!command) throw wire::WireError("a command that cannot be decoded");
    command->sender = sender;
    return push(connection, {sender, *command}, kNoAnswer);
  }
  auto trajectory =
      frame.kind == FrameKind::trajectory ? decode_payload<arm_trajectory_t>(frame.payload) : std::nullopt;
  if (!trajectory) throw wire::WireError("a trajectory that cannot be decoded, or what only a daemon says");
  const int64_t sequence = trajectory->sequence;
  push(connection, {sender, to_path(std::move(*trajectory))}, sequence);
}

void ControlServer::push(const Connection& connection, Message message, int64_t sequence) {
  const int64_t sender = message.sender;
  std::string why;
  if (!connection.may_move)
    why = fmt::format("user {} may stop the arm, and nothing else ([arm] control_users)", name_of(connection.user));
  if (why.empty()) {
    const std::lock_guard lock(mutex_);
    if (size_t& waiting = waiting_[sender]; waiting < kQueue) {
      ++waiting;
      messages_.push_back(std::move(message));
      return;
    }
    why = fmt::format("more than {} messages wait", kQueue);
  }
  ++refused_;
  if (sequence != kNoAnswer) answer(sender, sequence, why);
}

std::vector<ControlServer::Message> ControlServer::take() {
  const std::lock_guard lock(mutex_);
  waiting_.clear();
  return std::exchange(messages_, {});
}

void ControlServer::answer(int64_t sender, int64_t sequence, const std::string& refused) {
  {
    const std::lock_guard lock(mutex_);
    answers_.push_back({sender, sequence, refused, false});
  }
  ::eventfd_write(wake_.descriptor(), 1);
}

void ControlServer::send_answers(const std::string& not_kept) {
  eventfd_t ignored = 0;
  ::eventfd_read(wake_.descriptor(), &ignored);
  std::vector<Answer> answers;
  {
    const std::lock_guard lock(mutex_);
    answers = std::exchange(answers_, {});
  }
  for (const Answer& given : answers) {
    const auto connection = connections_.find(given.sender);
    if (connection == connections_.end()) continue;
    arm_answer_t message{};
    message.utime = rig::host_now_us();
    message.sequence = given.sequence;
    message.done = given.refused.empty() ? 1 : 0;
    message.text = given.refused;
    if (given.of_stop && !not_kept.empty()) {
      message.done = 0;
      message.text = "it is stopped, but that could not be put on the disk for a restart of its daemon: " + not_kept;
    }
    const auto bytes = encode_frame(FrameKind::answer, message);
    const int descriptor = connection->second.socket.descriptor();
    if (::send(descriptor, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT) !=
        static_cast<ssize_t>(bytes.size()))
      close(connection);
  }
}

}  // namespace selvedge::arm
