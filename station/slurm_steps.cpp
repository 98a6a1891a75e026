#include "station/slurm_steps.h"

#include <algorithm>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "files/bad_input.h"
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

// The same number for a step in every array of the session.
size_t SlurmSteps::index_of(const Step& step) const {
  const size_t place = static_cast<size_t>(step.round) * file_.fabrics.size() + step.fabric;
  return 2 * place + (step.kind == "diagnose" ? 1 : 0);
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

void SlurmSteps::submit(const Step& step) {
  std::vector<Step> due = due_with(step);
  std::vector<ArrayTask> tasks;
  // An answer that is there already came while no session waited for it.
  std::erase_if(due, [&](const Step& s) {
    if (!fs::exists(answer_of(folder_, s.id(file_)))) return false;
    arrays_[s.id(file_)] = nullptr;
    return true;
  });
  for (const Step& s : due)
    tasks.push_back({index_of(s),
                     {own_program().string(), "session", "run", fs::absolute(file_.path).string(), "--out",
                      folder_.string(), "--step", s.id(file_)}});
  if (!tasks.empty()) {
    // Another attempt is one, though the task that failed may not have left the queue yet.
    const auto which = failed_.contains(step.id(file_)) ? JobArray::Submit::all : JobArray::Submit::what_is_not_queued;
    const auto array = std::make_shared<const JobArray>(folder_ / "slurm", "session", tasks, options_, which);
    for (const Step& s : due) arrays_[s.id(file_)] = array;
  }
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

// A failure is taken once, so that another attempt is one; a result stays until the journal has it.
json SlurmSteps::taken(const Step& step, const std::shared_ptr<const JobArray>& array) {
  const std::string id = step.id(file_);
  const fs::path path = answer_of(folder_, id);
  failed_.insert(id);
  if (!fs::exists(path))
    throw std::runtime_error(
        fmt::format("{}: its task left Slurm's queue without an answer; {}", id, array->last_words(index_of(step))));
  const json answer = files::read_json(path);
  if (answer.contains("result")) {
    failed_.erase(id);
    return answer.at("result");
  }
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
