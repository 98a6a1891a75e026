// Independent tasks as one Slurm job array: handed to sbatch, looked after by squeue, judged by what they leave.
//
// FOLDER/NAME.sh is the script as it was submitted, FOLDER/NAME.job the array's number, FOLDER/NAME-INDEX.log what a
// task said, in all its attempts. Slurm requeues a task whose node dies (--requeue), and the task goes on from what it
// left itself. Where the array of an earlier call is still in the queue, that one is gone on with. All folders must be
// seen on the nodes under the same path, and this program too.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "report/progress.h"

namespace selvedge::station {

struct SlurmOptions {
  bool used = false;
  int at_once = 0;                   // tasks that run at the same time; 0: as many as there is room for
  std::vector<std::string> options;  // for sbatch, as they are: "--partition=long"
};

struct ArrayTask {
  size_t index = 0;                  // in the array
  std::vector<std::string> command;  // words; the first is the program's path
};

class JobArray {
 public:
  // Submits the tasks. name: letters, digits and dashes. Throws BadInput where sbatch is not there or refuses.
  JobArray(const std::filesystem::path& folder, const std::string& name, const std::vector<ArrayTask>& tasks,
           const SlurmOptions& options);

  // As the queue has it; nothing where it cannot be asked.
  struct Queue {
    size_t running = 0, waiting = 0;
    bool empty() const { return running + waiting == 0; }
  };
  std::optional<Queue> queue() const;

  // Until all of `wanted` results are there, or the array has left the queue. there: how many are. Returns how many
  // were at the end.
  size_t wait(size_t wanted, const std::function<size_t()>& there, const report::ProgressCallback& progress) const;

  const std::string& number() const { return number_; }
  bool goes_on() const { return goes_on_; }  // it was in the queue already
  std::filesystem::path log_of(size_t index) const;
  // "its log PATH ends with: …", for errors.
  std::string last_words(size_t index) const;

 private:
  void submit(const std::vector<ArrayTask>& tasks, const SlurmOptions& options);

  std::filesystem::path folder_;
  std::string name_, number_;
  bool goes_on_ = false;
};

// "0-2,5" of ascending indices, as sbatch --array takes them.
std::string index_ranges(const std::vector<size_t>& indices);

// Text as one word of a shell.
std::string shell_word(const std::string& text);

// Whether this process is a task of an array, and which: "slurm CLUSTER JOB_INDEX", the same after a requeue.
std::optional<std::string> own_array_task();

}  // namespace selvedge::station
