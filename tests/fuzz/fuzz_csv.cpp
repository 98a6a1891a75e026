// Tables: CSV, and lines that carry their own checksum. Bit 0 of the first byte says which.
#include "files/checked_lines.h"
#include "files/csv_table.h"
#include "fuzz.h"

using namespace selvedge;

namespace {

constexpr std::string_view kHeader = "t_s,frame,x,crc32\n";

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size < 1) return 0;
  const std::string_view text = fuzz::text_of(data + 1, size - 1);
  fuzz::or_refused([&] {
    const std::vector<files::CsvColumn> wanted = {{"t_s"}, {"frame"}, {"x", true}};
    std::string kept(text);
    if ((data[0] & 1) != 0) {
      const files::CheckedLines lines = files::parse_checked_lines(text, kHeader);
      // Every line that is kept is one that with_checksum writes.
      for (size_t at = kHeader.size(), end = 0; (end = lines.text.find('\n', at)) != std::string::npos; at = end + 1) {
        const std::string line = lines.text.substr(at, end - at);
        if (files::with_checksum(line.substr(0, line.rfind(','))) != line + '\n') std::abort();
      }
      kept = lines.text;
    }
    const files::CsvTable table = files::parse_csv("fuzz.csv", kept, wanted);
    for (size_t row = 0; row < table.rows(); ++row) files::whole_number(table, row, 1, "frame");
    files::require_times_ascend(table, 0);
  });
  return 0;
}
