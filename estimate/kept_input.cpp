#include "estimate/kept_input.h"

#include <algorithm>
#include <filesystem>
#include <vector>

#include "files/sha256.h"
#include "files/whole_file.h"

namespace selvedge::estimate {

namespace {

namespace fs = std::filesystem;

// What a trial is read from, in order; results that lie beside it are no part of it.
std::vector<fs::path> files_of(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const char* name : {"trial.json", "corners.csv", "markers.csv", "surface.csv", "frames.csv", "robot.csv",
                           "midline.csv", "outline.csv", "pull.csv"})
    if (fs::exists(folder / name)) files.push_back(folder / name);
  const size_t tables = files.size();
  if (fs::is_directory(folder / "frames"))
    for (const fs::directory_entry& entry : fs::directory_iterator(folder / "frames"))
      if (entry.is_regular_file()) files.push_back(entry.path());
  std::sort(files.begin() + static_cast<std::ptrdiff_t>(tables), files.end());
  return files;
}

}  // namespace

std::string recordings_hash(const trial::Campaign& campaign) {
  std::string all;
  for (const trial::Trial& t : campaign.trials) {
    all += t.name + '\n';
    for (const fs::path& file : files_of(t.folder))
      all += fs::relative(file, t.folder).string() + ' ' + files::sha256_hex(files::read_whole(file)) + '\n';
  }
  for (const std::vector<std::string>& same : campaign.replicates) {
    for (const std::string& name : same) all += name + ' ';
    all += '\n';
  }
  return files::sha256_hex(all);
}

std::string input_hash(const std::string& recordings, const std::string& settings) {
  return files::sha256_hex(std::string(code_version()) + '\n' + settings + '\n' + recordings);
}

}  // namespace selvedge::estimate
