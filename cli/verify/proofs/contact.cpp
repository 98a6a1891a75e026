// `./selvedge prove contact`: fabric that falls over a rod and onto itself never passes through itself, contact
// gives no energy, and friction holds up to its angle.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <string>

#include <tbb/parallel_for.h>

#include "cli/verify/figures.h"
#include "cli/verify/proofs/contact_cases.h"
#include "cli/verify/proofs/skirt_case.h"

namespace selvedge::cli {

namespace {

struct SeedSweep {
  int intersecting = 0;  // seeds with intersecting triangles at any sample
  int not_finite = 0;
  double most_work_J = 0;  // that contact had given at any time
  long impacts = 0, zone_steps = 0;
};

template <class MakeScene>
SeedSweep sweep(const FigureOptions& options, int seeds, const std::string& name, double from, double to,
                MakeScene make_scene) {
  SeedSweep all;
  std::mutex mutex;
  int done = 0;
  tbb::parallel_for(0, seeds, [&](int i) {
    const ContactOutcome out = run_contact_scene(make_scene(options.seed + static_cast<unsigned>(i)));
    const std::lock_guard lock(mutex);
    all.intersecting += out.intersections > 0;
    all.not_finite += !out.trajectory.finite;
    all.most_work_J = std::max(all.most_work_J, out.statistics.most_work_J);
    all.impacts += out.statistics.impacts;
    all.zone_steps += out.statistics.zone_steps;
    options.progress(from + (to - from) * ++done / seeds,
                     name + ", " + std::to_string(all.intersecting) + " seeds intersect");
  });
  return all;
}

void add_sweep(std::vector<Figure>& figures, const std::string& name, int seeds, const SeedSweep& s) {
  const std::string what = name + ", " + std::to_string(seeds) + " seeds: ";
  figures.push_back(
      {what + "seeds with intersecting triangles", double(s.intersecting), 0, "", Relation::at_most, "required"});
  figures.push_back({what + "seeds that diverged", double(s.not_finite), 0, "", Relation::at_most, "required"});
  figures.push_back(
      {what + "most energy that contact gave", s.most_work_J, 1e-9, "J", Relation::at_most, "contact only takes"});
  figures.push_back({what + "collisions stopped within a step", double(s.impacts), 0, "", Relation::shown, ""});
  figures.push_back({what + "steps with rigid zones", double(s.zone_steps), 0, "", Relation::shown, ""});
}

// The steepest angle at which a patch stays, by bisection, over what its friction says.
double angle_share(double friction, bool quick) {
  double low = 0.5 * std::atan(friction), high = 1.5 * std::atan(friction);
  for (int k = 0; k < (quick ? 6 : 10); ++k) {
    const double middle = (low + high) / 2;
    const ContactOutcome out = run_contact_scene(patch_on_incline(middle, friction, 0.5));
    const double slid_m = (out.trajectory.samples.back() - out.trajectory.start).colwise().norm().mean();
    (slid_m > 5e-4 ? high : low) = middle;
  }
  return std::tan((low + high) / 2) / friction;
}

void add_skirt(std::vector<Figure>& figures, const FigureOptions& options) {
  const double duration_s = options.quick ? 0.8 : 10;
  const WornSkirt skirt = wear_walking_skirt(
      options.quick ? 1200 : 20000, duration_s,
      [&](double done, const std::string& what) { options.progress(0.65 + 0.35 * done, "skirt: " + what); });
  const std::string what = "skirt of " + std::to_string(skirt.triangles) + " triangles, " +
                           std::to_string(duration_s).substr(0, 4) + " s of walking: ";
  const garment::Worn& worn = skirt.worn;
  figures.push_back({what + "frames with intersecting triangles",
                     worn.finite ? double(worn.frames_that_intersect) : 1e9, 0, "", Relation::at_most, "required"});
  figures.push_back({what + "steps after which a pair was left unresolved", double(worn.contact.unresolved), 0, "",
                     Relation::at_most, ""});
  figures.push_back({what + "deepest vertex in the body", 1e3 * worn.deepest_in_body_m, 5, "mm", Relation::at_most,
                     "it may give way between the thighs"});
  figures.push_back({what + "largest strain", 100 * worn.largest_strain, 0, "%", Relation::shown, ""});
  figures.push_back(
      {what + "collisions stopped within a step", double(worn.contact.impacts), 0, "", Relation::shown, ""});
  figures.push_back({what + "steps with rigid zones", double(worn.contact.zone_steps), 0, "", Relation::shown, ""});
  figures.push_back({what + "wall time per simulated second", worn.wall_s / worn.simulated_s, 30, "s", Relation::shown,
                     "aim, at 20000 triangles; timed by bench contact"});
}

}  // namespace

std::vector<Figure> prove_contact(const FigureOptions& options) {
  std::vector<Figure> figures;
  const int seeds = options.quick ? 6 : 1000, columns = 17;
  add_sweep(figures, "sheet dropped over a rod", seeds,
            sweep(options, seeds, "sheets over a rod", 0, 0.4,
                  [&](unsigned seed) { return sheet_over_rod(seed, columns, 0.8); }));
  add_sweep(figures, "folded sheet", seeds, sweep(options, seeds, "folded sheets", 0.4, 0.6, [&](unsigned seed) {
              return folded_sheet(seed, columns, 0.5);
            }));

  const int plain = options.quick ? 2 : 20;
  const SeedSweep without = sweep(options, plain, "folded sheets without contact", 0.6, 0.62, [&](unsigned seed) {
    ContactScene scene = folded_sheet(seed, columns, 0.5);
    scene.options.self_collision = false;
    return scene;
  });
  figures.push_back({"the same folded sheets without self-collision: share that intersect",
                     double(without.intersecting) / plain, 0.5, "", Relation::at_least, "the test can fail"});

  const std::vector<double> frictions = {0.1, 0.3, 0.6};
  for (size_t i = 0; i < frictions.size(); ++i) {
    options.progress(0.62 + 0.03 * double(i) / 3, "friction on an incline");
    const std::string what = "friction " + std::to_string(frictions[i]).substr(0, 3) + ": ";
    figures.push_back({what + "tangent of the angle at which a patch slides, off by",
                       100 * std::abs(angle_share(frictions[i], options.quick) - 1), options.quick ? 3.0 : 1.0, "%",
                       Relation::at_most, "Coulomb"});
  }
  add_skirt(figures, options);
  return figures;
}

}  // namespace selvedge::cli
