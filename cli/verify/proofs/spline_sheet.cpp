// `./selvedge prove spline-sheet`: real fabrics on the grid that a fit takes for each, against the same law on four
// times the cells. Fabrics come from ../shared; without it the proof is one figure that says so.
#include <algorithm>
#include <string>

#include <fmt/format.h>

#include "cli/verify/figures.h"
#include "cli/verify/proofs/spline_cases.h"
#include "cloth/spline/chosen_grid.h"

namespace selvedge::cli {

namespace {

void add_case(const SplineCase& c, std::vector<Figure>& out) {
  const std::string fabric = fmt::format("{}, bending length {:.1f} mm", c.fabric.name, 1e3 * c.bending_length_m);
  const auto shown = [&](const std::string& what, double measured, double reference, const std::string& unit,
                         const std::string& source) {
    out.push_back({what, measured, reference, unit, Relation::shown, source});
  };
  for (const MotionErrors& m : c.motions) {
    const std::string what = fmt::format("{}, {}, {} cells: ", fabric, m.motion, m.cells);
    const std::string finer = fmt::format("free, {} cells", cloth::spline::next_finer(m.cells));
    shown(what + "free", m.free_mm, m.finer_free_mm, "mm rms",
          fmt::format("{}, both against {}", finer, m.reference_cells));
    shown(what + "pulled at 5/s", m.pulled_mm, m.rest_mm, "mm rms", "at rest");
    shown(what + "on the reference's grid, from this one's equilibrium", m.other_rest_mm, m.rest_mm, "mm rms",
          "at rest: 0 where the fabric has one equilibrium there");
    shown(what + "moved by the next finer grid", m.finer_moves_mm, 1e3 * cloth::spline::kMayMove_m, "mm rms",
          "what a fit lets it move");
  }
  shown(fabric + ": cost, each of a full batch", c.cost, 0, "CPU s per simulated s", "");
  if (c.triangle_columns > 0) {
    const std::string triangles = fmt::format("triangles of {} columns", c.triangle_columns);
    shown(fabric + ", one corner: pulled at 5/s", c.motions.front().pulled_mm, c.triangles_mm, "mm rms", triangles);
    shown(fabric + ", one corner: cost", c.cost, c.triangle_cost, "CPU s per simulated s", triangles + ", alone");
  }
  shown(fabric + ": all of it took", c.wall_s, 0, "s", "");
}

// One line, as soon as a fabric is done.
std::string told(const SplineCase& c) {
  std::string text =
      fmt::format("{}, {:.1f} mm, cost {:.3f}, {:.0f} s", c.fabric.name, 1e3 * c.bending_length_m, c.cost, c.wall_s);
  for (const MotionErrors& m : c.motions)
    text += fmt::format("; {} on {}/{}: rest {:.2f} (other {:.2f}) free {:.2f} ({:.2f}) pulled {:.2f} finer {:.2f}",
                        m.motion, m.cells, m.reference_cells, m.rest_mm, m.other_rest_mm, m.free_mm, m.finer_free_mm,
                        m.pulled_mm, m.finer_moves_mm);
  return text;
}

double worst_of(const SplineCase& c, double MotionErrors::*member) {
  double most = 0;
  for (const MotionErrors& m : c.motions) most = std::max(most, m.*member);
  return most;
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
  for (const DrawnFabric& fabric : *fabrics) {
    options.progress(static_cast<double>(cost.size()) / count, fabric.name);
    const SplineCase c = run_spline_case(fabric, options.quick, options.quick ? 0.2 : 1, cost.size() % 5 == 0);
    add_case(c, out);
    pulled.push_back(worst_of(c, &MotionErrors::pulled_mm));
    free.push_back(worst_of(c, &MotionErrors::free_mm));
    cost.push_back(c.cost);
    options.tell(told(c));
  }
  const Relation judged = options.quick ? Relation::shown : Relation::at_most;
  const std::string over = fmt::format("{} fabrics, the worst of their motions, ", count);
  const auto judge =
      [&](const std::string& what, const std::vector<double>& of, double middle, double most, const std::string& unit) {
    out.push_back({over + what + ": median", median(of), middle, unit, judged, "target"});
    out.push_back({over + what + ": worst", *std::max_element(of.begin(), of.end()), most, unit, judged, "target"});
  };
  judge("pulled at 5/s", pulled, 0.3, 0.6, "mm rms");
  judge("free for a second", free, 0.6, 1.5, "mm rms");
  judge("cost, each of a full batch", cost, 0.3, 1, "CPU s per simulated s");
  options.progress(1, "done");
  return out;
}

}  // namespace selvedge::cli
