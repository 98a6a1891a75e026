// One file of a material test's trial replaced by anything: the first byte says of which test, and whether it is
// trial.json (bit 0) or the table.
#include <iterator>

#include "capture/trial/trial.h"
#include "example_trial.h"
#include "files/whole_file.h"
#include "fuzz.h"

using namespace selvedge;
namespace fs = std::filesystem;

namespace {

struct Example {
  fs::path folder;
  std::string header, table;
};

Example example(size_t which) {
  Example out{fuzz::memory_folder() / fuzz::kMaterialTables[which], {}, {}};
  fuzz::write_material_test(out.folder, which);
  out.header = files::read_whole(out.folder / "trial.json");
  out.table = files::read_whole(out.folder / fuzz::kMaterialTables[which]);
  return out;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size < 1) return 0;
  static const Example examples[] = {example(0), example(1), example(2)};
  const bool header = data[0] & 1;
  const size_t which = (data[0] >> 1) % std::size(examples);
  const Example& one = examples[which];
  const fs::path file = one.folder / (header ? "trial.json" : fuzz::kMaterialTables[which]);
  fuzz::put(file, fuzz::text_of(data + 1, size - 1));
  fuzz::or_refused([&] { trial::read_trial(one.folder); });
  fuzz::put(file, header ? one.header : one.table);
  return 0;
}
