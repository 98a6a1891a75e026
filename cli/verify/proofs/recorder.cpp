// `./selvedge prove recorder`: recorders whose power is cut, each at another moment. What they called durable must read
// from whatever a disk may then hold.
#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <memory>
#include <random>
#include <stdexcept>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include "cli/command.h"
#include "cli/verify/figures.h"
#include "cli/verify/proofs/damaged_trials.h"
#include "cli/verify/proofs/disk_model.h"
#include "cli/verify/proofs/recorder_run.h"

namespace selvedge::cli {

namespace fs = std::filesystem;

namespace {

constexpr int kCutExit = 99;     // of the preloaded library
constexpr int kSaidSoExit = 97;  // the recorder could not begin or finish, and said so

fs::path library() {
  const fs::path folder = fs::read_symlink("/proc/self/exe").parent_path();
  fs::path module = folder / "libselvedge_power_cut.so";
  if (!fs::exists(module)) module = folder.parent_path() / "lib" / "selvedge" / "libselvedge_power_cut.so";
  if (!fs::exists(module)) throw std::runtime_error(module.string() + ": no such file; it is built with selvedge");
  return module;
}

struct Cut {
  unsigned seed = 0;
  int rows = 0;
  long after = 0;      // calls
  long fail_sync = 0;  // number; 0: none fails
  bool too_early = false;
};

struct Outcome {
  bool began = false, ended_otherwise = false, failed_sync = false;
  RecorderReport report;  // the newest
  size_t lost = 0;        // changes that the disk lost
  std::string shortfall;
};

// In the child: this binary as a recorder, with the library in front of the system's.
[[noreturn]] void become_recorder(const Cut& cut, const fs::path& root, const fs::path& journal, int output) {
  ::dup2(output, 1);
  ::setenv("LD_PRELOAD", library().c_str(), 1);
  ::setenv("SELVEDGE_CUT_ROOT", root.c_str(), 1);
  ::setenv("SELVEDGE_CUT_JOURNAL", journal.c_str(), 1);
  ::setenv("SELVEDGE_CUT_SEED", std::to_string(cut.seed).c_str(), 1);
  ::setenv("SELVEDGE_CUT_AFTER", std::to_string(cut.after).c_str(), 1);
  ::setenv("SELVEDGE_CUT_FAIL", std::to_string(cut.fail_sync).c_str(), 1);
  const std::string trial = (root / "campaign" / "trial").string(), rows = std::to_string(cut.rows);
  ::execl("/proc/self/exe", "selvedge", "recorder-of-proof", trial.c_str(), rows.c_str(),
          cut.too_early ? "--too-early" : nullptr, nullptr);
  ::_exit(1);
}

// Runs one recorder to its cut, or to its end where it is faster.
Outcome run_to_cut(const Cut& cut, const fs::path& root, const fs::path& journal) {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error("prove recorder: no pipe");
  const pid_t child = ::fork();
  if (child < 0) throw std::runtime_error("prove recorder: no process");
  if (child == 0) become_recorder(cut, root, journal, ends[1]);
  ::close(ends[1]);
  Outcome outcome;
  RecorderReport report;
  while (::read(ends[0], &report, sizeof report) == sizeof report) {
    outcome.report = report;
    outcome.began = true;
  }
  ::close(ends[0]);
  int status = -1;
  ::waitpid(child, &status, 0);
  const int exited = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  outcome.ended_otherwise = exited != 0 && exited != kCutExit && exited != kSaidSoExit;
  return outcome;
}

Outcome try_cut(const Cut& cut) {
  const ScratchFolder scratch;
  // The library knows a file by the path that the kernel has for it.
  const fs::path top = fs::canonical(scratch.path()), root = top / "disk", journal = top / "journal",
                 after = top / "after";
  fs::create_directory(root);
  Outcome outcome = run_to_cut(cut, root, journal);
  const DiskModel disk(root, journal);
  std::mt19937 random(cut.seed);
  outcome.lost = disk.leave(after, random);
  outcome.failed_sync = disk.had_failed_sync();
  outcome.shortfall = shortfall(after / "campaign" / "trial", outcome.report, outcome.began);
  return outcome;
}

// Cuts all through a recording: while it begins, records, syncs, finishes, and after it has.
Cut random_cut(std::mt19937& random) {
  Cut cut;
  cut.seed = static_cast<unsigned>(random());
  cut.rows = 2 + static_cast<int>(random() % 50);
  cut.after = 1 + static_cast<long>(random() % static_cast<unsigned>(40 + 12 * cut.rows));
  cut.fail_sync = random() % 4 == 0 ? 1 + static_cast<long>(random() % 20) : 0;
  return cut;
}

struct Tally {
  double cuts = 0, short_ones = 0, lossy = 0, failed_syncs = 0, complete_all_the_same = 0, ended_otherwise = 0;
  double durable_frames = 0, written_frames = 0, durable_rows = 0, written_rows = 0;
  std::string example;

