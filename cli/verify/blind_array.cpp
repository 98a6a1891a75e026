#include "cli/verify/blind_array.h"

#include <algorithm>

#include "evaluation/blind.h"
#include "files/shared_files.h"
#include "station/programs.h"

namespace selvedge::cli {

namespace fs = std::filesystem;

size_t answer_by_array(const fs::path& folder, const station::SlurmOptions& options,
                       const report::ProgressCallback& progress,
                       const std::function<void(const std::string& id, const std::string& why)>& missing) {
  const fs::path whole = fs::absolute(folder);
  const std::vector<std::string> ids = evaluation::open_record(whole, evaluation::usual_seal()).ids;
  const auto is_answered = [&](const std::string& id) { return fs::exists(whole / "answers" / id / "diagnosis.json"); };
  const auto answered = [&] { return static_cast<size_t>(std::count_if(ids.begin(), ids.end(), is_answered)); };
  std::vector<station::ArrayTask> tasks;
  for (size_t i = 0; i < ids.size(); ++i)
    if (!is_answered(ids[i]))
      tasks.push_back(
          {i, {files::own_program().string(), "blind", "answer", whole.string(), "--campaign", ids[i]}, ""});
  if (!tasks.empty()) {
    const station::JobArray array(whole / "slurm", "blind", tasks, options);
    std::vector<size_t> indices;
    for (const station::ArrayTask& task : tasks) indices.push_back(task.index);
    array.wait(indices, ids.size(), answered, progress);
    for (const station::ArrayTask& task : tasks)
      if (!is_answered(ids[task.index])) missing(ids[task.index], array.last_words(task.index));
  }
  progress(1, "done");
  return evaluation::answer_all(whole, evaluation::usual_seal(), {}, [] { return true; });
}

}  // namespace selvedge::cli
