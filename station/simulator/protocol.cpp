#include "station/simulator/protocol.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <utility>

#include <nlohmann/json.hpp>

#include "files/bad_input.h"
#include "files/nesting.h"

namespace selvedge::station {

namespace {

using cloth::Hold;
using nlohmann::json;

constexpr const char* kProtocol = "simulator/1";

constexpr std::array<std::pair<Hold, const char*>, 3> kHolds = {
    {{Hold::corners, "corners"}, {Hold::top_edge, "top_edge"}, {Hold::top_edge_clamped, "top_edge_clamped"}}};

json rows_of(const Eigen::Matrix3Xd& x) {
  json rows = json::array();
  for (const auto& column : x.colwise()) rows.push_back({column.x(), column.y(), column.z()});
  return rows;
}

// One object of a line, key by key; every refusal says the key, what was found and what was expected.
class SaidObject {
 public:
  SaidObject(const json& object, std::string where) : object_(object), where_(std::move(where)) {
    if (!object.is_object()) refuse(where_, "found {}, expected a JSON object", in_quotes(object.dump()));
  }
  bool has(const char* key) const { return object_.contains(key); }
  const json& value(const char* key) const {
    if (!has(key)) refuse(where_, "found no \"{}\", expected it", key);
    return object_.at(key);
  }
  std::string text(const char* key) const { return of_kind<std::string>(key, value(key).is_string(), "a text"); }
  std::string text_or(const char* key, const std::string& missing) const { return has(key) ? text(key) : missing; }
  double number(const char* key) const { return of_kind<double>(key, value(key).is_number(), "a number"); }
  bool truth_or(const char* key, bool missing) const {
    return has(key) ? of_kind<bool>(key, value(key).is_boolean(), "true or false") : missing;
  }
  int count_or(const char* key, int missing, int least) const {
    if (!has(key)) return missing;
    const bool is_whole = value(key).is_number_integer() && value(key) >= least && value(key) <= 1'000'000;
    return of_kind<int>(key, is_whole, fmt::format("a whole number of at least {}", least));
  }
  const json& list(const char* key) const {
    if (!value(key).is_array()) refuse_value(key, "a list");
    return value(key);
  }
  [[noreturn]] void refuse_value(const char* key, const std::string& expected) const {
    refuse(where_, "\"{}\": found {}, expected {}", key, in_quotes(value(key).dump()), expected);
  }
  void allow_only(const std::set<std::string>& keys) const {
    for (const auto& [key, value] : object_.items())
      if (!keys.count(key))
        refuse(where_, "found the key {}, expected none but those of {}", in_quotes(key), kProtocol);
  }
  const std::string& where() const { return where_; }

