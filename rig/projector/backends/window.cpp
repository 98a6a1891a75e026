// A projector or any other screen behind a graphics card, shown by a program of its own
// (rig/projector/window/main.cpp).
//
// That program draws the pattern and presents it twice, the second time waiting for the screen's refresh, then waits
// settle_s: what the projector's own electronics add to that is the lab's to measure. A program that is silent for
// reply_timeout_s is killed, and a silent or dead X server is thereby a lost device, not the end of the daemon.
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "files/bad_input.h"
#include "rig/projector/backends/window_packets.h"
#include "rig/projector/projector.h"
#include "rig/wire/bytes.h"
#include "rig/wire/socket.h"

namespace selvedge::projector {

namespace {

constexpr double kStart_s = 10;  // for the program and the graphics driver to start

// Beside the program that runs.
std::filesystem::path window_program() {
  return std::filesystem::read_symlink("/proc/self/exe").parent_path() / "selvedge_projector_window";
}

class WindowProjector final : public Projector {
 public:
  explicit WindowProjector(const WindowOptions& options) : options_(options) {
    start();
    try {
      description_ = reply(kStart_s);
    } catch (...) {
      end();
      throw;
    }
  }
  ~WindowProjector() override { end(); }

  void show(const Pattern& pattern) override {
    window::check_pattern(pattern);
    ask({.show = true, .pattern = pattern}, options_.reply_timeout_s + options_.settle_s);
  }
  void check() override { ask({}, options_.reply_timeout_s); }
  std::string description() const override { return description_; }

 private:
  void start() {
    const std::string program = window_program();
    if (::access(program.c_str(), X_OK) != 0) throw ProjectorFault("projector window: no program " + program);
    int ends[2];
    if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) != 0)
      throw ProjectorFault("projector window: no socket");
    link_ = wire::Socket(ends[0]);
    wire::Socket theirs(ends[1]);
    if (!options_.screen.empty()) screen_ = "DISPLAY=" + options_.screen;
    const std::string words[] = {program,
                                 std::to_string(options_.monitor),
                                 std::to_string(options_.width_px),
                                 std::to_string(options_.height_px),
                                 fmt::format("{}", options_.gamma),
                                 fmt::format("{}", options_.settle_s)};
    std::vector<char*> arguments, environment;
    for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    for (char** at = environ; *at != nullptr; ++at)
      if (screen_.empty() || std::string(*at).rfind("DISPLAY=", 0) != 0) environment.push_back(*at);
    if (!screen_.empty()) environment.push_back(screen_.data());
    environment.push_back(nullptr);
    const pid_t parent = ::getpid();
    child_ = ::fork();
    if (child_ < 0) throw ProjectorFault("projector window: no further process");
    if (child_ == 0) {
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);  // a pattern without a daemon would be a lie
      if (::getppid() != parent || ::dup2(ends[1], 0) < 0) ::_exit(127);
      ::signal(SIGINT, SIG_IGN);  // Ctrl-C is the daemon's
      ::execve(program.c_str(), arguments.data(), environment.data());
      ::_exit(127);
    }
  }

  void ask(const window::Request& request, double limit_s) {
    if (child_ < 0) throw wire::Disconnected("projector window: its program has ended");
    link_.send({reinterpret_cast<const std::uint8_t*>(&request), sizeof request});
    reply(limit_s);
  }

  // The text of the answer. Throws what the answer says; ends the program where it is silent or gone.
  std::string reply(double limit_s) {
    std::array<std::uint8_t, sizeof(window::Answer)> packet{};
    if (!link_.readable(limit_s)) {
      end();
      throw wire::Disconnected(fmt::format("projector window: the X server was silent for {} s", limit_s));
    }
    window::Said answer;
    try {
      answer = window::decode_answer(std::span(packet).first(link_.receive(packet)));
    } catch (const wire::Disconnected&) {
      end();
      throw wire::Disconnected("projector window: the X server or the window's program is gone");
    } catch (const wire::WireError& error) {
      end();
      throw wire::Disconnected(fmt::format("projector window: its program answered with {}", error.what()));
    }
    const std::string& text = answer.text;
    switch (answer.outcome) {
      case window::Outcome::done: return text;
      case window::Outcome::refused: throw BadInput(text);
      case window::Outcome::fault: throw ProjectorFault("projector window: " + text);
      case window::Outcome::lost: break;
    }
    end();
    throw wire::Disconnected("projector window: " + text);
  }

  void end() {
    link_.close();
    if (child_ < 0) return;
    ::kill(child_, SIGKILL);
    ::waitpid(child_, nullptr, 0);
    child_ = -1;
  }

  WindowOptions options_;
  std::string screen_, description_;
  wire::Socket link_;
  pid_t child_ = -1;
};

}  // namespace

std::unique_ptr<Projector> open_window(const WindowOptions& options) {
  return std::make_unique<WindowProjector>(options);
}

}  // namespace selvedge::projector
