#include "station/session_file.h"

#include <algorithm>
#include <sstream>

#include <fmt/format.h>

#include "capture/trial/names.h"
#include "files/bad_input.h"
#include "files/toml_file.h"
#include "files/toml_text.h"
#include "files/whole_file.h"

namespace selvedge::station {

namespace {

namespace fs = std::filesystem;

const std::vector<std::string>& sections() {
  static const std::vector<std::string> all = {"session", "fabric",    "calibration", "checks",
                                               "fit",     "diagnosis", "on_failure"};
  return all;
}

std::string text_of(const toml::table& table) {
  std::ostringstream text;
  text << table << '\n';
  return text.str();
}

toml::table& child(toml::table& table, const std::string& name) {
  if (!table.contains(name) || !table[name].is_table()) table.insert_or_assign(name, toml::table{});
  return *table[name].as_table();
}

OnFailure read_on_failure(const std::string& text, const std::string& where) {
  OnFailure policy;
  std::istringstream words(text);
  std::string part;
  bool any = false;
  while (std::getline(words, part, ',')) {
    part.erase(0, part.find_first_not_of(' '));
    part.erase(part.find_last_not_of(' ') + 1);
    int repeats = 0, end = 0;
    if (std::sscanf(part.c_str(), "repeat %d%n", &repeats, &end) == 1 && end == static_cast<int>(part.size()) && !any &&
        repeats >= 1 && repeats <= 20)
      policy.repeats = repeats;
    else if (part == "skip") policy.then = OnFailure::Then::skip;
    else if (part == "ask") policy.then = OnFailure::Then::ask;
    else if (part == "stop") policy.then = OnFailure::Then::stop;
    else
      refuse(where,
             "found {}, expected \"repeat N\" with N from 1 to 20, \"skip\", \"ask\" or \"stop\", or two of them as "
             "\"repeat N, skip\"",
             in_quotes(text));
    any = true;
  }
  if (!any) refuse(where, "found {}, expected what to do", in_quotes(text));
  return policy;
}

void read_policies(files::Section keys, SessionFile& file) {
  file.on_failure = {{"calibrate", {1, OnFailure::Then::stop}},
                     {"record", {2, OnFailure::Then::stop}},
                     {"fit", {0, OnFailure::Then::skip}},
                     {"diagnose", {0, OnFailure::Then::skip}},
                     {"confirm", {0, OnFailure::Then::skip}}};
  for (auto& [step, policy] : file.on_failure)
    if (keys.has(step)) policy = read_on_failure(keys.text(step, std::nullopt), keys.where() + " " + step);
  if (file.on_failure["calibrate"].then == OnFailure::Then::skip)
    refuse(keys.where() + " calibrate", "found \"skip\", but nothing can be recorded without a calibration");
  for (const std::string& key : keys.keys())
    if (!file.on_failure.contains(key))
      refuse(keys.where() + " " + key, "unknown step, expected one of calibrate, record, fit, diagnose, confirm");
}

// Of the grid that is fitted on; 0: as the fabric asks.
int cells_of(files::Section& keys) {
  const auto cells = static_cast<int>(keys.integer("cells", 0, 0, 64));
  if (cells != 0 && cells < 6) refuse(keys.where() + " cells", "found {}, expected 6 to 64, or 0", cells);
  return cells;
}

void read_steps(const files::TomlFile& toml, SessionFile& file) {
  files::Section calibration = toml.section("calibration");
  const std::string when = calibration.choice("when", "once", {"once", "each", "reuse"});
  file.calibration = when == "once"   ? CalibrationPolicy::once
                     : when == "each" ? CalibrationPolicy::each
                                      : CalibrationPolicy::reuse;
  if (file.calibration == CalibrationPolicy::reuse) {
    file.calibration_file = file.path.parent_path() / calibration.text("file", std::nullopt);
    if (!fs::is_regular_file(file.calibration_file))
      refuse(calibration.where() + " file", "{} is no file", file.calibration_file.string());
  }
  calibration.finish();
  files::Section checks = toml.section("checks");
  file.checks.most_frames_lost = checks.number("most_frames_lost", file.checks.most_frames_lost, 0, 1, "(share)");
  file.checks.most_occluded = checks.number("most_occluded", file.checks.most_occluded, 0, 1, "(share)");
  file.checks.at_rest = checks.flag("at_rest", file.checks.at_rest);
  file.checks.drift = checks.flag("drift", file.checks.drift);
  checks.finish();
  files::Section fit = toml.section("fit");
  file.fit = fit.flag("run", true);
  file.fit_cells = cells_of(fit);
  fit.finish();
  files::Section diagnosis = toml.section("diagnosis");
  file.diagnosis = diagnosis.flag("run", true);
  file.effects = diagnosis.texts("effects", std::vector<std::string>{});
  file.diagnosis_cells = cells_of(diagnosis);
  file.follow_up = static_cast<int>(diagnosis.integer("follow_up", 0, 0, 5));
  file.confirm = diagnosis.flag("confirm", false);
  if (file.confirm && !(file.fit && file.diagnosis))
    refuse(diagnosis.where() + " confirm",
           "found true, but a second session is predicted by a fit and a diagnosis, and "
           "[fit] or [diagnosis] has run = false");
  diagnosis.finish();
  read_policies(toml.section("on_failure"), file);
}

// The rig's own file with this session's trials and one fabric in their place. repeats: of each trial, taken out.
toml::table rig_for(const SessionFile& file, const toml::table& session, const std::string& fabric,
                    std::vector<std::vector<std::string>>& replicates) {
  toml::table rig = files::read_toml(file.rig);
  toml::table about = *session["fabric"][fabric].as_table();
  about.erase("world");
  about.insert_or_assign("name", fabric);
  rig.insert_or_assign("fabric", about);
  toml::table& merged = child(rig, "session");
  replicates.clear();
  // Sections of the rig's own trials go; its general keys stay unless the session has them.
  std::vector<std::string> trials;
  for (const auto& [key, value] : merged)
    if (value.is_table()) trials.emplace_back(key.str());
  for (const std::string& name : trials) merged.erase(name);
  toml::array names;
  for (const auto& [key, value] : *session["session"].as_table())
    if (!value.is_table() && key != "rig" && key != "world" && key != "fabrics" && key != "trials")
      merged.insert_or_assign(key, value);
  for (const toml::node& element : *session["session"]["trials"].as_array()) {
    const std::string name = element.value_or(std::string());
    const toml::table* given = session["session"][name].as_table();
    if (given == nullptr) refuse(file.path.string() + " [session] trials", "no section [session.{}]", name);
    toml::table keys = *given;
    const int64_t repeats = keys.contains("repeats") ? keys["repeats"].value<int64_t>().value_or(0) : 1;
    if (repeats < 1 || repeats > 20)
      refuse(fmt::format("{} [session.{}] repeats", file.path.string(), name), "expected a whole number from 1 to 20");
    keys.erase("repeats");
    std::vector<std::string> same;
    for (int64_t i = 1; i <= repeats; ++i) {
      same.push_back(repeats == 1 ? name : fmt::format("{}-{}", name, i));
      if (merged.contains(same.back()))
        refuse(file.path.string() + " [session] trials", "two trials of the name {}", in_quotes(same.back()));
      names.push_back(same.back());
      merged.insert_or_assign(same.back(), keys);
    }
    if (same.size() > 1) replicates.push_back(same);
  }
  merged.insert_or_assign("trials", names);
  return rig;
}

session::SessionPlan plan_of(const toml::table& rig, const std::string& name) {
  return session::read_session_plan(rig::Configuration::parse(text_of(rig), name));
}

std::string world_of(const SessionFile& file, const toml::table& session, const std::vector<std::string>& fabrics) {
  toml::table world = files::read_toml(*file.world);
  toml::table swatches;
  toml::array names;
  for (const std::string& fabric : fabrics) {
    const toml::table& about = *session["fabric"][fabric].as_table();
    toml::table swatch;
    if (const toml::table* given = about["world"].as_table()) swatch = *given;
    for (const char* key : {"width_m", "height_m"})
      if (about.contains(key)) swatch.insert_or_assign(key, about[key].value_or(0.3));
    names.push_back(fabric);
    swatches.insert_or_assign(fabric, swatch);
  }
  swatches.insert_or_assign("names", names);
  world.insert_or_assign("swatches", swatches);
  return text_of(world);
}

}  // namespace

SessionFile read_session_file(const fs::path& path) {
  SessionFile file;
  file.path = path;
  file.text = files::read_whole(path);
  const files::TomlFile toml = files::TomlFile::load(path, sections());
  const toml::table table = files::read_toml(path);
  files::Section session = toml.section("session");
  file.rig = path.parent_path() / session.text("rig", std::nullopt);
  if (session.has("world")) file.world = path.parent_path() / session.text("world", std::nullopt);
  const std::vector<std::string> names = session.texts("fabrics", std::nullopt);
  session.texts("trials", std::nullopt);
  if (names.empty()) refuse(session.where() + " fabrics", "found none, expected at least one");
  files::Section fabrics = toml.section("fabric");
  for (const std::string& name : names) {
    if (!trial::is_plain_name(name))
      refuse(session.where() + " fabrics", "found {}, expected names of small letters, digits, - and _",
             in_quotes(name));
    if (std::count(names.begin(), names.end(), name) > 1)
      refuse(session.where() + " fabrics", "found {} twice", in_quotes(name));
    if (!fabrics.has(name)) refuse(session.where() + " fabrics", "no section [fabric.{}]", name);
    if (fabrics.section(name).has("world") && !file.world)
      refuse(fabrics.where() + " " + name, "world: only a simulated rig has one; [session] names no world");
    SwatchPlan swatch;
    swatch.name = name;
    swatch.plan = plan_of(rig_for(file, table, name, swatch.replicates), path.string());
    file.fabrics.push_back(std::move(swatch));
  }
  for (const std::string& key : fabrics.keys())
    if (std::find(names.begin(), names.end(), key) == names.end())
      refuse(fabrics.where() + " " + key, "not among the fabrics of [session]");
  const toml::array& trials = *table["session"]["trials"].as_array();
  for (const auto& [key, value] : *table["session"].as_table()) {
    if (!value.is_table()) continue;
    const std::string name(key.str());
    if (std::none_of(trials.begin(), trials.end(),
                     [&](const toml::node& t) { return t.value_or(std::string()) == name; }))
      refuse(session.where() + " " + name, "not among the trials of [session]");
  }
  read_steps(toml, file);
  if (file.world) file.simulated_world = world_of(file, table, names);
  return file;
}

SessionFile session_of_rig(const fs::path& rig, const fs::path& world) {
  SessionFile file;
  file.path = file.rig = rig;
  file.text = files::read_whole(rig);
  file.world = world;
  file.simulated_world = files::read_whole(world);
  const session::SessionPlan plan = session::read_session_plan(rig::Configuration::load(rig));
  file.fabrics.push_back({plan.fabric.name, plan, {}});
  file.in_place = true;
  file.checks = {1, 1, false, false};
  file.fit = file.diagnosis = false;
  for (const char* kind : {"calibrate", "record", "fit", "diagnose", "confirm"}) file.on_failure[kind] = {};
  return file;
}

fs::path SessionFile::folder_of(size_t fabric, const fs::path& session) const {
  return in_place ? session : session / fabrics[fabric].name;
}

std::optional<session::SessionPlan> read_follow_up(const SessionFile& file, size_t fabric, const fs::path& proposal) {
  if (!fs::is_regular_file(proposal)) return std::nullopt;
  if (files::read_whole(proposal).find("By hand") != std::string::npos) return std::nullopt;
  std::vector<std::vector<std::string>> replicates;
  toml::table rig = rig_for(file, files::read_toml(file.path), file.fabrics[fabric].name, replicates);
  const toml::table next = files::read_toml(proposal);
  const toml::table* trials = next["session"].as_table();
  if (trials == nullptr || !trials->contains("trials")) return std::nullopt;
  for (const auto& [key, value] : *trials) child(rig, "session").insert_or_assign(key, value);
  return plan_of(rig, proposal.string());
}

}  // namespace selvedge::station
