// The daemon's end of the arm's control socket: a thread that reads what comes, and obeys a stop at once.
//
// A stop does not queue. It is handed to on_stop on the reading thread as soon as its frame is whole, before anything
// that was sent after it, and answered once `settle`, which may wait for the disk, has returned: as done, or with why
// it is not kept for a restart. Everything else waits for the control loop, at most kQueue messages a connection; what
// is beyond that is dropped and refused. With all connections taken, the quietest of the user who has most makes room,
// and is heard before it goes. The control loop never waits for this thread: both hold the lock for as long as a list
// is swapped. Who may move the arm is asked of the kernel (SO_PEERCRED): users of `may_move` alone. Anybody else who
// can open the socket may stop the arm, and nothing else.
#pragma once

#include <sys/types.h>

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <variant>
#include <vector>

#include <selvedge_rig/arm_command_t.hpp>
#include <selvedge_rig/arm_control_t.hpp>
#include <selvedge_rig/arm_trajectory_t.hpp>

#include "files/lock.h"
#include "rig/arm/control_link.h"
#include "rig/arm/path.h"
#include "rig/wire/socket.h"

namespace selvedge::arm {

class ControlServer {
 public:
  struct Path {
    int64_t sequence = 0, trajectory_id = 0, utime = 0;
    ToolPath tool;
  };
  struct Closed {};
  struct Message {
    int64_t sender = 0;  // the connection
    std::variant<selvedge_rig::arm_control_t, selvedge_rig::arm_command_t, Path, Closed> what;
  };
  static constexpr size_t kQueue = 256;
  static constexpr size_t kConnections = 64;
  static constexpr size_t kLongestReason = 200;  // of a stop, in bytes; the rest is left out

  // Both on the reading thread. on_stop: why and by whom; must not wait. settle: at least every 50 ms; why a stop that
  // holds is not on the disk, "" where it is.
  // Throws std::runtime_error where the socket cannot be made, or another daemon listens there.
  ControlServer(std::filesystem::path socket, std::vector<uid_t> may_move,
                std::function<void(const std::string&)> on_stop, std::function<std::string()> settle);
  ~ControlServer();
  ControlServer(const ControlServer&) = delete;
  ControlServer& operator=(const ControlServer&) = delete;

  // What came since the last call, in its order.
  std::vector<Message> take();
  // refused: "" where it was done. A peer that does not read loses its connection.
  void answer(int64_t sender, int64_t sequence, const std::string& refused);
  int64_t refused() const { return refused_; }

 private:
  struct Connection {
    wire::Socket socket;
    uid_t user = 0;
    pid_t process = 0;
    bool may_move = false;
    std::vector<std::uint8_t> received;
    double last_s = 0;  // that it said anything
  };
  struct Answer {
    int64_t sender, sequence;
    std::string refused;
    bool of_stop = false;
  };
  using Connections = std::map<int64_t, Connection>;

  void run();
  void accept_all();
  void make_room();
  void close(Connections::iterator connection);
  // False where the connection is over.
  bool read(int64_t sender, Connection& connection);
  void handle(int64_t sender, Connection& connection, const Frame& frame);
  void push(const Connection& connection, Message message, int64_t sequence);
  void send_answers(const std::string& not_kept);

  const std::filesystem::path path_;
  const std::vector<uid_t> may_move_;
  const std::function<void(const std::string&)> on_stop_;
  const std::function<std::string()> settle_;
  const files::Lock lock_;        // of two daemons that start at once, one has the socket
  wire::Socket listener_, wake_;  // wake_: an eventfd
  Connections connections_;       // the reading thread's alone
  int64_t last_sender_ = 0;
  std::mutex mutex_;  // guards down to answers_
  std::vector<Message> messages_;
  std::map<int64_t, size_t> waiting_;  // messages a connection
  std::vector<Answer> answers_;
  std::atomic<int64_t> refused_{0};
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace selvedge::arm
