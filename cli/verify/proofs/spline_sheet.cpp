// `./selvedge prove spline-sheet`: real fabrics on the grid that is chosen for each, against the same law on four times
// the cells. Fabrics come from ../shared; without it the proof is one figure that says so.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "cli/verify/figures.h"
#include "cli/verify/proofs/spline_cases.h"

namespace selvedge::cli {

namespace {

constexpr double kTolerance_m = 3e-4;

void add_case(const SplineCase& c, std::vector<Figure>& out) {
  const std::string what = fmt::format("{}, bending length {:.1f} mm, {}x{}", c.fabric.name,
                                       1e3 * c.grid.bending_length_m, c.columns, c.rows);
  const char* names[] = {"one corner", "both corners", "edge held"};
  for (size_t k = 0; k < c.pulled_mm.size(); ++k) {
    out.push_back({fmt::format("{}, {}: pulled at 5/s", what, names[k]), c.pulled_mm[k], c.triangles_mm[k], "mm rms",
                   Relation::shown, fmt::format("triangles of {} columns, pulled alike", c.triangle_columns)});
    out.push_back({fmt::format("{}, {}: free", what, names[k]), c.free_mm[k], 0, "mm rms", Relation::shown, ""});
  }
  out.push_back({what + ": what the grid leaves open at rest", 1e3 * c.grid.left_open_m, 1e3 * kTolerance_m, "mm rms",
                 Relation::shown, "tolerance of the choice"});
  out.push_back({what + ": cost, each of a full batch", c.cost, c.triangle_cost, "CPU s per simulated s",
                 Relation::shown, "triangles alone"});
}

}  // namespace

std::vector<Figure> prove_spline_sheet(const FigureOptions& options) {
  const int count = options.quick ? 1 : 20;
  const auto fabrics = draw_real_fabrics(count, options.seed);
  if (!fabrics)
    return {{"SKIPPED: ../shared/real/bending/fabrics.csv is not there, no fabric was simulated", 0, 0, "",
             Relation::shown, "real fabrics"}};
  std::vector<Figure> out;
  std::vector<double> pulled, free, cost;
  for (size_t k = 0; k < fabrics->size(); ++k) {
    options.progress(static_cast<double>(k) / count, (*fabrics)[k].name);
    const SplineCase c = run_spline_case((*fabrics)[k], options.quick ? 1 : 3, options.quick ? 0.2 : 1, kTolerance_m);
    add_case(c, out);
    pulled.push_back(*std::max_element(c.pulled_mm.begin(), c.pulled_mm.end()));
    free.push_back(*std::max_element(c.free_mm.begin(), c.free_mm.end()));
    cost.push_back(c.cost);
  }
  const Relation judged = options.quick ? Relation::shown : Relation::at_most;
  const auto worst = [](const std::vector<double>& of) { return *std::max_element(of.begin(), of.end()); };
  const std::string over = fmt::format("{} fabrics, the worst of their motions, ", count);
  out.push_back({over + "pulled at 5/s: median", median(pulled), 0.3, "mm rms", judged, "target"});
  out.push_back({over + "pulled at 5/s: worst", worst(pulled), 0.6, "mm rms", judged, "target"});
  out.push_back({over + "free for a second: median", median(free), 0.6, "mm rms", judged, "target"});
  out.push_back({over + "free for a second: worst", worst(free), 1.5, "mm rms", judged, "target"});
  out.push_back(
      {over + "cost, each of a full batch: median", median(cost), 0.3, "CPU s per simulated s", judged, "target"});
  out.push_back(
      {over + "cost, each of a full batch: worst", worst(cost), 1, "CPU s per simulated s", judged, "target"});
  options.progress(1, "done");
  return out;
}

}  // namespace selvedge::cli
