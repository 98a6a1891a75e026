#include "capture/session/operator_stop.h"

#include <chrono>
#include <thread>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "capture/session/terminal.h"
#include "rig/arm/control_link.h"
#include "rig/clock.h"

namespace selvedge::session {

namespace {

constexpr int kLook_ms = 100;
constexpr double kSettle_s = 2;  // for the arm's state to say what was just done

void lift(RigClient& rig, int64_t stop_number, const std::string& whose_word) {
  try {
    arm::ControlClient(rig.arm_socket()).reset(stop_number, whose_word);
    for (const double until_s = rig::host_now_s() + kSettle_s; stop_holds(rig) && rig::host_now_s() < until_s;)
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
  } catch (const std::runtime_error& error) {
    spdlog::warn("the stop holds: {}",
                 error.what());  // another came meanwhile, or the daemon is away: it is asked again
  }
}

}  // namespace

bool stop_holds(const RigClient& rig) {
  const auto state = rig.arm_state();
  return state && state->latched;
}

void require_no_stop(const RigClient& rig) {
  if (const auto state = rig.arm_state(); state && state->latched)
    throw ArmStopped("arm: stopped: " + state->stop_text);
}

void wait_for_reset(RigClient& rig, const report::ProgressCallback& progress) {
  Terminal terminal;
  int64_t asked_stop = 0, prompt_id = 0;
  while (true) {
    const auto state = rig.arm_state();
    if (!state || !state->latched) return;
    // Another stop is another question: a word that was given for the first says nothing of the second.
    if (state->stop_number != asked_stop) {
      asked_stop = state->stop_number;
      selvedge_rig::operator_prompt_t prompt{};
      prompt.step = "reset_stop";
      prompt.text = fmt::format(
          "the arm was stopped: {}. Nothing goes on before the stop is reset. When everybody is clear of the arm, "
          "answer \"reset\"",
          state->stop_text);
      prompt_id = rig.ask(prompt);
      spdlog::warn("{}", prompt.text);
      terminal.say(prompt.text + ":");
    }
    rig.remind();
    progress(0, "stopped: waiting for a person to reset it");
    const std::string typed = terminal.line(kLook_ms);
    if (typed == "reset") lift(rig, asked_stop, "a person at the session's terminal");
    else if (rig.take_answer(prompt_id) == "reset") lift(rig, asked_stop, "a person's answer to the session");
  }
}

}  // namespace selvedge::session
