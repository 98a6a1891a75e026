// selvedge_projector_window: shows on a screen what the window back-end (rig/projector/backends/window.cpp) tells it.
//
//   selvedge_projector_window MONITOR WIDTH_PX HEIGHT_PX GAMMA SETTLE_S
//
// One borderless full-screen window of SDL's under X11, one pattern pixel a screen pixel, no scaling. Standard input is
// a socket of packets (window_packets.h): a request a packet, an answer a packet. A process of its own because Xlib
// waits for a silent server for ever and answers a lost one by exit(1); so may this program, whose end the daemon
// notices. Source: SDL 2 wiki.
#define SDL_MAIN_HANDLED
#include <SDL.h>
#include <SDL_syswm.h>
#include <X11/extensions/Xrandr.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <span>
#include <string>
#include <thread>

#include <fmt/format.h>

#include "files/bad_input.h"
#include "rig/projector/backends/window_packets.h"
#include "rig/projector/projector.h"
#include "rig/wire/bytes.h"
#include "rig/wire/socket.h"

namespace selvedge::projector {

namespace {

// SDL's video on one X display, while this lives.
class Video {
 public:
  Video() {
    SDL_SetMainReady();
    SDL_SetHint(SDL_HINT_VIDEODRIVER, "x11");
    SDL_SetHint(SDL_HINT_NO_SIGNAL_HANDLERS, "1");            // Ctrl-C is the daemon's
    SDL_SetHint(SDL_HINT_VIDEO_MINIMIZE_ON_FOCUS_LOSS, "0");  // the operator works on another screen
    if (SDL_InitSubSystem(SDL_INIT_VIDEO) != 0) {
      const char* at = std::getenv("DISPLAY");
      throw wire::Disconnected(fmt::format("no X server at screen \"{}\": {}", at ? at : "", SDL_GetError()));
    }
  }
  ~Video() { SDL_QuitSubSystem(SDL_INIT_VIDEO); }
  Video(const Video&) = delete;
  Video& operator=(const Video&) = delete;
};

template <class T, void (*destroy)(T*)>
struct Destroy {
  void operator()(T* thing) const { destroy(thing); }
};
using Window = std::unique_ptr<SDL_Window, Destroy<SDL_Window, SDL_DestroyWindow>>;
using Renderer = std::unique_ptr<SDL_Renderer, Destroy<SDL_Renderer, SDL_DestroyRenderer>>;
using Texture = std::unique_ptr<SDL_Texture, Destroy<SDL_Texture, SDL_DestroyTexture>>;

template <class Thing>
Thing made(Thing thing, const char* what) {
  if (!thing) throw ProjectorFault(fmt::format("no {}: {}", what, SDL_GetError()));
  return thing;
}

SDL_Rect monitor_of(const WindowOptions& o) {
  const int monitors = SDL_GetNumVideoDisplays();
  if (o.monitor >= monitors)
    refuse("projector monitor", "found {}, expected below {}, the monitors of this screen", o.monitor, monitors);
  SDL_Rect at{};
  if (SDL_GetDisplayBounds(o.monitor, &at) != 0) throw ProjectorFault(SDL_GetError());
  if (at.w != o.width_px || at.h != o.height_px)
    refuse("projector width_px, height_px", "found {}x{}, expected {}x{}, what monitor {} is set to", o.width_px,
           o.height_px, at.w, at.h, o.monitor);
  return at;
}

Window window_on(const SDL_Rect& at) {
  return made(
      Window(SDL_CreateWindow("Selvedge projector", at.x, at.y, at.w, at.h,
                              SDL_WINDOW_FULLSCREEN_DESKTOP | SDL_WINDOW_BORDERLESS | SDL_WINDOW_ALWAYS_ON_TOP)),
      "window");
}

class Shown {
 public:
  explicit Shown(const WindowOptions& options)
      : options_(options), at_(monitor_of(options)), window_(window_on(at_)),
        renderer_(made(Renderer(SDL_CreateRenderer(window_.get(), -1, SDL_RENDERER_PRESENTVSYNC)), "renderer")),
        texture_(made(Texture(SDL_CreateTexture(renderer_.get(), SDL_PIXELFORMAT_ARGB8888, SDL_TEXTUREACCESS_STREAMING,
                                                options.width_px, options.height_px)),
                      "texture")) {
    SDL_ShowCursor(SDL_DISABLE);
    SDL_PumpEvents();  // where the window manager has put it
    show({});
  }

  void show(const Pattern& pattern) {
    check_size();
    draw(pattern);
    present();  // may wait in a back buffer
    present();
    std::this_thread::sleep_for(std::chrono::duration<double>(options_.settle_s));
  }

  void check() {
    for (SDL_Event event; SDL_PollEvent(&event) != 0;) {
      const bool closed =
          event.type == SDL_QUIT || (event.type == SDL_WINDOWEVENT && event.window.event == SDL_WINDOWEVENT_CLOSE);
      if (closed) throw wire::Disconnected("it was closed");
      if (event.type == SDL_DISPLAYEVENT && event.display.event == SDL_DISPLAYEVENT_DISCONNECTED)
        throw wire::Disconnected("a monitor was unplugged");
    }
    check_size();
    present();  // what was covered shows again, and a server that hangs is noticed: events alone wait for nobody
    if ((SDL_GetWindowFlags(window_.get()) & (SDL_WINDOW_MINIMIZED | SDL_WINDOW_HIDDEN)) != 0)
      throw ProjectorFault("it is hidden");
  }

