// `./selvedge prove real`: what Selvedge says of measurements of real fabric that others made, beside what they or the
// replicates say. Of `../shared/real`; a row whose folder is not there is skipped, and a line says so.
#include "cli/verify/proofs/real.h"

#include <fmt/format.h>

namespace selvedge::cli {

namespace {

const std::filesystem::path kReal = SELVEDGE_SOURCE_DIR "/../shared/real";

struct Row {
  const char* folder;
  std::vector<Figure> (*prove)(const std::filesystem::path&, const FigureOptions&);
};

const Row rows[] = {
    {"arm-cloth", prove_real_arm_cloth}, {"arm-cloth-raw", prove_real_arm_cloth_raw},
    {"bending", prove_real_bending},     {"cusick", prove_real_cusick},
    {"tensile", prove_real_tensile},
};

}  // namespace

std::vector<Figure> prove_real(const FigureOptions& options) {
  std::vector<Figure> figures;
  for (const Row& row : rows) {
    const std::filesystem::path folder = (kReal / row.folder).lexically_normal();
    if (!std::filesystem::exists(folder)) {
      fmt::print("SKIPPED: {} is not there; nothing of it was proven\n", folder.string());
      continue;
    }
    for (Figure& figure : row.prove(folder, options)) figures.push_back(std::move(figure));
  }
  return figures;
}

}  // namespace selvedge::cli
