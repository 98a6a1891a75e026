#include "station/comparison.h"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "files/bad_input.h"
#include "files/whole_file.h"
#include "report/verdict.h"
#include "station/comparison_verdict.h"
#include "station/diagnosis_folder.h"

namespace selvedge::station {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

// The file where it is there; refused where it is no such file.
json read_result_file(const fs::path& path, const std::string& format) {
  if (!fs::exists(path)) return {};
  const json value = files::read_json(path);
  if (!value.is_object() || value.value("/format"_json_pointer, json()) != json(format))
    refuse(path.string(), "expected a JSON object with format \"{}\"", format);
  return value;
}

ComparedResult read_result(const fs::path& folder) {
  ComparedResult result;
  result.fit_folder = folder;
  result.fit = read_result_file(folder / "fit.json", "fit/1");
  result.diagnosis_folder = fs::exists(folder / "diagnosis.json") ? folder : newest_diagnosis_folder(folder);
  result.diagnosis = read_result_file(result.diagnosis_folder / "diagnosis.json", "diagnosis/1");
  return result;
}

bool holds_something(const ComparedResult& r) { return !r.fit.is_null() || !r.diagnosis.is_null(); }

// By fabric; a folder that is no session is one result without a name.
std::map<std::string, ComparedResult> read_results(const fs::path& folder) {
  if (!fs::is_directory(folder)) refuse(folder.string(), "no such folder");
  std::map<std::string, ComparedResult> results;
  const json session = read_result_file(folder / "session.json", "session/1");
  if (session.is_null()) {
    if (ComparedResult result = read_result(folder); holds_something(result)) results[""] = std::move(result);
  } else {
    const json fabrics = session.value("fabrics", json::object());
    for (const auto& [name, summary] : fabrics.items()) {
      if (name.find('/') != std::string::npos || name.find("..") != std::string::npos) continue;
      ComparedResult result = read_result(folder / name);
      result.trials = summary.is_object() ? summary.value("trials", json()) : json();
      if (holds_something(result)) results[name] = std::move(result);
    }
  }
  if (results.empty())
    refuse(folder.string(),
           "found neither fit.json nor diagnosis.json, expected the folder of a fit, a diagnosis or a session");
  return results;
}

json at(const json& value, const char* pointer) {
  const json::json_pointer place(pointer);
  return value.contains(place) ? value.at(place) : json();
}

json number_at(const json& value, const char* pointer) {
  const json found = at(value, pointer);
  return found.is_number() ? found : json();
}

json both(const json& a, const json& b) {
  json out = {{"a", a}, {"b", b}, {"difference", nullptr}};
  if (a.is_number() && b.is_number()) out["difference"] = b.get<double>() - a.get<double>();
  return out;
}

json both_at(const json& a, const json& b, const char* pointer) {
  return both(number_at(a, pointer), number_at(b, pointer));
}

// Two numbers in order, or null.
json interval_at(const json& value, const char* pointer) {
  const json found = at(value, pointer);
  return found.is_array() && found.size() == 2 && found[0].is_number() && found[1].is_number() ? found : json();
}

json apart(const json& a, const json& b) {
  if (a.is_null() || b.is_null()) return {};
  return a[1].get<double>() < b[0].get<double>() || b[1].get<double>() < a[0].get<double>();
}

std::set<std::string> keys_of(const json& a, const json& b) {
  std::set<std::string> keys;
  for (const json* object : {&a, &b})
    if (object->is_object())
      for (const auto& [key, value] : object->items()) keys.insert(key);
  return keys;
}

json entry(const json& object, const std::string& key) {
  return object.is_object() ? object.value(key, json()) : json();
}

json parameter_of_one(const json& p) {
  if (!p.is_object()) return {};
  return {{"value", number_at(p, "/value")},
          {"interval", interval_at(p, "/interval")},
          {"determined", at(p, "/determined")},
          {"at_bound", at(p, "/at_bound")}};
}

json parameters_json(const json& a, const json& b) {
  json out = json::object();
  for (const std::string& name : keys_of(a, b)) {
    const json pa = entry(a, name), pb = entry(b, name);
    json row = both(number_at(pa, "/value"), number_at(pb, "/value"));
    row["unit"] = at(pa.is_null() ? pb : pa, "/unit");
    row["ratio"] = row["difference"].is_null() || row["a"].get<double>() == 0
                       ? json()
                       : json(row["b"].get<double>() / row["a"].get<double>());
    row["apart"] = apart(interval_at(pa, "/interval"), interval_at(pb, "/interval"));
    row["a"] = parameter_of_one(pa);
    row["b"] = parameter_of_one(pb);
    out[name] = row;
  }
  return out;
}

json trials_json(const json& a, const json& b) {
  json out = json::object();
  for (const std::string& name : keys_of(a, b)) {
    const json ta = entry(a, name), tb = entry(b, name);
    out[name] = {
        {"fitted_mm", both_at(ta, tb, "/error_end")},
        {"held_out_mm", both_at(ta, tb, "/error_held_out")},
        {"rigid_plate_mm", both_at(ta, tb, "/error_rigid_plate")},
        {"held_out_interval_mm",
         {{"a", interval_at(ta, "/error_held_out_interval")}, {"b", interval_at(tb, "/error_held_out_interval")}}}};
  }
  return out;
}

json gap_json(const json& a, const json& b) {
  json out;
  for (const char* key : {"value_mm", "noise_floor_mm", "right_model_mm", "held_out_mm", "replicates_mm", "p_value"})
    out[key] = both_at(a, b, (std::string("/gap/") + key).c_str());
  out["interval_mm"] = {{"a", interval_at(a, "/gap/interval_mm")}, {"b", interval_at(b, "/gap/interval_mm")}};
  for (const char* key : {"cause", "side"})
    out[key] = {{"a", at(a, (std::string("/") + key).c_str())}, {"b", at(b, (std::string("/") + key).c_str())}};
  return out;
}

// Probability of every answer, and the share of the gap that an effect closes where it was tried.
json effects_json(const json& a, const json& b) {
  json out = json::object();
  const json pa = entry(a, "probabilities"), pb = entry(b, "probabilities");
  for (const std::string& name : keys_of(pa, pb)) {
    const json sa = entry(entry(a, "shrink"), name), sb = entry(entry(b, "shrink"), name);
    out[name] = {{"probability", both(entry(pa, name), entry(pb, name))},
                 {"closes", both_at(sa, sb, "/fraction")},
                 {"closes_interval", {{"a", interval_at(sa, "/interval")}, {"b", interval_at(sb, "/interval")}}}};
  }
  return out;
}

json where_json(const json& a, const json& b) {
  std::map<std::pair<std::string, std::string>, std::pair<json, json>> cells;
  const auto collect = [&](const json& diagnosis, json std::pair<json, json>::*side) {
    for (const json& cell : entry(diagnosis, "where"))
      if (cell.is_object() && at(cell, "/axis").is_string() && at(cell, "/cell").is_string())
        cells[{cell["axis"], cell["cell"]}].*side = cell;
  };
  collect(a, &std::pair<json, json>::first);
  collect(b, &std::pair<json, json>::second);
  json out = json::array();
  for (const auto& [key, cell] : cells)
    out.push_back({{"axis", key.first},
                   {"cell", key.second},
                   {"share", both_at(cell.first, cell.second, "/share")},
                   {"mm", both_at(cell.first, cell.second, "/mm")}});
  return out;
}

json session_of_one(const json& trials) {
  if (!trials.is_object()) return {};
  int done = 0;
  double lost = 0, frames = 0;
  size_t aside = 0;
  for (const json& trial : trials) {
    done += at(trial, "/state") == json("done");
    if (const json n = number_at(trial, "/frames"); n.is_number()) frames += n.get<double>();
    if (const json n = number_at(trial, "/frames_lost"); n.is_number()) lost += n.get<double>();
    aside += at(trial, "/kept_aside").size();
  }
  return {{"trials", trials.size()}, {"done", done}, {"frames", frames}, {"frames_lost", lost}, {"kept_aside", aside}};
}

json pair_json(const ComparedPair& pair) {
  json out = {{"name", pair.name}, {"held_out_mm", both_at(pair.a.fit, pair.b.fit, "/held_out/error")}};
  out["rigid_plate_mm"] = both_at(pair.a.fit, pair.b.fit, "/held_out/rigid_plate_error");
  out["verdicts"] = {{"fit", {{"a", at(pair.a.fit, "/verdict")}, {"b", at(pair.b.fit, "/verdict")}}},
                     {"diagnosis", {{"a", at(pair.a.diagnosis, "/verdict")}, {"b", at(pair.b.diagnosis, "/verdict")}}}};
  out["models"] = {{"a", at(pair.a.fit, "/model")}, {"b", at(pair.b.fit, "/model")}};
  out["held_out_by"] = {{"a", at(pair.a.fit, "/held_out/by")}, {"b", at(pair.b.fit, "/held_out/by")}};
  out["evaluations"] = both_at(pair.a.fit, pair.b.fit, "/evaluations");
  out["parameters"] = parameters_json(entry(pair.a.fit, "parameters"), entry(pair.b.fit, "parameters"));
  out["trials"] = trials_json(entry(pair.a.fit, "trials"), entry(pair.b.fit, "trials"));
  if (!pair.a.diagnosis.is_null() || !pair.b.diagnosis.is_null()) {
    out["gap"] = gap_json(pair.a.diagnosis, pair.b.diagnosis);
    out["effects"] = effects_json(pair.a.diagnosis, pair.b.diagnosis);
    out["where"] = where_json(pair.a.diagnosis, pair.b.diagnosis);
  }
  if (!pair.a.trials.is_null() || !pair.b.trials.is_null())
    out["session"] = {{"a", session_of_one(pair.a.trials)}, {"b", session_of_one(pair.b.trials)}};
  out["better"] = better_of(out);
  out["verdict"] = report::to_json(verdict_of_pair(out));
  return out;
}

std::string name_of_result(const std::string& fabric, const ComparedResult& r) {
  if (!fabric.empty()) return fabric;
  const json campaign = at(r.fit.is_null() ? r.diagnosis : r.fit, "/campaign");
  return campaign.is_string() ? campaign.get<std::string>() : fs::weakly_canonical(r.fit_folder).filename().string();
}

}  // namespace