  std::string description() const {
    SDL_RendererInfo info;
    SDL_GetRendererInfo(renderer_.get(), &info);
    SDL_DisplayMode mode;
    SDL_GetCurrentDisplayMode(options_.monitor, &mode);
    return fmt::format("window of {}x{} px on monitor {} of {}, {} Hz, drawn by {}", options_.width_px,
                       options_.height_px, options_.monitor, SDL_GetDisplayName(options_.monitor), mode.refresh_rate,
                       info.name);
  }

 private:
  // A monitor set to another mode, or moved, would show part of a pattern, or show it scaled. SDL does not notice.
  void check_size() {
    SDL_SysWMinfo system;
    SDL_VERSION(&system.version);
    if (SDL_GetWindowWMInfo(window_.get(), &system) == SDL_FALSE) throw ProjectorFault(SDL_GetError());
    Display* const display = system.info.x11.display;
    int count = 0;
    const std::unique_ptr<XRRMonitorInfo, void (*)(XRRMonitorInfo*)> monitors(
        XRRGetMonitors(display, DefaultRootWindow(display), True, &count), XRRFreeMonitors);
    std::string found;
    bool whole = false;
    for (const XRRMonitorInfo& m : std::span(monitors.get(), static_cast<size_t>(std::max(count, 0)))) {
      whole = whole || (m.x == at_.x && m.y == at_.y && m.width == at_.w && m.height == at_.h);
      found += fmt::format("{}{}x{} at ({}, {})", found.empty() ? "" : ", ", m.width, m.height, m.x, m.y);
    }
    if (!whole)
      throw wire::Disconnected(fmt::format("found monitors of {}, expected one of {}x{} at ({}, {})",
                                           found.empty() ? "nothing" : found, at_.w, at_.h, at_.x, at_.y));
    int width_px = 0, height_px = 0;
    SDL_GetRendererOutputSize(renderer_.get(), &width_px, &height_px);
    if (width_px != options_.width_px || height_px != options_.height_px)
      throw ProjectorFault(
          fmt::format("it is {}x{} px, expected {}x{}", width_px, height_px, options_.width_px, options_.height_px));
  }

  void present() {
    if (SDL_RenderCopy(renderer_.get(), texture_.get(), nullptr, nullptr) != 0) throw ProjectorFault(SDL_GetError());
    SDL_RenderPresent(renderer_.get());
  }

  void draw(const Pattern& pattern) {
    void* pixels = nullptr;
    int pitch = 0;
    if (SDL_LockTexture(texture_.get(), nullptr, &pixels, &pitch) != 0) throw ProjectorFault(SDL_GetError());
    for (int row = 0; row < options_.height_px; ++row) {
      auto* const out =
          reinterpret_cast<Uint32*>(static_cast<Uint8*>(pixels) + static_cast<std::ptrdiff_t>(row) * pitch);
      for (int column = 0; column < options_.width_px; ++column) {
        const auto drive =
            static_cast<Uint32>(std::lround(255 * std::pow(brightness(pattern, column, row), 1 / options_.gamma)));
        out[column] = 0xFF000000U | drive << 16 | drive << 8 | drive;
      }
    }
    SDL_UnlockTexture(texture_.get());
  }

  WindowOptions options_;
  Video video_;
  SDL_Rect at_;
  Window window_;
  Renderer renderer_;
  Texture texture_;
};

window::Answer answer_to(Shown& shown, const window::Request& request) {
  try {
    if (request.show) shown.show(request.pattern);
    else shown.check();
    return window::answer(window::Outcome::done, "");
  } catch (const ProjectorFault& error) { return window::answer(window::Outcome::fault, error.what()); }
}

// The options of the command line, which the back-end wrote; the screen is the environment's DISPLAY.
WindowOptions options_of(char** words) {
  WindowOptions o;
  o.monitor = std::atoi(words[0]);
  o.width_px = std::atoi(words[1]);
  o.height_px = std::atoi(words[2]);
  o.gamma = std::atof(words[3]);
  o.settle_s = std::atof(words[4]);
  return o;
}

void serve(const WindowOptions& options, const wire::Socket& peer) {
  const auto send = [&](const window::Answer& answer) {
    peer.send({reinterpret_cast<const std::uint8_t*>(&answer), sizeof answer});
  };
  std::unique_ptr<Shown> shown;
  try {
    shown = std::make_unique<Shown>(options);
  } catch (const BadInput& error) {
    return send(window::answer(window::Outcome::refused, error.what()));
  } catch (const ProjectorFault& error) {
    return send(window::answer(window::Outcome::fault, error.what()));
  } catch (const wire::Disconnected& error) { return send(window::answer(window::Outcome::lost, error.what())); }
  send(window::answer(window::Outcome::done, shown->description()));
  for (std::array<std::uint8_t, sizeof(window::Request)> packet;;) {
    if (!peer.readable(3600)) continue;
    const size_t count = peer.receive(packet);
    try {
      send(answer_to(*shown, window::decode_request(std::span(packet).first(count))));
    } catch (const wire::WireError& error) {
      return send(window::answer(window::Outcome::fault, error.what()));
    } catch (const wire::Disconnected& error) { return send(window::answer(window::Outcome::lost, error.what())); }
  }
}

}  // namespace

}  // namespace selvedge::projector

int main(int count, char** words) {
  if (count != 6) {
    std::fputs("selvedge_projector_window is started by the projector's daemon: selvedge daemon projector\n", stderr);
    return 2;
  }
  try {
    const selvedge::wire::Socket peer(0);
    selvedge::projector::serve(selvedge::projector::options_of(words + 1), peer);
  } catch (const selvedge::wire::Disconnected&) {
    return 0;  // the daemon ended
  }
}
