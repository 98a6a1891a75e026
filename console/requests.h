// What the bodies and parameters of the console's requests say. Each throws BadInput naming the key, what was found and
// what was expected.
#pragma once

#include <cstdint>
#include <string>

#include <nlohmann/json.hpp>

#include "capture/session/session_plan.h"

namespace selvedge::console {

// A body's JSON; an empty object where there is no body. Refuses what is no object, too.
nlohmann::json read_body(const std::string& body);

// /api/record: the trial that a page asks for. Refuses unknown keys and values out of range as a session file would.
session::TrialPlan trial_of(const nlohmann::json& body);

// /api/answer: {"prompt": 3, "answer": "yes"}.
struct PromptAnswer {
  int64_t prompt = 0;
  std::string text;
};
PromptAnswer prompt_answer_of(const nlohmann::json& body);

// A frame's number as a parameter: up to seven digits.
size_t frame_index_of(const std::string& text);

}  // namespace selvedge::console