Comparison read_comparison(const fs::path& a, const fs::path& b) {
  Comparison out{a, b, {}, {}, {}};
  const auto left = read_results(a), right = read_results(b);
  if (left.size() == 1 && right.size() == 1) {
    const std::string one = name_of_result(left.begin()->first, left.begin()->second),
                      other = name_of_result(right.begin()->first, right.begin()->second);
    out.pairs.push_back({one == other ? one : one + " and " + other, left.begin()->second, right.begin()->second});
    return out;
  }
  for (const auto& [name, result] : left) {
    const auto found = right.find(name);
    if (found == right.end()) out.only_a.push_back(name);
    else out.pairs.push_back({name, result, found->second});
  }
  for (const auto& [name, result] : right)
    if (!left.contains(name)) out.only_b.push_back(name);
  if (out.pairs.empty())
    refuse(a.string() + ", " + b.string(),
           "no fabric is in both; name the folder of one fabric in a session to compare it with another");
  return out;
}

json to_json(const Comparison& comparison) {
  json pairs = json::array();
  for (const ComparedPair& pair : comparison.pairs) pairs.push_back(pair_json(pair));
  return {{"format", "comparison/1"},
          {"verdict", report::to_json(verdict_of_pairs(pairs))},
          {"a", comparison.a.string()},
          {"b", comparison.b.string()},
          {"pairs", pairs},
          {"only_a", comparison.only_a},
          {"only_b", comparison.only_b}};
}

}  // namespace selvedge::station
