// The projector's contract over a full-screen window: Xvfb is the screen, and a client of its own reads what is on it.
#include "tests/projector/projector_contract.h"

#include <X11/Xlib.h>
#include <X11/Xutil.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <string>
#include <thread>

#include <fmt/format.h>

#include <selvedge_rig/device_status_t.hpp>

#include "rig/bus.h"
#include "rig/clock.h"
#include "rig/network.h"
#include "rig/projector/daemon.h"
#include "tests/needs_package.h"

namespace selvedge {
namespace {

using projector::WindowOptions;

bool has_xvfb() { return std::system("command -v Xvfb > /dev/null 2>&1") == 0; }

// An X server with one screen in memory, on a number that was free.
class VirtualScreen {
 public:
  explicit VirtualScreen(int width_px = 912, int height_px = 1140)
      : size_(fmt::format("{}x{}x24", width_px, height_px)) {
    start();
  }
  ~VirtualScreen() { stop(); }
  VirtualScreen(const VirtualScreen&) = delete;
  VirtualScreen& operator=(const VirtualScreen&) = delete;

  std::string name() const { return ":" + number_; }
  void start() {
    int ends[2];
    if (::pipe(ends) != 0) throw std::runtime_error("no pipe for Xvfb");
    const std::string descriptor = std::to_string(ends[1]), at = name();
    std::vector<const char*> words = {"Xvfb"};
    if (!number_.empty()) words.push_back(at.c_str());  // the same again
    for (const char* word : std::initializer_list<const char*>{"-displayfd", descriptor.c_str(), "-screen", "0",
                                                               size_.c_str(), "-nolisten", "tcp", "-noreset", nullptr})
      words.push_back(word);
    posix_spawn_file_actions_t quiet;
    ::posix_spawn_file_actions_init(&quiet);
    ::posix_spawn_file_actions_addopen(&quiet, 2, "/dev/null", 1, 0);
    const int failed =
        ::posix_spawnp(&child_, "Xvfb", &quiet, nullptr, const_cast<char* const*>(words.data()), environ);
    ::posix_spawn_file_actions_destroy(&quiet);
    ::close(ends[1]);
    char text[16] = {};
    const ssize_t count = failed != 0 ? 0 : ::read(ends[0], text, sizeof text - 1);
    ::close(ends[0]);
    if (count <= 0) throw std::runtime_error("Xvfb did not start");
    number_ = std::string(text, text + count);
    number_.erase(number_.find_last_not_of("\n") + 1);
  }
  void stop() {
    if (child_ <= 0) return;
    ::kill(child_, SIGCONT);
    ::kill(child_, SIGKILL);
    ::waitpid(child_, nullptr, 0);
    std::remove(("/tmp/.X" + number_ + "-lock").c_str());
    std::remove(("/tmp/.X11-unix/X" + number_).c_str());
    child_ = -1;
  }
  void hang() const { ::kill(child_, SIGSTOP); }

  Picture picture() const {
    Display* const display = XOpenDisplay(name().c_str());
    if (display == nullptr) throw std::runtime_error("no connection to Xvfb");
    const Window root = DefaultRootWindow(display);
    XWindowAttributes size;
    XGetWindowAttributes(display, root, &size);
    const auto destroy = [](XImage* image) { XDestroyImage(image); };
    const std::shared_ptr<XImage> image(XGetImage(display, root, 0, 0, static_cast<unsigned>(size.width),
                                                  static_cast<unsigned>(size.height), AllPlanes, ZPixmap),
                                        destroy);
    XCloseDisplay(display);
    return [image](int column, int row) {
      const unsigned long pixel = XGetPixel(image.get(), column, row);
      EXPECT_EQ(pixel & 0xFF, pixel >> 8 & 0xFF);
      return static_cast<double>(pixel & 0xFF) / 255;
    };
  }