  void add(const Outcome& o) {
    ++cuts;
    short_ones += !o.shortfall.empty();
    if (example.empty()) example = o.shortfall;
    lossy += o.lost > 0;
    failed_syncs += o.failed_sync;
    complete_all_the_same += o.failed_sync && o.report.state == RecorderReport::complete;
    ended_otherwise += o.ended_otherwise;
    durable_frames += static_cast<double>(o.report.frames);
    written_frames += static_cast<double>(o.report.written_frames);
    durable_rows += static_cast<double>(o.report.corners);
    written_rows += static_cast<double>(o.report.written_corners);
  }
};

}  // namespace

std::vector<Figure> prove_recorder(const FigureOptions& options) {
  const int cuts = options.quick ? 60 : 1000, early_cuts = options.quick ? 20 : 100;
  std::mt19937 random(options.seed);
  Tally tally, early;
  for (int i = 0; i < cuts; ++i) {
    options.progress(0.9 * i / cuts, fmt::format("power cut {} of {}", i + 1, cuts));
    tally.add(try_cut(random_cut(random)));
  }
  for (int i = 0; i < early_cuts; ++i) {
    options.progress(0.9 + 0.1 * i / early_cuts, "a recorder that says durable too early");
    Cut cut = random_cut(random);
    cut.too_early = true;
    early.add(try_cut(cut));
  }
  options.progress(1, "done");
  const std::string of_all = fmt::format(", of {} power cuts", cuts),
                    source = "the model of a disk in cli/verify/proofs/disk_model.h";
  const std::string first = tally.example.empty() ? "" : " (the first: " + tally.example + ")";
  return {
      {"cuts after which something called durable did not read" + of_all + first, tally.short_ones, 0, "cuts",
       Relation::at_most, source},
      {"trials called complete although a sync failed" + of_all, tally.complete_all_the_same, 0, "trials",
       Relation::at_most, source},
      {"recorders that ended otherwise than by the cut, by finishing or by saying why not" + of_all,
       tally.ended_otherwise, 0, "recorders", Relation::at_most, source},
      {"cuts that lost or tore something that was only written", tally.lossy, 0.5 * cuts, "cuts", Relation::at_least,
       "half of them"},
      {"recorders that met a sync that failed", tally.failed_syncs, 1, "recorders", Relation::at_least, "one"},
      {"frames called durable when the power went, beside those written", tally.durable_frames, tally.written_frames,
       "frames", Relation::shown, "written"},
      {"corner samples called durable when the power went, beside those written", tally.durable_rows,
       tally.written_rows, "samples", Relation::shown, "written"},
      {"frames called durable, in all", tally.durable_frames, 1.0 * cuts, "frames", Relation::at_least, "one a cut"},
      {fmt::format("cuts that catch a recorder which says durable too early, of {}", early_cuts), early.short_ones,
       0.25 * early_cuts, "cuts", Relation::at_least, "a quarter of them"},
  };
}

void add_recorder_of_proof(CLI::App& app, int& exit_status) {
  auto* command = app.add_subcommand("recorder-of-proof", "record what prove recorder cuts off")->group("");
  auto job = std::make_shared<RecorderJob>();
  command->add_option("TRIAL", job->trial, "its folder")->required();
  command->add_option("ROWS", job->rows, "of each kind")->required();
  command->add_flag("--too-early", job->too_early, "call durable what is only written");
  command->callback([job, &exit_status] {
    try {
      record_job(*job);
    } catch (const std::runtime_error&) { exit_status = kSaidSoExit; }
  });
}

}  // namespace selvedge::cli
