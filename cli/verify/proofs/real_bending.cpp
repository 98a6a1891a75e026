#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "cli/verify/proofs/real.h"
#include "cli/verify/proofs/real_fabrics.h"
#include "cli/verify/proofs/strip_of_nodes.h"
#include "material_tests/cantilever.h"

namespace selvedge::cli {

namespace {

// Errors of ln B and of ln B₂ of one direction of one fabric, absolute.
struct Errors {
  double linear = 0, second_order = 0;
};

// Three overhangs about the bending length; none so long that the strip comes near to folding at the edge, where its
// moment, at most w L²/2, is the largest that the law has, B² / 4|B₂|.
Errors fitted_again(const material_tests::BendingLaw& law, double density) {
  constexpr int kRods = 1600;
  constexpr double kNear = 0.75;
  const double weight = 9.81 * density, c = material_tests::bending_length(law, weight);
  double longest = 1.4 * c;
  if (law.second_order < 0) longest = std::min(longest, law.bend * std::sqrt(kNear / (-2 * law.second_order * weight)));
  std::vector<trial::Trial> strips(3);
  std::vector<const trial::Trial*> all;
  for (int k = 0; k < 3; ++k) {
    const double overhang = longest * (0.6 + 0.2 * k);
    trial::Trial& t = strips[static_cast<size_t>(k)];
    t.experiment = trial::Experiment::cantilever;
    t.fabric = {"", 0.025, 0.2, density * 0.025 * 0.2, true};
    t.cantilever =
        trial::Cantilever{0, overhang, std::nullopt, every_nth(strip_of_nodes(law, weight, overhang, kRods), 40)};
    all.push_back(&t);
  }
  const material_tests::DirectionBend found = material_tests::fit_direction(all);
  return {std::abs(std::log(found.law.bend / law.bend)), std::abs(found.law.second_order / law.second_order - 1)};
}

}  // namespace

std::vector<Figure> prove_real_bending(const std::filesystem::path& folder, const FigureOptions& options) {
  constexpr double kWithin = 0.03;
  const std::vector<std::vector<double>> rows = read_fabric_rows(folder / "fabrics.csv");
  const size_t step = options.quick ? 25 : 1;
  std::vector<double> linear, second;
  double fabrics = 0, held = 0;
  for (size_t i = 0; i < rows.size(); i += step) {
    const std::vector<double>& row = rows[i];
    double worst = 0;
    for (const size_t direction : {size_t{1}, size_t{2}}) {
      const Errors e = fitted_again({1e-9 * row[direction], 1e-12 * row[direction + 3]}, row[0]);
      linear.push_back(100 * e.linear);
      second.push_back(100 * e.second_order);
      worst = std::max({worst, e.linear, e.second_order});
    }
    ++fabrics;
    held += worst <= kWithin;
    if (worst > kWithin)
      options.tell(
          fmt::format("row {} of fabrics.csv: linear {:.2f} and {:.2f} %, second order {:.2f} and {:.2f} % off", i + 2,
                      linear.end()[-2], linear.back(), second.end()[-2], second.back()));
    options.progress(static_cast<double>(i) / static_cast<double>(rows.size()), "strips of 618 fabrics");
  }
  const std::string source = "fabrics.csv, the row that made the strips; other equations made them than fit them";
  return {
      {"fabrics whose linear and second-order bending come back within 3 %, both ways", held, fabrics, "fabrics",
       Relation::at_least, source},
      {"linear bending: largest error", *std::max_element(linear.begin(), linear.end()), 3, "%", Relation::at_most,
       source},
      {"second-order bending: median error", median(second), 3, "%", Relation::at_most, source},
      {"second-order bending: largest error", *std::max_element(second.begin(), second.end()), 3, "%",
       Relation::at_most, source},
  };
}

}  // namespace selvedge::cli