 private:
  std::string size_, number_;
  pid_t child_ = -1;
};

WindowOptions on(const VirtualScreen& screen) {
  WindowOptions options;
  options.screen = screen.name();
  options.settle_s = 0;
  options.reply_timeout_s = 0.5;
  return options;
}

Device start_window() {
  auto screen = std::make_shared<VirtualScreen>();
  auto gone = std::make_shared<bool>(false);
  return {.open =
              [screen, gone] {
    if (*gone) screen->start();
    *gone = false;
    WindowOptions options = on(*screen);
    options.reply_timeout_s = 2;
    return projector::open_window(options);
          },
          .shown = [screen] { return screen->picture(); },
          .disconnect =
              [screen, gone] {
    screen->stop();
    *gone = true;
          },
      .reject_next = {}, .hang = [screen] { screen->hang(); },
      .cannot_show = {.kind = PatternKind::stripes, .period_px = 0}};
}

#define NEEDS_XVFB SELVEDGE_NEEDS(has_xvfb(), "xvfb", "the window projector")

INSTANTIATE_TEST_SUITE_P(Screens, ProjectorContract,
                         testing::ValuesIn(has_xvfb() ? std::vector<Backend>{{"window", start_window}}
                                                      : std::vector<Backend>{}),
                         [](const auto& info) { return info.param.name; });
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(ProjectorContract);

TEST(Window, ShowsLevelsAndSinusoidsThroughTheDisplaysGamma) {
  NEEDS_XVFB;
  const VirtualScreen screen;
  WindowOptions options = on(screen);
  options.gamma = 2.2;
  const auto window = projector::open_window(options);
  const Pattern sinusoid{.kind = PatternKind::phase_shift, .level = 0.8, .period_px = 24, .phase_rad = 0.5};
  window->show(sinusoid);
  const Picture shown = screen.picture();
  double worst = 0;
  for (int row = 0; row < 1140; ++row)
    worst = std::max(worst, std::abs(std::pow(shown(450, row), 2.2) - projector::brightness(sinusoid, 450, row)));
  EXPECT_LT(worst, 0.005);  // half a step of 8 bits is at most 2.2 / 510
}

TEST(Window, AMonitorOfAnotherSizeIsRefusedNamingBoth) {
  NEEDS_XVFB;
  const VirtualScreen screen(1024, 768);
  try {
    projector::open_window(on(screen));
    FAIL() << "912x1140 was shown on 1024x768";
  } catch (const BadInput& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("912x1140"), std::string::npos) << text;
    EXPECT_NE(text.find("1024x768"), std::string::npos) << text;
  }
}

TEST(Window, AMonitorSetToAnotherModeIsLostUntilItIsSetBack) {
  NEEDS_XVFB;
  const VirtualScreen screen;
  const auto xrandr = [&](const std::string& what) {
    return std::system(("xrandr --display " + screen.name() + " " + what + " > /dev/null 2>&1").c_str()) == 0;
  };
  const auto set = [&](const std::string& mode) { return xrandr("--output screen --mode " + mode); };
  const bool made =
      xrandr("--newmode 640x480 25 640 650 660 700 480 490 495 500") && xrandr("--addmode screen 640x480");
  SELVEDGE_NEEDS(made, "x11-xserver-utils", "a changed mode");
  const int port = 17280;
  rig::ensure_local_multicast(port);
  const auto configuration = rig::Configuration::parse(
      fmt::format(
          "[bus]\nport = {}\n[projector]\nbackend = \"window\"\nscreen = \"{}\"\nreply_timeout_s = 2\nsettle_s = 0\n",
          port, screen.name()),
      "rig.toml");
  rig::Bus bus(configuration.bus());
  selvedge_rig::device_status_t status{};
  bus.subscribe<selvedge_rig::device_status_t>("PROJECTOR_STATUS", [&](const auto& message) { status = message; });
  std::atomic<bool> stopping{false};
  std::thread daemon([&] { projector::run_daemon(configuration, stopping); });
  const auto becomes = [&](int state) {
    for (const double end_s = rig::host_now_s() + 30; rig::host_now_s() < end_s && status.state != state;)
      bus.handle(0.02);
    return status.state == state;
  };
  EXPECT_TRUE(becomes(selvedge_rig::device_status_t::RUNNING));
  EXPECT_TRUE(set("640x480"));
  EXPECT_TRUE(becomes(selvedge_rig::device_status_t::LOST));
  for (const double end_s = rig::host_now_s() + 2; rig::host_now_s() < end_s;)
    bus.handle(0.02);  // it is opened anew, and refused
  EXPECT_EQ(status.state, selvedge_rig::device_status_t::LOST);
  EXPECT_NE(status.message.find("640x480"), std::string::npos) << status.message;
  EXPECT_TRUE(set("912x1140"));
  EXPECT_TRUE(becomes(selvedge_rig::device_status_t::RUNNING));
  stopping = true;
  daemon.join();
}

TEST(Window, TheConfigurationNamesItsKeys) {
  const auto read = [](const std::string& keys) {
    return projector::read_configuration(
        rig::Configuration::parse("[projector]\nbackend = \"window\"\n" + keys, "rig.toml").section("projector"));
  };
  const auto options = read("screen = \":3\"\nmonitor = 1\nwidth_px = 1280\nheight_px = 720\ngamma = 2.2\n").window;
  EXPECT_EQ(options.screen, ":3");
  EXPECT_EQ(options.monitor, 1);
  EXPECT_EQ(options.width_px, 1280);
  EXPECT_EQ(options.height_px, 720);
  EXPECT_EQ(options.gamma, 2.2);
  EXPECT_THROW(read("exposure_s = 0.01\n"), BadInput);  // the other back-end's
}

TEST(Window, NoScreenIsSaid) {
  WindowOptions options;
  options.screen = ":6543";
  EXPECT_THROW(projector::open_window(options), wire::Disconnected);
}

TEST(Window, AServerThatDiesWhileItIsAskedDoesNotEndTheProcess) {
  NEEDS_XVFB;
  VirtualScreen screen;
  const auto window = projector::open_window(on(screen));
  screen.hang();
  EXPECT_THROW(window->show({.kind = PatternKind::solid}), wire::Disconnected);
  screen.stop();
  EXPECT_THROW(window->show({.kind = PatternKind::solid}), wire::Disconnected);
}

}  // namespace
}  // namespace selvedge
