// Journals from which a search, a fit and a session go on. The first byte: modulo 3 which; bit 2 puts the first line
// that it looks for before the rest.
#include "estimate/journal.h"
#include "estimate/optimisers/journal.h"
#include "fuzz.h"
#include "station/journal.h"

using namespace selvedge;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size < 1) return 0;
  const int which = (data[0] & 3) % 3;
  const auto file = fuzz::memory_folder() / (which == 2 ? "journal.jsonl" : "journal.csv");
  std::string text;
  if ((data[0] & 4) != 0 && which < 2) text = "selvedge-journal/1 fuzz\n";
  fuzz::put(file, text.append(fuzz::text_of(data + 1, size - 1)));
  fuzz::or_refused([&] {
    if (which == 0) {
      estimate::Journal journal(file, "fuzz");
      journal.recorded([](const Eigen::MatrixXd& points) {
        return std::vector<double>(static_cast<size_t>(points.cols()), 1);
      })(Eigen::MatrixXd::Constant(2, 1, 0.5));
    } else if (which == 1) {
      estimate::FitJournal journal(file, "fuzz");
      journal.find("grid 1");
      journal.keep("grid 1", {1, 2});
    } else {
      station::read_journal(fuzz::memory_folder());
    }
  });
  return 0;
}