 private:
  template <class Kind>
  Kind of_kind(const char* key, bool is_one, const std::string& expected) const {
    if (!is_one) refuse_value(key, expected);
    return value(key).get<Kind>();
  }
  const json& object_;
  std::string where_;
};

json parsed(const std::string& line, const std::string& where) {
  files::refuse_deep_json(line, where);
  json object = json::parse(line, nullptr, false);
  if (!object.is_discarded()) return object;
  const bool nan = line.find("NaN") != std::string::npos || line.find("nan") != std::string::npos;
  refuse(where, "found {}, expected one JSON object on a line{}", in_quotes(line),
         nan ? " (a run that diverged is answered with {\"run\": …, \"error\": \"…\"}, not with NaN)" : "");
}

SimulatorParameter parameter_from(const json& object, const std::string& where) {
  const SaidObject said(object, where);
  SimulatorParameter p;
  p.name = said.text("name");
  const SaidObject named(object, where + " " + p.name);
  named.allow_only({"name", "unit", "default", "lower", "upper", "log", "motion_only", "tried"});
  p.unit = named.text_or("unit", "");
  p.usual = named.number("default");
  p.lower = named.number("lower");
  p.upper = named.number("upper");
  p.logarithmic = named.truth_or("log", false);
  p.motion_only = named.truth_or("motion_only", false);
  const auto within_bounds = [&](double value) { return value >= p.lower && value <= p.upper; };
  if (p.name.empty()) named.refuse_value("name", "a name");
  if (!(p.lower < p.upper)) named.refuse_value("lower", fmt::format("less than \"upper\", {}", p.upper));
  if (p.logarithmic && !(p.lower > 0)) named.refuse_value("lower", "above 0, as its logarithm is fitted");
  if (!within_bounds(p.usual)) named.refuse_value("default", fmt::format("within {} and {}", p.lower, p.upper));
  if (named.has("tried"))
    for (const json& value : named.list("tried")) {
      if (!value.is_number() || !within_bounds(value)) named.refuse_value("tried", "numbers within the bounds");
      p.tried.push_back(value);
    }
  return p;
}

void append_positions(const json& value, std::vector<double>& into, const std::string& where) {
  if (value.is_array()) {
    for (const json& part : value) append_positions(part, into, where);
  } else if (value.is_number()) {
    into.push_back(value.get<double>());
  } else {
    refuse(where, "\"positions\": found {}, expected numbers", in_quotes(value.dump()));
  }
}

}  // namespace

const char* to_text(Hold hold) {
  for (const auto& [of, text] : kHolds)
    if (of == hold) return text;
  return "nothing";
}

std::string hello_line(const SimulatorHello& hello) {
  json parameters = json::array(), holds = json::array();
  for (const SimulatorParameter& p : hello.parameters)
    parameters.push_back({{"name", p.name},
                          {"unit", p.unit},
                          {"default", p.usual},
                          {"lower", p.lower},
                          {"upper", p.upper},
                          {"log", p.logarithmic},
                          {"motion_only", p.motion_only},
                          {"tried", p.tried}});
  for (const Hold hold : hello.holds) holds.push_back(to_text(hold));
  return json{{"protocol", kProtocol},    {"name", hello.name},
              {"version", hello.version}, {"parameters", parameters},
              {"holds", holds},           {"start_shape", hello.start_shape},
              {"at_once", hello.at_once}, {"processes", hello.processes}}
      .dump();
}

SimulatorHello hello_from(const std::string& line, const std::string& where) {
  const std::string place = where + ": what it says first";
  const json object = parsed(line, place);
  const SaidObject said(object, place);
  if (said.text("protocol") != kProtocol) said.refuse_value("protocol", fmt::format("\"{}\"", kProtocol));
  said.allow_only({"protocol", "name", "version", "parameters", "holds", "start_shape", "at_once", "processes"});
  SimulatorHello hello;
  hello.name = said.text("name");
  hello.version = said.text_or("version", "");
  std::set<std::string> names;
  for (const json& p : said.list("parameters")) {
    hello.parameters.push_back(parameter_from(p, place + ": parameter"));
    if (!names.insert(hello.parameters.back().name).second) said.refuse_value("parameters", "each name once");
  }
  if (hello.parameters.empty()) said.refuse_value("parameters", "at least one, to be fitted");
  for (const json& text : said.list("holds")) {
    const auto known = std::find_if(kHolds.begin(), kHolds.end(), [&](const auto& h) { return text == h.second; });
    if (known == kHolds.end()) said.refuse_value("holds", "some of corners, top_edge, top_edge_clamped");
    hello.holds.push_back(known->first);
  }
  if (hello.holds.empty()) said.refuse_value("holds", "at least one of corners, top_edge, top_edge_clamped");
  hello.start_shape = said.truth_or("start_shape", false);
  hello.at_once = said.count_or("at_once", 1, 1);
  hello.processes = said.count_or("processes", 0, 0);
  return hello;
}

std::string trial_line(int number, const SimulatorTrial& t) {
  json points = json::array();
  for (const Eigen::Vector2d& uv : t.points) points.push_back({uv.x(), uv.y()});
  json line = {{"do", "trial"},
               {"trial", number},
               {"width", t.width_m},
               {"height", t.height_m},
               {"mass", t.mass_kg},
               {"hold", to_text(t.hold)},
               {"grip_times", t.grip_s},
               {"left", rows_of(t.left)},
               {"right", rows_of(t.right)},
               {"gravity", {t.gravity_m_s2.x(), t.gravity_m_s2.y(), t.gravity_m_s2.z()}},
               {"start", t.start_s},
               {"points", points},
               {"times", t.time_s}};
  const Eigen::Vector3d& c = t.clamp_direction;
  if (t.hold == Hold::top_edge_clamped) line["clamp_direction"] = {c.x(), c.y(), c.z()};
  return line.dump();
}

std::string run_line(const SimulatorRun& run) {
  json line = {{"do", "run"}, {"run", run.number}, {"trial", run.trial}, {"parameters", run.parameters}};
  if (run.start.cols() > 0) {
    line["shape"] = rows_of(run.start);
    line["hangs"] = run.hangs;
  }
  if (run.more) line["more"] = true;
  return line.dump();
}

SimulatorAnswer answer_from(const std::string& line, const std::string& where, const SimulatorTrial& asked) {
  const std::string place = where + ": its answer";
  const json object = parsed(line, place);
  const SaidObject said(object, place);
  said.allow_only({"run", "floats", "doubles", "positions", "error"});
  SimulatorAnswer answer;
  answer.run = said.count_or("run", -1, 0);
  if (said.has("error")) {
    answer.error = said.text("error");
    if (answer.error.empty()) said.refuse_value("error", "what went wrong");
    return answer;
  }
  const size_t wanted = 3 * asked.points.size() * asked.time_s.size();
  const std::string numbers =
      fmt::format("{} numbers: {} times, {} points, 3 axes", wanted, asked.time_s.size(), asked.points.size());
  for (const auto& [key, follow] : {std::pair{"floats", &answer.floats}, std::pair{"doubles", &answer.doubles}}) {
    if (!said.has(key)) continue;
    if (said.value(key) != wanted) said.refuse_value(key, numbers);
    *follow = wanted;
  }
  if (answer.floats > 0 && answer.doubles > 0) refuse(place, "found \"floats\" and \"doubles\", expected one of them");
  if (answer.floats + answer.doubles == 0) {
    if (!said.has("positions"))
      refuse(place, "found none of \"positions\", \"floats\", \"doubles\", \"error\", expected one");
    append_positions(said.value("positions"), answer.positions, place);
    if (answer.positions.size() != wanted)
      refuse(place, "\"positions\": found {} numbers, expected {}", answer.positions.size(), numbers);
  }
  return answer;
}

}  // namespace selvedge::station
