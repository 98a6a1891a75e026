// `./selvedge prove worlds`: the mesh of each of the bank's worlds does not matter; fabrics and motions as a bank draws
// them, on the usual cells and on finer ones.
#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "cli/verify/figures.h"
#include "cli/verify/thread_cpu.h"
#include "hardware_sim/bank/bank_campaign.h"

namespace selvedge::cli {

namespace {

using hardware_sim::BankWorld;
using hardware_sim::SwatchHold;

constexpr double kFiner = 1.4, kSeen_hz = 60;

std::vector<Eigen::Vector2d> dots() {
  std::vector<Eigen::Vector2d> uv;
  for (int k = 0; k < 25; ++k)
    uv.emplace_back(hardware_sim::kSwatch_m * (0.1 + 0.2 * (k % 5)), hardware_sim::kSwatch_m * (0.1 + 0.2 * (k / 5)));
  return uv;
}

struct Swing {
  std::vector<Eigen::Matrix3Xd> dots;  // at rest, then at every sample
  double cpu_s = 0;                    // per simulated second, without coming to rest
};

// A fabric has several equilibria, and which one it falls into is no matter of the mesh: a finer sheet begins in the
// shape of the usual one at rest.
Swing swing(hardware_sim::SwatchSheet& at_rest, const hardware_sim::BankMotion& motion, double duration_s) {
  Swing out;
  out.dots.push_back(at_rest.points(dots()));
  const double begin = thread_cpu_s();
  for (int i = 1; i <= duration_s * kSeen_hz; ++i) {
    at_rest.advance(1 / kSeen_hz, motion.left(i / kSeen_hz), motion.right(i / kSeen_hz));
    out.dots.push_back(at_rest.points(dots()));
  }
  out.cpu_s = (thread_cpu_s() - begin) / duration_s;
  return out;
}

double dots_apart_mm(const Swing& a, const Swing& b, size_t from, size_t to) {
  double sum = 0;
  for (size_t i = from; i < to; ++i) sum += (a.dots[i] - b.dots[i]).colwise().squaredNorm().mean();
  return 1e3 * std::sqrt(sum / static_cast<double>(to - from));
}

struct Seen {
  std::vector<double> rest_mm, swing_mm, cpu_s;
};

}  // namespace

std::vector<Figure> prove_worlds(const FigureOptions& options) {
  const int fabrics = options.quick ? 1 : 8;
  const double duration_s = options.quick ? 0.1 : 1, asked_mm = options.quick ? 0.4 : 0.2;
  std::vector<Figure> out;
  std::mt19937_64 generator(options.seed);
  std::vector<Seen> seen(hardware_sim::bank_world_names().size());
  std::vector<double> apart;
  for (int f = 0; f < fabrics; ++f) {
    const hardware_sim::FabricTruth fabric = hardware_sim::draw_fabric(generator);
    const SwatchHold hold = draw_hold(fabric, generator);
    const hardware_sim::BankMotion motion = hardware_sim::draw_waving(hold, generator);
    std::vector<Swing> usual;
    std::string line = fmt::format("bending length {:.1f} mm, {:.3f} kg/m², {:.0f} N/m, {}",
                                   1e3 * hardware_sim::bending_length_m(fabric), fabric.density, fabric.stretch,
                                   hold == SwatchHold::corners ? "corners" : "edge");
    for (size_t w = 0; w < seen.size(); ++w) {
      options.progress((f + static_cast<double>(w) / static_cast<double>(seen.size())) / fabrics,
                       hardware_sim::bank_world_names()[w]);
      const auto world = static_cast<BankWorld>(w);
      hardware_sim::SwatchOptions swatch;
      swatch.hold = hold;
      const auto sheet = make_swatch(world, fabric, swatch, {});
      swatch.fineness = kFiner;
      const auto finer_sheet = make_swatch(world, fabric, swatch, {});
      const Eigen::Vector3d left = motion.left(0), right = motion.right(0);
      hang(*sheet, hardware_sim::HungCurve(left, right, {0, 1, 0}, swatch.gravity_m_s2, fabric.width_m));
      settle(*sheet, left, right);
      lie_as(*finer_sheet, *sheet);
      settle(*finer_sheet, left, right);
      usual.push_back(swing(*sheet, motion, duration_s));
      const Swing finer = swing(*finer_sheet, motion, duration_s);
      seen[w].rest_mm.push_back(dots_apart_mm(usual.back(), finer, 0, 1));
      seen[w].swing_mm.push_back(dots_apart_mm(usual.back(), finer, 1, usual.back().dots.size()));
      seen[w].cpu_s.push_back(usual.back().cpu_s);
      line += fmt::format("; {}: rest {:.3f}, swing {:.3f} mm, {:.2f} CPU s/s", hardware_sim::bank_world_names()[w],
                          seen[w].rest_mm.back(), seen[w].swing_mm.back(), seen[w].cpu_s.back());
      if (w > 0) apart.push_back(dots_apart_mm(usual.front(), usual.back(), 1, usual.back().dots.size()));
    }
    options.tell(line);
  }
  const std::string source = options.quick ? "asked in full: 0.2" : "asked";
  for (size_t w = 0; w < seen.size(); ++w) {
    const std::string what =
        fmt::format("{}, {} fabrics, {:.1f} times the cells, ", hardware_sim::bank_world_names()[w], fabrics, kFiner);
    const auto worst = [](const std::vector<double>& v) { return *std::max_element(v.begin(), v.end()); };
    out.push_back({what + "at rest: worst", worst(seen[w].rest_mm), asked_mm, "mm rms", Relation::at_most, source});
    out.push_back({what + "a swing: median", median(seen[w].swing_mm), asked_mm, "mm rms", Relation::at_most, source});
    out.push_back({what + "a swing: worst", worst(seen[w].swing_mm), asked_mm, "mm rms", Relation::at_most, source});
    out.push_back(
        {what + "cost on the usual cells", median(seen[w].cpu_s), 0, "CPU s per simulated s", Relation::shown, ""});
  }
  out.push_back({"another world than the lattice, a swing: median", median(apart), 0, "mm rms", Relation::shown,
                 "what strain measures and the air differ by"});
  options.progress(1, "done");
  return out;
}

}  // namespace selvedge::cli
