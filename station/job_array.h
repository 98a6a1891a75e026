// Independent tasks as one Slurm job array: handed to sbatch, looked after by squeue, judged by what they leave.
//
// FOLDER/NAME.sh is the script as it was submitted, FOLDER/NAME.job the array's number, FOLDER/NAME-INDEX.log what a
// task said, in all its attempts. Slurm requeues a task whose node dies (--requeue), and the task goes on from what it
// left itself. Tasks that an earlier call submitted and that are still in the queue are not submitted again. A task may
// wait for the one of its index in another array (--dependency=aftercorr); where that fails, Slurm cancels it. All
// folders must be seen on the nodes under the same path, and this program too.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
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
  std::string after;                 // number of an array whose task of this index must have succeeded; empty: none
};

class JobArray {
 public:
  enum class Submit { what_is_not_queued, all };

  // Submits the tasks. name: letters, digits and dashes. Throws BadInput where sbatch is not there or refuses.
  JobArray(const std::filesystem::path& folder, const std::string& name, const std::vector<ArrayTask>& tasks,
           const SlurmOptions& options, Submit which = Submit::what_is_not_queued);

  // Number of the array by index, of its tasks that run or wait, as the queue has it; nothing where it cannot be asked.
  struct Queue {
    std::map<size_t, std::string> running, waiting;
    bool has(size_t index) const { return running.contains(index) || waiting.contains(index); }
  };
  std::optional<Queue> queue() const;

  // Until all of `wanted` results are there, or these tasks have left the queue. there: how many are. Returns how many
  // were at the end.
  size_t wait(const std::vector<size_t>& indices, size_t wanted, const std::function<size_t()>& there,
              const report::ProgressCallback& progress) const;

  // Of the array that a task is in: submitted here, or in the queue then. Throws std::out_of_range.
  const std::string& number_of(size_t index) const { return number_of_.at(index); }

  std::filesystem::path log_of(size_t index) const;
  // "its log PATH ends with: …", for errors.
  std::string last_words(size_t index) const;

 private:
  // Tasks that wait for the same array, or for none.
  void submit(const std::vector<ArrayTask>& tasks, const SlurmOptions& options);

  std::filesystem::path folder_;
  std::string name_;
  std::vector<std::string> numbers_;  // of the arrays, the last submitted one at the end
  std::map<size_t, std::string> number_of_;
};

// "0-2,5" of ascending indices, as sbatch --array takes them.
std::string index_ranges(const std::vector<size_t>& indices);

// Text as one word of a shell.
std::string shell_word(const std::string& text);

// Whether this process is a task of an array, and which: "slurm CLUSTER JOB_INDEX", the same after a requeue.
std::optional<std::string> own_array_task();

}  // namespace selvedge::station
