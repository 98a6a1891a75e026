// `./selvedge bench cloth`: seconds of work per simulated second of a 0.3 m swatch, right corner moved 10 cm peak
// to peak at 1.5 Hz, for a knit and a denim: each integrator at equal error, contact off and on, batches.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>

#include <fmt/format.h>
#include <tbb/info.h>
#include <tbb/task_arena.h>

#include "cli/verify/figures.h"
#include "cli/verify/proofs/cloth_cases.h"
#include "cli/verify/thread_cpu.h"
#include "cloth/contact/solver.h"

namespace selvedge::cli {

namespace {

using cloth::Experiment;

struct BenchFabric {
  const char* name;
  double density, stretch_u, stretch_v, shear, target_s;
};
constexpr BenchFabric kFabrics[] = {{"knit", 0.187, 33, 69, 18, 0.3}, {"denim", 0.324, 411, 2028, 27, 1.5}};

Experiment swatch(const cloth::Sheet& sheet, const BenchFabric& fabric) {
  Experiment e = waving_experiment(0.1, 30);
  e.material.density = fabric.density;
  e.material.stretch = std::sqrt(fabric.stretch_u * fabric.stretch_v);
  e.material.stretch_anisotropy = 0.5 * std::log(fabric.stretch_u / fabric.stretch_v);
  e.material.shear = fabric.shear;
  e.start_shape = cloth::hung_shape(sheet, e, 1);
  e.start_shape = cloth::relax(sheet, {e})[0].position;
  e.starts_at_rest = false;
  return e;
}

struct Timed {
  double seconds = 0;  // median
  std::vector<cloth::Trajectory> motion;
};

double wall_s() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

// clock: thread_cpu_s for one thread, wall_s for all cores.
Timed timed(double (*clock)(), const cloth::Sheet& sheet, const std::vector<Experiment>& lanes,
            const cloth::Options& options, int repeats) {
  Timed out;
  std::vector<double> times;
  for (int i = 0; i < repeats; ++i) {
    const double start = clock();
    out.motion = cloth::simulate(sheet, lanes, options);
    times.push_back(clock() - start);
  }
  out.seconds = median(std::move(times));
  return out;
}

double apart_mm(const cloth::Trajectory& a, const cloth::Trajectory& b) {
  double sum = 0;
  for (size_t k = 0; k < a.samples.size(); ++k) sum += (a.samples[k] - b.samples[k]).colwise().squaredNorm().mean();
  return 1e3 * std::sqrt(sum / static_cast<double>(a.samples.size()));
}

// Straight sides, as the peers' are.
cloth::Sheet bench_sheet(int n, cloth::Sides sides = cloth::Sides::straight) {
  return cloth::make_sheet(geometry::make_grid_mesh(0.3, 0.3, n, n), sides);
}

constexpr double kEqualError_mm = 0.5;

// The cheapest setting of an integrator that comes within kEqualError_mm of the reference, settings from cheap to dear;
// the last one where none does.
struct Cheapest {
  double seconds = 0, error_mm = 0;
  std::string setting;
  cloth::Options options;
};

Cheapest cheapest(const cloth::Sheet& sheet, const Experiment& e, const cloth::Trajectory& reference,
                  const std::vector<std::pair<std::string, cloth::Options>>& settings) {
  Cheapest out;
  for (const auto& [name, options] : settings) {
    const Timed run = timed(thread_cpu_s, sheet, {e}, options, 1);
    out = {run.seconds, run.motion[0].finite ? apart_mm(run.motion[0], reference) : INFINITY, name, options};
    if (out.error_mm <= kEqualError_mm) break;
  }
  return out;
}

std::vector<std::pair<std::string, cloth::Options>> runge_kutta_settings() {
  std::vector<std::pair<std::string, cloth::Options>> out;
  for (const double tolerance_m : {1e-3, 1e-4, 1e-5}) {
    cloth::Options o;
    o.integrator = cloth::Options::Integrator::runge_kutta_45;
    o.tolerance_m = tolerance_m;
    out.emplace_back(fmt::format("{:g} m a step", tolerance_m), o);
  }
  return out;
}

std::vector<std::pair<std::string, cloth::Options>> implicit_settings() {
  std::vector<std::pair<std::string, cloth::Options>> out;
  for (int rate_hz = 120; rate_hz <= 480; rate_hz *= 4) {
    cloth::Options o;
    o.integrator = cloth::Options::Integrator::implicit_euler;
    o.step_s = 1.0 / rate_hz;
    out.emplace_back(fmt::format("1/{} s", rate_hz), o);
  }
  return out;
}

void add_fabric(const cloth::Sheet& sheet, const BenchFabric& fabric, const FigureOptions& options,
                std::vector<Figure>& out) {
  const int repeats = options.quick ? 1 : 3;
  const Experiment e = swatch(sheet, fabric);
  cloth::Options tight;
  tight.integrator = cloth::Options::Integrator::runge_kutta_45;
  tight.tolerance_m = 1e-6;
  const cloth::Trajectory reference = cloth::simulate(sheet, {e}, tight)[0];
  const Timed own = timed(thread_cpu_s, sheet, {e}, {}, repeats);
  Experiment touching = e;
  const cloth::contact::Surface surface = cloth::contact::make_surface(sheet.mesh);
  touching.make_step_filter = [&] {
    return cloth::contact::make_filter(surface, {}, {}, std::make_shared<cloth::contact::Statistics>());
  };
  const Timed with_contact = timed(thread_cpu_s, sheet, {touching}, {}, repeats);
  const std::string label = fmt::format("{}, {} vertices: ", fabric.name, sheet.data.vertex_count),
                    unit = "s per simulated s";
  out.push_back(
      {label + "leapfrog", own.seconds, fabric.target_s, unit, Relation::shown, "target at 33x33; peers 0.7 to 25.6"});
  out.push_back({label + "leapfrog's distance from the tight reference", apart_mm(own.motion[0], reference),
                 kEqualError_mm, "mm rms", Relation::at_most, "equal error asked"});
  out.push_back({label + "leapfrog, contact on", with_contact.seconds, own.seconds, unit, Relation::shown,
                 "contact off, same run"});
  const auto add = [&](const std::string& integrator, const Cheapest& c) {
    const std::string what = label + integrator + ", " + c.setting;
    out.push_back({what, c.seconds, own.seconds, unit, Relation::shown, "leapfrog, same run"});
    out.push_back({what + ": distance from the tight reference", c.error_mm, kEqualError_mm, "mm rms", Relation::shown,
                   "equal error asked"});
    out.push_back({what + ", contact on", timed(thread_cpu_s, sheet, {touching}, c.options, 1).seconds, c.seconds, unit,
                   Relation::shown, "contact off, same run"});
  };
  add("Runge-Kutta 4(5)", cheapest(sheet, e, reference, runge_kutta_settings()));
  add("implicit Euler", cheapest(sheet, e, reference, implicit_settings()));
}

void add_batch(const cloth::Sheet& sheet, const FigureOptions& options, std::vector<Figure>& out) {
  const int repeats = options.quick ? 1 : 3;
  const Experiment knit = swatch(sheet, kFabrics[0]);
  const auto cores = static_cast<size_t>(tbb::info::default_concurrency());
  const auto batch_of = [&](size_t count) {
    std::vector<Experiment> batch(count, knit);
    for (size_t i = 0; i < count; ++i) batch[i].material.shear *= 1 + 0.01 * static_cast<double>(i % 8);
    return batch;
  };
  const std::vector<Experiment> batch = batch_of(8);
  const double one_s = timed(wall_s, sheet, {knit}, {}, repeats).seconds,
               all_s = timed(wall_s, sheet, batch, {}, repeats).seconds;
  const double many_s = timed(wall_s, sheet, batch_of(8 * cores), {}, repeats).seconds;
  double one_thread_s = 0;
  tbb::task_arena(1).execute([&] { one_thread_s = timed(wall_s, sheet, batch, {}, repeats).seconds; });
  out.push_back({"knit: throughput of batches of 8, one for each core, against one at a time on one thread",
                 static_cast<double>(8 * cores) * one_s / many_s, 4, "times", Relation::shown,
                 fmt::format("target; {} cores", cores)});
  out.push_back({"knit: the same of one batch of 8 alone", 8 * one_s / all_s, 4, "times", Relation::shown,
                 "where eight lanes are one group, one core"});
  out.push_back({"knit: the same on one thread", 8 * one_s / one_thread_s, 1, "times", Relation::shown, "lanes alone"});
}

}  // namespace

std::vector<Figure> bench_cloth(const FigureOptions& options) {
  std::vector<Figure> out;
  const cloth::Sheet sheet = bench_sheet(options.quick ? 9 : 33);
  double done = 0;
  for (const BenchFabric& fabric : kFabrics) {
    add_fabric(sheet, fabric, options, out);
    options.progress(done += 0.4, fabric.name);
  }
  add_batch(sheet, options, out);
  options.progress(0.9, "mesh sizes");
  const int small = options.quick ? 5 : 17, large = options.quick ? 17 : 65;
  const cloth::Sheet coarse = bench_sheet(small), fine = bench_sheet(large);
  const double coarse_s = timed(thread_cpu_s, coarse, {swatch(coarse, kFabrics[0])}, {}, options.quick ? 1 : 3).seconds;
  const double fine_s = timed(thread_cpu_s, fine, {swatch(fine, kFabrics[0])}, {}, 1).seconds;
  out.push_back({fmt::format("knit: cost from {0}x{0} to {1}x{1}", small, large), fine_s / coarse_s, 1, "times",
                 Relation::shown, "same run"});
  out.push_back({"knit: exponent of the cost in the number of vertices",
                 std::log(fine_s / coarse_s) / (2 * std::log(static_cast<double>(large) / small)), 1.5, "",
                 Relation::shown, "1 for the vertices, 0.5 for the step"});
  // What arcs cost; docs/decisions/0010 has how near each comes to 65x65.
  for (const int n : {small, 2 * small - 1}) {
    const cloth::Sheet arcs = bench_sheet(n, cloth::Sides::arcs), straight = bench_sheet(n);
    out.push_back({fmt::format("knit, {0}x{0}: leapfrog with arcs", n),
                   timed(thread_cpu_s, arcs, {swatch(arcs, kFabrics[0])}, {}, options.quick ? 1 : 3).seconds,
                   timed(thread_cpu_s, straight, {swatch(straight, kFabrics[0])}, {}, options.quick ? 1 : 3).seconds,
                   "s per simulated s", Relation::shown, "straight sides, same run"});
  }
  options.progress(1, "done");
  return out;
}

}  // namespace selvedge::cli
