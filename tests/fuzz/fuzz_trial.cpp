// One file of a trial or campaign replaced by anything: the first byte says which file (bits 1 and up), and whether the
// trial carries checksums (bit 0).
#include "capture/trial/checked_trial.h"
#include "capture/trial/trial.h"
#include "example_trial.h"
#include "files/whole_file.h"
#include "fuzz.h"

using namespace selvedge;
namespace fs = std::filesystem;

namespace {

struct Example {
  fs::path folder;
  std::string sound[7];  // what stands in each file
};

const char* const kFiles[] = {"trial.json", "corners.csv",    "frames.csv",      "markers.csv",
                              "robot.csv",  trial::copy_name, "../campaign.json"};

Example example(bool checked) {
  Example out{fuzz::memory_folder() / (checked ? "checked" : "plain") / "waving-1", {}};
  fs::create_directories(out.folder);
  fuzz::write_example_trial(out.folder, checked);
  for (size_t i = 0; i < 5; ++i) out.sound[i] = files::read_whole(out.folder / kFiles[i]);
  if (checked) out.sound[5] = files::read_whole(out.folder / kFiles[5]);
  out.sound[6] = R"({"format": "campaign/1", "fabric": "linen", "trials": ["waving-1"], "replicates": []})";
  fuzz::put(out.folder / kFiles[6], out.sound[6]);
  return out;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size < 1) return 0;
  static const Example examples[] = {example(false), example(true)};
  const Example& one = examples[data[0] & 1];
  const size_t which = (data[0] >> 1) % 7;
  const fs::path file = one.folder / kFiles[which];
  fuzz::put(file, fuzz::text_of(data + 1, size - 1));
  fuzz::or_refused([&] {
    const trial::Campaign campaign = trial::read_campaign(one.folder.parent_path());
    for (const trial::Trial& t : campaign.trials)
      for (size_t i = 0; t.frames && i < t.frames->path.size(); ++i) trial::read_frame(t, i);
  });
  if (one.sound[which].empty()) fs::remove(file);
  else fuzz::put(file, one.sound[which]);
  return 0;
}
