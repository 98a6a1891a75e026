#include "cli/figures.h"

namespace selvedge::cli {

std::vector<Figure> prove_format(const FigureOptions& options);
std::vector<Figure> prove_metric(const FigureOptions& options);

const std::vector<FigureSet>& proofs() {
  static const std::vector<FigureSet> list = {
      {"format", "trials come back from disk unchanged, and every damage is refused", prove_format},
      {"metric", "the fold metric recovers stripes of known direction", prove_metric},
  };
  return list;
}

}  // namespace selvedge::cli
