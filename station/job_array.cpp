#include "station/job_array.h"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <thread>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "files/bad_input.h"
#include "files/whole_file.h"
#include "station/command_output.h"

namespace selvedge::station {

namespace fs = std::filesystem;

namespace {

constexpr std::chrono::seconds kLook{1};
constexpr int kAfterwards = 10;  // looks for results of tasks that have left the queue: a file server may be late

std::string one_line(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

std::string script_of(const std::string& name, const std::vector<ArrayTask>& tasks, int at_once) {
  std::vector<size_t> indices;
  for (const ArrayTask& task : tasks) indices.push_back(task.index);
  const std::string& after = tasks.front().after;
  std::string text = fmt::format(
      "#!/bin/bash\n"
      "#SBATCH --job-name={}\n"
      "#SBATCH --array={}{}\n"
      "#SBATCH --requeue\n"
      "#SBATCH --open-mode=append\n"
      "{}"
      "case $SLURM_ARRAY_TASK_ID in\n",
      name, index_ranges(indices), at_once > 0 ? fmt::format("%{}", at_once) : "",
      after.empty() ? ""
                    : fmt::format("#SBATCH --dependency=aftercorr:{}\n#SBATCH --kill-on-invalid-dep=yes\n", after));
  for (const ArrayTask& task : tasks) {
    std::vector<std::string> words;
    for (const std::string& word : task.command) words.push_back(shell_word(word));
    text += fmt::format("{}) exec {} ;;\n", task.index, fmt::join(words, " "));
  }
  return text + "esac\n";
}

// Its own signs for numbers begin with one that a folder's name may hold.
std::string as_pattern(const std::string& path) {
  std::string pattern;
  for (const char c : path) pattern += c == '%' ? std::string("%%") : std::string(1, c);
  return pattern;
}

}  // namespace

std::string index_ranges(const std::vector<size_t>& indices) {
  std::string text;
  for (size_t i = 0; i < indices.size();) {
    size_t last = i;
    while (last + 1 < indices.size() && indices[last + 1] == indices[last] + 1) ++last;
    text += fmt::format("{}{}", text.empty() ? "" : ",", indices[i]);
    if (last > i) text += fmt::format("-{}", indices[last]);
    i = last + 1;
  }
  return text;
}

std::string shell_word(const std::string& text) {
  std::string word = "'";
  for (const char c : text) word += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return word + "'";
}

std::optional<std::string> own_array_task() {
  const char* const job = std::getenv("SLURM_ARRAY_JOB_ID");
  const char* const index = std::getenv("SLURM_ARRAY_TASK_ID");
  const char* const cluster = std::getenv("SLURM_CLUSTER_NAME");
  if (!job || !index) return std::nullopt;
  return fmt::format("slurm {} {}_{}", cluster ? cluster : "", job, index);
}

JobArray::JobArray(const fs::path& folder, const std::string& name, const std::vector<ArrayTask>& tasks,
                   const SlurmOptions& options, Submit which)
    : folder_(fs::absolute(folder)), name_(name) {
  fs::create_directories(folder_);
  if (const fs::path before = folder_ / (name_ + ".job"); fs::exists(before)) {
    std::istringstream numbers(files::read_whole(before));
    for (std::string number; numbers >> number;) numbers_.push_back(number);
  }
  const Queue queued = numbers_.empty() ? Queue{} : queue().value_or(Queue{});
  number_of_ = queued.waiting;
  number_of_.insert(queued.running.begin(), queued.running.end());
  std::map<std::string, std::vector<ArrayTask>> open;  // by what they wait for
  for (const ArrayTask& task : tasks)
    if (which == Submit::all || !queued.has(task.index)) open[task.after].push_back(task);
  if (queued.running.empty() && queued.waiting.empty()) numbers_.clear();
  for (const auto& [after, alike] : open) submit(alike, options);
}

void JobArray::submit(const std::vector<ArrayTask>& tasks, const SlurmOptions& options) {
  const fs::path script = folder_ / (name_ + ".sh");
  files::write_whole(script, script_of(name_, tasks, options.at_once));
  std::vector<std::string> command = {"sbatch", "--parsable",
                                      "--output=" + as_pattern((folder_ / name_).string()) + "-%a.log"};
  command.insert(command.end(), options.options.begin(), options.options.end());
  command.push_back(script.string());
  const CommandOutput said = output_of(command);
  if (!said.found) refuse("sbatch", "found no such program, expected Slurm's commands (Debian: slurm-client) in PATH");
  const std::string number = said.out.substr(0, said.out.find_first_of(";\n"));
  if (said.exit_status != 0 || number.empty())
    refuse("sbatch", "found {}, expected the number of a job array of {} tasks ({})", in_quotes(one_line(said.errors)),
           tasks.size(), script.string());
  numbers_.push_back(number);
  for (const ArrayTask& task : tasks) number_of_[task.index] = number;
  files::write_whole(folder_ / (name_ + ".job"), fmt::format("{}\n", fmt::join(numbers_, "\n")));
}

std::optional<JobArray::Queue> JobArray::queue() const {
  const CommandOutput said = output_of({"squeue", "--me", "--noheader", "--array", "--format=%F %K %T %j"});
  if (said.exit_status != 0) return std::nullopt;
  Queue queue;
  std::istringstream lines(said.out);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream in(line);
    std::string number, state, name;
    size_t index = 0;
    if (in >> number >> index >> state >> name && name == name_ &&
        std::find(numbers_.begin(), numbers_.end(), number) != numbers_.end())
      (state == "PENDING" ? queue.waiting : queue.running).emplace(index, number);
  }
  return queue;
}

size_t JobArray::wait(const std::vector<size_t>& indices, size_t wanted, const std::function<size_t()>& there,
                      const report::ProgressCallback& progress) const {
  for (int left = kAfterwards;;) {
    const size_t found = there();
    if (found >= wanted) return found;
    const std::optional<Queue> now = queue();
    const bool has_left =
        now && std::none_of(indices.begin(), indices.end(), [&](size_t index) { return now->has(index); });
    left = has_left ? left - 1 : kAfterwards;
    if (left < 0) return found;
    progress(static_cast<double>(found) / static_cast<double>(wanted),
             fmt::format("{} of {} done, Slurm array {}: {}", found, wanted, numbers_.back(),
                         now ? fmt::format("{} running, {} waiting", now->running.size(), now->waiting.size())
                             : "the queue cannot be asked"));
    std::this_thread::sleep_for(kLook);
  }
}

fs::path JobArray::log_of(size_t index) const { return folder_ / fmt::format("{}-{}.log", name_, index); }

std::string JobArray::last_words(size_t index) const {
  std::ifstream log(log_of(index));
  std::string last;
  for (std::string line; std::getline(log, line);)
    if (!line.empty()) last = line;
  return fmt::format("its log {} ends with: {}", log_of(index).string(), last.empty() ? "nothing" : last);
}

}  // namespace selvedge::station
