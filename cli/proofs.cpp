#include "cli/figures.h"

namespace selvedge::cli {

std::vector<Figure> prove_format(const FigureOptions& options);

const std::vector<FigureSet>& proofs() {
  static const std::vector<FigureSet> list = {
      {"format", "trials come back from disk unchanged, and every damage is refused", prove_format},
  };
  return list;
}

}  // namespace selvedge::cli
