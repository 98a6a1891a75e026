// One fabric, one or two short trials on a coarse mesh: an experiment of a second or two.
#pragma once

#include <filesystem>
#include <string>

#include <unistd.h>

#include "files/whole_file.h"

namespace selvedge::experiments {

inline const std::filesystem::path kExamples = SELVEDGE_SOURCE_DIR "/examples/experiments";

inline std::string small_experiment(const std::string& kind = "static") {
  const bool still = kind == "static";
  return "[experiment]\nkind = \"" + kind +
         "\"\ntitle = \"small\"\nfabrics = [\"felt\"]\n"
         "[fabric.felt]\ndensity = 0.2\nstretch = 200\nshear = 110\nbend = 1.5e-4\n"
         "[trials]\nnames = [\"a\"]\ncells = 5\nframes = 6\nframe_rate_hz = 15\n[trials.a]\n" +
         std::string(still ? "kind = \"static\"\napart_m = 0.29\n"
                           : "kind = \"waving\"\napart_m = 0.29\namplitude_m = 0.05\nfrequency_hz = 1.2\n") +
         "[fit]\nstart = \"usual\"\noptimisers = [\"annealing\"]\nevaluations = 20\niterations = 3\ncells = "
         "5\ncoarse_cells = 5\nframes = 6\nframe_rate_hz = 15\n"
         "[paper]\nsource = \"nobody\"\ncolumns = [\"end\"]\n[paper.felt]\nbend = [\"1e-4\"]\n\"E1\" = [\"12.5\"]\n";
}

// A folder of one test, gone afterwards.
class ScratchFolder {
 public:
  explicit ScratchFolder(const std::string& name)
      : path_(std::filesystem::temp_directory_path() /
              ("selvedge_experiments_" + name + "_" + std::to_string(::getpid()))) {
    std::filesystem::remove_all(path_);
    std::filesystem::create_directories(path_);
  }
  ~ScratchFolder() { std::filesystem::remove_all(path_); }
  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path write(const std::string& name, const std::string& text) const {
    files::write_whole(path_ / name, text);
    return path_ / name;
  }

 private:
  std::filesystem::path path_;
};

}  // namespace selvedge::experiments
