// `./selvedge bench cloth`: seconds of work per simulated second of a 0.3 m swatch, right corner moved 10 cm peak
// to peak at 1.5 Hz, one thread, for a knit and a denim.
#include <algorithm>
#include <cmath>
#include <ctime>

#include <fmt/format.h>

#include "cli/figures.h"
#include "cli/proofs/cloth_cases.h"

namespace selvedge::cli {

namespace {

using cloth::Experiment;

// Time of this thread: other work on the machine does not count.
double cpu_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

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

Timed timed(const cloth::Sheet& sheet, const std::vector<Experiment>& lanes, const cloth::Options& options, int repeats) {
  Timed out;
  std::vector<double> times;
  for (int i = 0; i < repeats; ++i) {
    const double start = cpu_s();
    out.motion = cloth::simulate(sheet, lanes, options);
    times.push_back(cpu_s() - start);
  }
  std::sort(times.begin(), times.end());
  out.seconds = times[times.size() / 2];
  return out;
}

double apart_mm(const cloth::Trajectory& a, const cloth::Trajectory& b) {
  double sum = 0;
  for (size_t k = 0; k < a.samples.size(); ++k) sum += (a.samples[k] - b.samples[k]).colwise().squaredNorm().mean();
  return 1e3 * std::sqrt(sum / static_cast<double>(a.samples.size()));
}

cloth::Sheet bench_sheet(int n) { return cloth::make_sheet(geometry::make_grid_mesh(0.3, 0.3, n, n)); }

}  // namespace

std::vector<Figure> bench_cloth(const FigureOptions& options) {
  std::vector<Figure> out;
  const int n = options.quick ? 9 : 33, repeats = options.quick ? 1 : 3;
  const cloth::Sheet sheet = bench_sheet(n);
  double one_s = 0;
  for (const BenchFabric& fabric : kFabrics) {
    const Experiment e = swatch(sheet, fabric);
    cloth::Options tight;
    tight.integrator = cloth::Options::Integrator::runge_kutta_45;
    tight.tolerance_m = 1e-6;
    const Timed reference = timed(sheet, {e}, tight, 1), own = timed(sheet, {e}, {}, repeats);
    if (&fabric == kFabrics) one_s = own.seconds;
    const std::string label = fmt::format("{}, {}x{}", fabric.name, n, n);
    out.push_back({label + ": leapfrog", own.seconds, fabric.target_s, "s per simulated s", Relation::shown, "target at 33x33"});
    out.push_back({label + ": leapfrog's distance from Runge-Kutta 4(5)", apart_mm(own.motion[0], reference.motion[0]), 0.5, "mm rms",
                   Relation::at_most, "equal error asked"});
    out.push_back({label + ": Runge-Kutta 4(5) against leapfrog", reference.seconds / own.seconds, 1, "times", Relation::shown,
                   "same run"});
    options.progress(&fabric == kFabrics ? 0.3 : 0.6, fabric.name);
  }
  const Experiment knit = swatch(sheet, kFabrics[0]);
  std::vector<Experiment> batch(8, knit);
  for (size_t i = 0; i < batch.size(); ++i) batch[i].material.shear *= 1 + 0.01 * static_cast<double>(i);
  const double batch_s = timed(sheet, batch, {}, repeats).seconds;
  out.push_back({"knit: throughput of a batch of 8 on one thread against one at a time", 8 * one_s / batch_s, 4, "times", Relation::shown,
                 "target, with two threads"});
  options.progress(0.8, "mesh sizes");
  const int small = options.quick ? 5 : 17, large = options.quick ? 17 : 65;
  const cloth::Sheet coarse = bench_sheet(small), fine = bench_sheet(large);
  const double coarse_s = timed(coarse, {swatch(coarse, kFabrics[0])}, {}, repeats).seconds;
  const double fine_s = timed(fine, {swatch(fine, kFabrics[0])}, {}, 1).seconds;
  out.push_back({fmt::format("knit: cost from {0}x{0} to {1}x{1}", small, large), fine_s / coarse_s, 1, "times", Relation::shown, "same run"});
  out.push_back({"knit: exponent of the cost in the number of vertices",
                 std::log(fine_s / coarse_s) / (2 * std::log(static_cast<double>(large) / small)), 1.5, "", Relation::shown,
                 "1 for the vertices, 0.5 for the step"});
  options.progress(1, "done");
  return out;
}

}  // namespace selvedge::cli
