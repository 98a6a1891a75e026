// `./selvedge prove cloth`: the fabric model against closed forms, against itself on finer meshes and grids, and
// against the laws that it must keep.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "cli/verify/figures.h"
#include "cli/verify/proofs/cloth_cases.h"
#include "cli/verify/proofs/force_laws.h"

namespace selvedge::cli {

namespace {

geometry::TriangleMesh swatch_mesh(int n) { return geometry::make_grid_mesh(kSwatch_m, kSwatch_m, n, n); }

double percent(const Compared& c) { return 100 * c.relative_error(); }

void add_closed_forms(const FigureOptions& options, std::vector<Figure>& out) {
  const int n = options.quick ? 17 : 33;
  const auto add = [&](const std::string& what, double error, const std::string& source) {
    out.push_back({what, error, 1, "%", Relation::at_most, source});
  };
  const int rows = options.quick ? 25 : 33;
  const Compared cantilever = cantilever_sag(rows);
  add(fmt::format("cantilever's sag, {} rows: error", rows), percent(cantilever), "elastica, solved by shooting");
  out.push_back({"cantilever: order of convergence",
                 order_of(percent(cantilever_sag((rows + 1) / 2)), percent(cantilever)), 1.5, "", Relation::at_least,
                 "second order expected"});
  options.progress(0.1, "catenary");
  add(fmt::format("catenary's sag, {} columns: error", n), percent(catenary_sag(n)), "catenary of equal length");
  options.progress(0.2, "pendulum");
  add(fmt::format("pendulum's period, {} rows: error", n), percent(pendulum_period(n)), "hanging chain, Bessel's J0");
  const int cells = options.quick ? 10 : 14;
  add(fmt::format("cantilever's sag, splines of {} cells: error", cells), percent(spline_cantilever_sag(cells)),
      "elastica, solved by shooting");
  add(fmt::format("catenary's sag, splines of {} cells: error", cells), percent(spline_catenary_sag(cells)),
      "catenary of equal length");
  add(fmt::format("pendulum's period, splines of {} cells: error", cells), percent(spline_pendulum_period(cells)),
      "hanging chain, Bessel's J0");
  options.progress(0.25, "free fall");
  add(fmt::format("free fall's terminal speed, {0}x{0}: error", n), percent(terminal_speed(n)),
      "drag law of Bhat et al. 2003");
  double grid_error = 0, irregular_error = 0;
  for (const double angle : {0.0, 0.3, M_PI / 4, M_PI / 2}) {
    grid_error = std::max(grid_error, percent(cylinder_energy(swatch_mesh(n), angle)));
    irregular_error = std::max(
        irregular_error,
        percent(cylinder_energy(geometry::make_irregular_mesh(kSwatch_m, kSwatch_m, n, n, 0.4, options.seed), angle)));
  }
  add(fmt::format("bending energy of a cylinder, {0}x{0}, worst of four directions: error", n), grid_error,
      "1/2 B k^2 per area");
  add(fmt::format("the same on an irregular, rotated mesh of {0}x{0} density: error", n), irregular_error,
      "1/2 B k^2 per area");
  options.progress(0.3, "energy");
  const double duration_s = options.quick ? 1 : 10;
  out.push_back({fmt::format("energy drift of an undamped {0}x{0} sheet in {1} s", n, duration_s),
                 100 * energy_drift(n, duration_s), 0.1, "% of its energy of motion", Relation::at_most, "none"});
  using Integrator = cloth::Options::Integrator;
  const int swinging = options.quick ? 9 : 17;
  const double swing_s = options.quick ? 1 : 3;
  const std::string kept = fmt::format("energy that an undamped {0}x{0} sheet keeps for {1} s, ", swinging, swing_s);
  out.push_back({kept + "leapfrog", 100 * energy_kept(swinging, swing_s, Integrator::leapfrog), 99.9, "%",
                 Relation::at_least, "peers: 10 to 56 %"});
  out.push_back({fmt::format("energy that an undamped sheet of splines, {0}x{0} cells, keeps for {1} s", 10, swing_s),
                 100 * spline_energy_kept(10, swing_s), 99.9, "%", Relation::at_least, "peers: 10 to 56 %"});
  for (const int rate_hz : {120, 1200})
    out.push_back({kept + fmt::format("implicit Euler of 1/{} s", rate_hz),
                   100 * energy_kept(swinging, swing_s, Integrator::implicit_euler, 1.0 / rate_hz), 100, "%",
                   Relation::shown, "what Bhat et al. 2003 rejected"});
}

// Stretch and shear, bending, and everything that adds to them, one material each.
void add_force_laws(std::vector<Figure>& out) {
  struct Law {
    std::string name;
    cloth::Material material;
    bool stretched = false;
  };
  std::vector<Law> laws = {{"stretch", lossless()},
                           {"shear", lossless()},
                           {"bending", lossless()},
                           {"anisotropy and coupling", lossless()},
                           {"bending's anisotropy", lossless()},
                           {"hem", lossless()},
                           {"bending's stiffening", lossless()},
                           {"stretch's stiffening", lossless(), true}};
  laws[0].material.shear = laws[0].material.bend = 0;
  laws[1].material.stretch = laws[1].material.bend = 0;
  laws[2].material.stretch = laws[2].material.shear = 0;
  laws[2].material.bend = 1e-3;
  laws[3].material.stretch_anisotropy = 0.4;
  laws[3].material.coupling = 0.3;
  laws[4].material.bend_anisotropy = 0.5;
  laws[5].material.hem_stiffness = 3;
  laws[6].material.bend_stiffening = 1e-3;
  laws[7].material.stretch_stiffening = 5;
  const std::string unit = "of the largest force";
  for (const Law& law : laws) {
    out.push_back({law.name + ": force against the energy's differences",
                   energy_gradient_error(law.material, law.stretched), 1e-6, unit, Relation::at_most,
                   "finite differences"});
    out.push_back({law.name + ": the same on splines", spline_gradient_error(law.material, law.stretched), 1e-6, unit,
                   Relation::at_most, "finite differences"});
  }
  cloth::Material damped = lossless();
  damped.stretch_damping = 0.04;
  damped.shear_damping = 0.02;
  damped.bend_damping = 1e-5;
  out.push_back({"damping: force against the power's differences", damping_gradient_error(damped), 1e-6, unit,
                 Relation::at_most, "finite differences"});
  const double bend_damping = damped.bend_damping;
  damped.bend_damping = 0;
  damped.coupling = 0.2;
  const Unbalanced sum = unbalanced(damped);
  out.push_back({"sum of all inner forces (momentum)", sum.force, 1e-12, "of their sizes' sum", Relation::at_most,
                 "Newton's third law"});
  out.push_back({"sum of their torques (angular momentum)", sum.torque_m, 1e-12, "m, of their sizes' sum",
                 Relation::at_most, "the same"});
  damped.bend_damping = bend_damping;
  out.push_back({"the same with 20 times the usual bending damping", unbalanced(damped).torque_m, 0,
                 "m, of their sizes' sum", Relation::shown, "brakes the turning of a curved sheet: docs/cloth.md"});
}

void add_meshes(const FigureOptions& options, std::vector<Figure>& out) {
  const int frames = options.quick ? 10 : 50, n = options.quick ? 9 : 17;
  const Waving coarse = wave(swatch_mesh(n), frames);
  options.progress(0.5, "meshes");
  const Waving middle = wave(swatch_mesh(2 * n - 1), frames, &coarse);
  options.progress(0.6, "meshes");
  const Waving irregular = wave(
      geometry::make_irregular_mesh(kSwatch_m, kSwatch_m, 2 * n - 1, 2 * n - 1, 0.4, options.seed), frames, &middle);
  options.progress(0.7, "finest mesh");
  const Waving fine = wave(swatch_mesh(4 * n - 3), frames, &middle);
  const double d_coarse = 1e3 * distance_m(coarse, middle), d_fine = 1e3 * distance_m(middle, fine);
  const auto name = [](int m) { return fmt::format("{0}x{0}", m); };
  const Relation judged = options.quick ? Relation::shown : Relation::at_most;
  out.push_back(
      {fmt::format("waving, sides as arcs, {} frames, {} against {}", frames, name(2 * n - 1), name(4 * n - 3)), d_fine,
       1, "mm rms", judged, "branch matched"});
  out.push_back({fmt::format("waving, sides as arcs, {} against {}", name(n), name(2 * n - 1)), d_coarse, 3, "mm rms",
                 judged, "branch matched"});
  out.push_back({fmt::format("waving, sides as arcs, irregular mesh of {0} density against {0}", name(2 * n - 1)),
                 1e3 * distance_m(irregular, middle), 3, "mm rms", judged, "branch matched"});
  out.push_back({"waving, sides as arcs: order of convergence", order_of(d_coarse, d_fine), 1, "", Relation::shown,
                 "three meshes"});
}

void add_spline_grids(const FigureOptions& options, std::vector<Figure>& out) {
  const int frames = options.quick ? 10 : 50, n = options.quick ? 6 : 10;
  const SplineWaving coarse = spline_wave(n, frames), middle = spline_wave(2 * n, frames, &coarse);
  options.progress(0.9, "finest grid of splines");
  const SplineWaving fine = spline_wave(4 * n, frames, &middle);
  const double d_coarse = 1e3 * distance_m(coarse, middle), d_fine = 1e3 * distance_m(middle, fine);
  out.push_back({fmt::format("waving, splines, {} frames, {} cells against {}", frames, 2 * n, 4 * n), d_fine, 1,
                 "mm rms", options.quick ? Relation::shown : Relation::at_most, "branch matched"});
  out.push_back({fmt::format("waving, splines, {} cells against {}", n, 2 * n), d_coarse, 3, "mm rms",
                 options.quick ? Relation::shown : Relation::at_most, "branch matched"});
  out.push_back(
      {"waving, splines: order of convergence", order_of(d_coarse, d_fine), 1, "", Relation::shown, "three grids"});
  const int cells = options.quick ? 8 : 14;
  out.push_back({fmt::format("nine derivatives on splines of {} cells", cells), cost_of_nine_derivatives(cells), 4,
                 "simulations", options.quick ? Relation::shown : Relation::at_most, "asked"});
}

}  // namespace

std::vector<Figure> prove_cloth(const FigureOptions& options) {
  std::vector<Figure> out;
  add_force_laws(out);
  add_closed_forms(options, out);
  add_meshes(options, out);
  add_spline_grids(options, out);
  options.progress(1, "done");
  return out;
}

}  // namespace selvedge::cli
