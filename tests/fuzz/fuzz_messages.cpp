// Every message of the bus, as a stranger might send it.
#include <selvedge_rig/arm_answer_t.hpp>
#include <selvedge_rig/arm_command_t.hpp>
#include <selvedge_rig/arm_control_t.hpp>
#include <selvedge_rig/arm_status_t.hpp>
#include <selvedge_rig/arm_trajectory_t.hpp>
#include <selvedge_rig/camera_command_t.hpp>
#include <selvedge_rig/clock_map_t.hpp>
#include <selvedge_rig/corner_sample_t.hpp>
#include <selvedge_rig/device_status_t.hpp>
#include <selvedge_rig/frame_stamp_t.hpp>
#include <selvedge_rig/operator_answer_t.hpp>
#include <selvedge_rig/operator_prompt_t.hpp>
#include <selvedge_rig/preview_t.hpp>
#include <selvedge_rig/projector_command_t.hpp>
#include <selvedge_rig/projector_status_t.hpp>
#include <selvedge_rig/session_status_t.hpp>

#include <cstdlib>
#include <cstring>
#include <iterator>
#include <stdexcept>
#include <vector>

#include "rig/bus_signature.h"

namespace {

// With the fingerprint that the decoder asks for first: what follows it is what can do harm.
template <class Message>
void decode(const uint8_t* data, size_t size) {
  std::vector<uint8_t> bytes(8 + size);
  const auto fingerprint = static_cast<uint64_t>(Message::getHash());
  for (int i = 0; i < 8; ++i) bytes[static_cast<size_t>(i)] = static_cast<uint8_t>(fingerprint >> (56 - 8 * i));
  if (size > 0) std::memcpy(bytes.data() + 8, data, size);
  Message message;
  try {
    message.decode(bytes.data(), 0, static_cast<int>(bytes.size()));
  } catch (const std::length_error&) {  // bounded_size; the bus counts it
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace selvedge_rig;
  if (size < 1) return 0;
  using Decode = void (*)(const uint8_t*, size_t);
  static constexpr Decode all[] = {
      decode<arm_command_t>,      decode<arm_control_t>,     decode<arm_status_t>,      decode<arm_trajectory_t>,
      decode<camera_command_t>,   decode<clock_map_t>,       decode<corner_sample_t>,   decode<device_status_t>,
      decode<frame_stamp_t>,      decode<operator_prompt_t>, decode<preview_t>,         decode<projector_command_t>,
      decode<projector_status_t>, decode<session_status_t>,  decode<operator_answer_t>, decode<arm_answer_t>};
  all[data[0] % std::size(all)](data + 1, size - 1);
  // As the bus does before it decodes: nobody without the key signs.
  static const selvedge::rig::BusSignature signature(selvedge::rig::BusKey{7});
  if (signature.holds("tracker", data, size)) std::abort();
  return 0;
}
