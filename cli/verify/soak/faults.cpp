#include "cli/verify/soak/faults.h"

#include <algorithm>

namespace selvedge::cli {

const char* to_text(FaultKind kind) {
  switch (kind) {
    case FaultKind::packet_loss: return "packet loss";
    case FaultKind::camera_stall: return "camera stalls";
    case FaultKind::camera_unplugged: return "camera unplugged";
    case FaultKind::camera_clock_jump: return "camera clock jumps";
    case FaultKind::tracker_stall: return "tracker stalls";
    case FaultKind::tracker_cut: return "tracker cut off";
    case FaultKind::occlusion: return "occlusion";
    case FaultKind::projector_hang: return "projector hangs";
    case FaultKind::projector_cut: return "projector cut off";
    case FaultKind::arm_cut: return "arm cut off";
    case FaultKind::arm_protective_stop: return "protective stop";
    case FaultKind::full_disk: return "full disk";
    case FaultKind::kill_camera: return "kill -9 camera";
    case FaultKind::kill_tracker: return "kill -9 tracker";
    case FaultKind::kill_projector: return "kill -9 projector";
    case FaultKind::kill_arm: return "kill -9 arm";
    case FaultKind::kill_recorder: return "kill -9 recorder";
    case FaultKind::operator_stop: return "operator's stop";
    case FaultKind::stop_in_flood: return "stop before a flood";
    case FaultKind::second_sender: return "second sender";
    case FaultKind::kill_console: return "kill -9 console";
    case FaultKind::stolen_script: break;
  }
  return "stolen script port";
}

Fault FaultDeck::draw() {
  if (left_.empty()) {
    for (int kind = 0; kind < kFaultKinds; ++kind) left_.push_back(static_cast<FaultKind>(kind));
    std::shuffle(left_.begin(), left_.end(), random_);
  }
  Fault fault{left_.back(), 0, between(0.5, 2), between(0, 1) < 0.6};
  left_.pop_back();
  switch (fault.kind) {
    case FaultKind::packet_loss:
      fault.amount = between(0.005, 0.05);
      fault.duration_s = between(2, 6);
      break;
    case FaultKind::camera_stall:
      fault.amount = between(0.1, 0.8);
      fault.duration_s = between(1, 3);
      break;
    case FaultKind::camera_clock_jump: fault.amount = between(0.1, 3) * (between(0, 1) < 0.5 ? -1 : 1); break;
    case FaultKind::camera_unplugged: fault.duration_s = between(0.5, 5); break;
    default: break;
  }
  return fault;
}

}  // namespace selvedge::cli
