#include "station/slurm_steps.h"

#include <algorithm>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "files/bad_input.h"
#include "files/shared_files.h"
#include "files/whole_file.h"
#include "station/file_steps.h"
#include "station/programs.h"

namespace selvedge::station {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

fs::path answer_of(const fs::path& folder, std::string step) {
  std::replace(step.begin(), step.end(), '/', '-');
  return folder / "slurm" / (step + ".json");
}

bool is_on_files(const Step& step) { return step.kind == "fit" || step.kind == "diagnose"; }

Step fit_before(Step diagnosis) {
  diagnosis.kind = "fit";
  return diagnosis;
}

// A fit or diagnosis by its name, of whatever round.
Step step_named(const SessionFile& file, const std::string& id) {
  std::string known;
  for (int round = 0; round <= file.follow_up; ++round)
    for (Step step : planned_steps(file)) {
      if (!is_on_files(step)) continue;
      step.round = round;
      if (step.id(file) == id) return step;
      known += (known.empty() ? "" : ", ") + step.id(file);
    }
  refuse("--step", "found {}, expected one of {}", in_quotes(id), known);
}

}  // namespace

SlurmSteps::SlurmSteps(StationSteps& station, const SessionFile& file, const Journal& journal, const fs::path& folder,
                       const SlurmOptions& options)
    : station_(station), file_(file), journal_(journal), folder_(fs::absolute(folder)), options_(options) {}

// The same number in every array of the session, and for a diagnosis as for the fit that it waits for.
size_t SlurmSteps::index_of(const Step& step) const {
  return static_cast<size_t>(step.round) * file_.fabrics.size() + step.fabric;
}

// The array with the fit that a diagnosis waits for; empty where there is none, or it was done before.
std::string SlurmSteps::array_before(const Step& step) const {
  const auto fit = arrays_.find(fit_before(step).id(file_));
  const bool waits = step.kind == "diagnose" && fit != arrays_.end() && fit->second;
  return waits ? fit->second->number_of(index_of(step)) : "";
}

// By an answer that the session did not take yet.
bool SlurmSteps::fit_has_failed(const Step& diagnosis) const {
  const fs::path answer = answer_of(folder_, fit_before(diagnosis).id(file_));
  return fs::exists(answer) && !files::read_json(answer).contains("result");
}

// That step, and the first time all that are planned and open. Where a campaign cannot be written, its own turn says
// so.
std::vector<Step> SlurmSteps::due_with(const Step& step) const {
  std::vector<Step> due;
  if (!planned_are_submitted_ && step.round == 0)
    for (const Step& other : planned_steps(file_)) {
      const std::string id = other.id(file_);
      const StepRecord::State state = journal_.record(id).state;
      if (!is_on_files(other) || id == step.id(file_) || state == StepRecord::State::done ||
          state == StepRecord::State::skipped)
        continue;
      try {
        station_.prepare(other);
        due.push_back(other);
      } catch (const std::runtime_error& error) { spdlog::warn("{}: {}", id, error.what()); }
    }
  station_.prepare(step);
  due.push_back(step);
  std::sort(due.begin(), due.end(), [&](const Step& a, const Step& b) { return index_of(a) < index_of(b); });
  return due;
}

void SlurmSteps::submit_alike(const std::vector<Step>& steps, JobArray::Submit which) {
  std::vector<ArrayTask> tasks;
  for (const Step& s : steps)
    tasks.push_back({index_of(s),
                     {files::own_program().string(), "session", "run", fs::absolute(file_.path).string(), "--out",
                      folder_.string(), "--step", s.id(file_)},
                     array_before(s)});
  if (tasks.empty()) return;
  const auto array =
      std::make_shared<const JobArray>(folder_ / "slurm", "session-" + steps.front().kind, tasks, options_, which);
  for (const Step& s : steps) arrays_[s.id(file_)] = array;
}

void SlurmSteps::submit(const Step& step) {
  std::vector<Step> fits, diagnoses;
  for (const Step& s : due_with(step)) {
    const std::string id = s.id(file_);
    // An answer that is there already came while no session waited for it.
    if (fs::exists(answer_of(folder_, id))) arrays_[id] = nullptr;
    else if (s.kind == "fit") fits.push_back(s);
    else if (id == step.id(file_) || !fit_has_failed(s)) diagnoses.push_back(s);
  }
  // Another attempt is one, though the task that failed may not have left the queue yet.
  const auto which = failed_.contains(step.id(file_)) ? JobArray::Submit::all : JobArray::Submit::what_is_not_queued;
  submit_alike(fits, which);
  submit_alike(diagnoses, which);
  if (step.round == 0) planned_are_submitted_ = true;
}

json SlurmSteps::run(const Step& step, const report::ProgressCallback& progress) {
  if (!is_on_files(step)) return station_.run(step, progress);
  const std::string id = step.id(file_);
  if (!arrays_.contains(id)) submit(step);
  const std::shared_ptr<const JobArray> array = arrays_.at(id);
  const fs::path answer = answer_of(folder_, id);
  const auto there = [&] { return fs::exists(answer) ? size_t{1} : size_t{0}; };
  if (array)
    array->wait({index_of(step)}, 1, there, [&](double done, const std::string& what) {
      station_.tell(step, done, what);
      progress(done, what);
    });
  arrays_.erase(id);
  return taken(step, array);
}

void SlurmSteps::forget_diagnosis_of(const Step& fit) {
  Step diagnosis = fit;
  diagnosis.kind = "diagnose";
  const auto at = arrays_.find(diagnosis.id(file_));
  if (at == arrays_.end() || !at->second) return;
  arrays_.erase(at);
  failed_.insert(diagnosis.id(file_));
}

// A failure is taken once, so that another attempt is one; a result stays until the journal has it.
json SlurmSteps::taken(const Step& step, const std::shared_ptr<const JobArray>& array) {
  const std::string id = step.id(file_);
  const fs::path path = answer_of(folder_, id);
  const json answer = fs::exists(path) ? files::read_json(path) : json::object();
  if (answer.contains("result")) {
    failed_.erase(id);
    return answer.at("result");
  }
  failed_.insert(id);
  if (step.kind == "fit") forget_diagnosis_of(step);
  if (answer.empty())
    throw std::runtime_error(
        fmt::format("{}: its task left Slurm's queue without an answer; {}", id, array->last_words(index_of(step))));
  fs::remove(path);
  const auto why = answer.at("failed").get<std::string>();
  if (answer.at("bad_input").get<bool>()) throw BadInput(why);
  throw std::runtime_error(why);
}

int run_array_task(const SessionFile& file, const fs::path& folder, const std::string& id) {
  const Step step = step_named(file, id);
  const fs::path answer = answer_of(folder, id);
  fs::create_directories(answer.parent_path());
  if (fs::exists(answer) && files::read_json(answer).contains("result")) return 0;
  try {
    files::write_json(answer, {{"result", run_on_files(file, step, folder, report::terminal_progress(id))}});
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "selvedge: {}\n", error.what());
    files::write_json(answer,
                      {{"failed", error.what()}, {"bad_input", dynamic_cast<const BadInput*>(&error) != nullptr}});
    return 1;
  }
}

}  // namespace selvedge::station
