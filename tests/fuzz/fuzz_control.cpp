// The arm's control socket: the byte stream of a connection, as the daemon and its client take it apart.
#include "rig/arm/control_link.h"
#include "rig/wire/bytes.h"

using namespace selvedge;
using namespace selvedge::arm;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  std::vector<uint8_t> received(data, data + size);
  try {
    while (const auto frame = take_frame(received)) switch (frame->kind) {
        case FrameKind::control: decode_payload<selvedge_rig::arm_control_t>(frame->payload); break;
        case FrameKind::command: decode_payload<selvedge_rig::arm_command_t>(frame->payload); break;
        case FrameKind::trajectory: decode_payload<selvedge_rig::arm_trajectory_t>(frame->payload); break;
        case FrameKind::answer: decode_payload<selvedge_rig::arm_answer_t>(frame->payload); break;
      }
  } catch (const wire::WireError&) {}
  return 0;
}
