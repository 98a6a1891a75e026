// Names of the bus channels: <DEVICE>_<WHAT> in capitals, device as named in the configuration.
// One publisher a channel, so that a step in the sequence numbers is a lost message. Control of the arm does not travel
// here (rig/arm/control_link.h).
#pragma once

#include <cctype>
#include <string>

namespace selvedge::rig {

inline std::string channel(const std::string& device, const char* what) {
  std::string name;
  for (const char letter : device) name += static_cast<char>(std::toupper(static_cast<unsigned char>(letter)));
  return name + "_" + what;
}

// WHAT of each message type.
inline constexpr const char* kStatus = "STATUS";    // device_status_t
inline constexpr const char* kClock = "CLOCK";      // clock_map_t
inline constexpr const char* kCorners = "CORNERS";  // corner_sample_t
inline constexpr const char* kStamp = "STAMP";      // frame_stamp_t
inline constexpr const char* kPreview = "PREVIEW";  // preview_t
inline constexpr const char* kCommand = "COMMAND";  // camera_ or projector_command_t
inline constexpr const char* kPattern = "PATTERN";  // projector_status_t
inline constexpr const char* kArm = "ARM";          // arm_status_t

inline constexpr const char* kOperatorPrompt = "OPERATOR_PROMPT";  // operator_prompt_t
inline constexpr const char* kOperatorAnswer = "OPERATOR_ANSWER";  // operator_answer_t
inline constexpr const char* kSessionStatus = "SESSION_STATUS";    // session_status_t

}  // namespace selvedge::rig
