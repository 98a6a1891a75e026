#include "console/requests.h"

#include <algorithm>
#include <vector>

#include "capture/trial/names.h"
#include "files/bad_input.h"
#include "files/json_reader.h"
#include "files/whole_file.h"

namespace selvedge::console {

using nlohmann::json;

json read_body(const std::string& body) {
  const json value = body.empty() ? json::object() : files::parse_json(body, "body");
  if (!value.is_object()) refuse("body", "found {}, expected a JSON object", files::shown(value));
  return value;
}

session::TrialPlan trial_of(const json& wanted) {
  static const std::vector<std::string> known = {"name",   "kind",        "duration_s",   "lead_in_s",
                                                 "tail_s", "amplitude_m", "frequency_hz", "ramp_s"};
  if (!wanted.is_object()) refuse("trial", "expected an object");
  for (const auto& [key, value] : wanted.items())
    if (std::find(known.begin(), known.end(), key) == known.end()) refuse("trial " + key, "unknown key");
  const auto number = [&](const char* key, double fallback, double least, double most) {
    const json value = wanted.value(key, json(fallback));
    if (!value.is_number() || value.get<double>() < least || value.get<double>() > most)
      refuse(std::string("trial ") + key, "found {}, expected {} to {}", value.dump(), least, most);
    return value.get<double>();
  };
  session::TrialPlan plan;
  const json name = wanted.value("name", json("trial"));
  if (!name.is_string() || !trial::is_plain_name(name) || name.get<std::string>().size() > 60)
    refuse("trial name", "found {:.80}, expected small letters, digits, - and _", name.dump());
  plan.name = name;
  const json kind = wanted.value("kind", json("static"));
  const auto known_kind = kind.is_string() ? trial::experiment_named(kind) : std::nullopt;
  if (!known_kind) refuse("trial kind", "found {:.60}, expected static, waving or robot", kind.dump());
  plan.kind = *known_kind;
  plan.duration_s = number("duration_s", 3, 1, 120);
  plan.lead_in_s = number("lead_in_s", 0.3, 0.1, 10);
  plan.tail_s = number("tail_s", plan.tail_s, 0, 60);
  if (plan.kind != trial::Experiment::static_hang && plan.lead_in_s + plan.tail_s + 0.5 > plan.duration_s)
    refuse("trial duration_s", "found {} s, expected at least half a second beyond lead_in_s and tail_s",
           plan.duration_s);
  plan.amplitude_m = number("amplitude_m", 0.035, 0.001, 0.2);
  plan.frequency_hz = number("frequency_hz", 0.9, 0.05, 5);
  plan.ramp_s = number("ramp_s", 0.4, 0.1, 5);
  plan.attempts = 1;
  return plan;
}

PromptAnswer prompt_answer_of(const json& body) {
  const json prompt = body.value("prompt", json(0)), text = body.value("answer", json(""));
  if (!prompt.is_number_integer()) refuse("prompt", "found {}, expected a whole number", files::shown(prompt));
  if (!text.is_string()) refuse("answer", "found {}, expected a text", files::shown(text));
  return {prompt.get<int64_t>(), text.get<std::string>()};
}

size_t frame_index_of(const std::string& text) {
  if (text.empty() || text.size() > 7 || text.find_first_not_of("0123456789") != std::string::npos)
    refuse("index", "found {}, expected a frame's number", in_quotes(text));
  return std::stoul(text);
}

}  // namespace selvedge::console
