// --slurm and what belongs to it, the same of every command that can hand its work to a Slurm cluster.
#pragma once

#include <CLI/CLI.hpp>

#include "station/job_array.h"

namespace selvedge::cli {

inline void add_slurm_options(CLI::App& command, station::SlurmOptions& options) {
  auto* used = command.add_flag("--slurm", options.used, "hand the work to Slurm as a job array, and wait for it");
  command
      .add_option("--at-once", options.at_once,
                  "with --slurm: tasks of an array that run at the same time; all by default")
      ->needs(used)
      ->check(CLI::PositiveNumber);
  command
      .add_option("--sbatch", options.options, "with --slurm: an option for sbatch, as in --sbatch=--partition=long")
      ->needs(used)
      ->type_name("OPTION");
}

}  // namespace selvedge::cli
