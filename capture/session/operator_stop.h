// A stop at the rig is final: a session goes no further until a person says so.
//
// The stop holds in the arm's daemon (rig/arm/motion_guard.h), whoever gave it and whatever the session did then:
// waiting, asking, calibrating, recording. The session sees it in the arm's state, gives up what it records, asks
// ("reset_stop") and waits as long as it takes. The answer "reset" to that very question, at the console or at the
// session's terminal, or `./selvedge arm reset`, lifts it.
#pragma once

#include "capture/session/rig_client.h"
#include "report/progress.h"

namespace selvedge::session {

// The arm stopped, or would not move; the text says why in the daemon's words.
class ArmStopped : public DeviceFailed {
 public:
  using DeviceFailed::DeviceFailed;
};

bool stop_holds(const RigClient& rig);

// Throws ArmStopped where a stop holds.
void require_no_stop(const RigClient& rig);

// Returns once no stop holds. Where one does, asks for it and waits.
void wait_for_reset(RigClient& rig, const report::ProgressCallback& progress);

}  // namespace selvedge::session
