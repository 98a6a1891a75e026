#include "cli/figures.h"

namespace selvedge::cli {

std::vector<Figure> bench_format(const FigureOptions& options);

const std::vector<FigureSet>& benches() {
  static const std::vector<FigureSet> list = {
      {"format", "reading and writing trials: CSV, PNG", bench_format},
  };
  return list;
}

}  // namespace selvedge::cli
