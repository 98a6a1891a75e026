#include "hardware_sim/bank/point_extras.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <vector>

#include "hardware_sim/bank/added_weights.h"

namespace selvedge::hardware_sim {

namespace {

// One strain's memory of one number a point.
struct Memory {
  std::vector<float> strain, kept, strain_now, kept_now;
  void begin(const PointStrain& s) {
    if (!strain.empty()) return;
    strain = strain_now = s.strain;
    kept.assign(s.strain.size(), 0.0f);
    kept_now = kept;
  }
  void keep() {
    strain = strain_now;
    kept = kept_now;
  }
};

// A stress or moment of a strain, of its change since memory was kept, and of what was kept then.
using Law = std::function<float(float strain, float change, double since_s, float& kept)>;

void apply(const Law& law, const PointView& view, PointStrain& s, Memory& memory) {
  memory.begin(s);
  memory.strain_now = s.strain;
  for (size_t i = 0; i < s.strain.size(); ++i) {
    memory.kept_now[i] = memory.kept[i];
    s.stress[i] += law(s.strain[i], s.strain[i] - memory.strain[i], view.since_s, memory.kept_now[i]);
  }
}

class LawOfPoints : public PointEffect {
 public:
  enum class Of { stretch, stretch_along, bend, bend_along };
  using Make = std::function<Law(const FabricTruth&)>;
  LawOfPoints(Of of, Make make) : of_(of), make_(std::move(make)) {}

  void stress(const PointView& view, PointStrain& along, PointStrain& down) override {
    if (bends()) return;
    act(view, along, down, of_ == Of::stretch);
  }
  bool bends() const override { return of_ == Of::bend || of_ == Of::bend_along; }
  void moment(const PointView& view, PointStrain& along, PointStrain& down) override {
    act(view, along, down, of_ == Of::bend);
  }
  void keep() override {
    along_.keep();
    down_.keep();
  }

 private:
  void act(const PointView& view, PointStrain& along, PointStrain& down, bool both) {
    if (!law_) law_ = make_(*view.truth);
    apply(law_, view, along, along_);
    if (both) apply(law_, view, down, down_);
  }

  Of of_;
  Make make_;
  Law law_;
  Memory along_, down_;
};

// Energy ν k E_u E_v.
class CouplingOfPoints : public PointEffect {
 public:
  explicit CouplingOfPoints(double nu) : nu_(nu) {}
  void stress(const PointView& view, PointStrain& along, PointStrain& down) override {
    const auto k = static_cast<float>(nu_ * view.truth->stretch);
    for (size_t i = 0; i < along.strain.size(); ++i) {
      along.stress[i] += k * down.strain[i];
      down.stress[i] += k * along.strain[i];
    }
  }

 private:
  double nu_;
};

// Along each rim the fabric bends seven times as hard, fading within 7.7 mm.
class StiffRim : public PointEffect {
 public:
  bool bends() const override { return true; }
  void moment(const PointView& view, PointStrain& along, PointStrain& down) override {
    const PointLine &u = view.grid->u(), &v = view.grid->v();
    const auto near = [](double place, double length) {
      constexpr double kFades_m = 0.00767;
      const double distance = std::min(place, length - place) / kFades_m;
      return std::exp(-distance * distance);
    };
    const double k = 6 * view.truth->bend;
    size_t i = 0;
    for (const double pu : u.point)
      for (const double pv : v.point) {
        along.stress[i] += static_cast<float>(k * near(pv, view.truth->height_m)) * along.strain[i];
        down.stress[i] += static_cast<float>(k * near(pu, view.truth->width_m)) * down.strain[i];
        ++i;
      }
  }
};

// One of two sliders of half the size, behind a spring that gives way over such a strain.
Law slider(double size, double gives_way) {
  const auto half = static_cast<float>(size / 2);
  const auto stiff = static_cast<float>(size / 2 / gives_way);
  return
      [=](float, float change, double, float& kept) { return kept = std::clamp(kept + stiff * change, -half, half); };
}

}  // namespace

bool add_point_extra(PointSheet& sheet, const std::string& name, double size) {
  using Of = LawOfPoints::Of;
  const auto add = [&](Of of, LawOfPoints::Make make, double share) {
    sheet.add(std::make_shared<LawOfPoints>(of, std::move(make)), share);
    return true;
  };
  const auto f = static_cast<float>(size);
  if (name == "anisotropy")
    return add(
        Of::stretch_along,
        [f](const FabricTruth& t) {
      return [k = f * static_cast<float>(t.stretch)](float e, float, double, float&) { return k * e; };
        },
        1 / std::sqrt(1 + size));
  if (name == "coupling") {
    sheet.add(std::make_shared<CouplingOfPoints>(size), 1 / std::sqrt(1 + size));
    return true;
  }
  if (name == "stretch_stiffening")
    return add(
        Of::stretch,
        [f](const FabricTruth& t) {
      return [k = f * f * static_cast<float>(t.stretch)](float e, float, double, float&) {
        const float x = std::clamp(e, -0.3f, 0.3f);
        return k * x * x * x;
      };
        },
        0.4);
  if (name == "bend_nonlinearity")
    return add(
        Of::bend,
        [f](const FabricTruth&) {
      return [f](float curvature, float, double, float&) {
        const float k = std::clamp(curvature, -60.0f, 60.0f);
        return f * (k / 10) * (k / 10) * curvature;
      };
        },
        0.6);
  if (name == "rest_curvature")
    return add(
        Of::bend_along, [f](const FabricTruth&) { return [f](float, float, double, float&) { return -f; }; }, 1);
  if (name == "bend_friction") {
    add(
        Of::bend, [size](const FabricTruth&) { return slider(size, 1.5); }, 0.9);
    return add(
        Of::bend, [size](const FabricTruth&) { return slider(size, 4.5); }, 0.9);
  }
  if (name == "stretch_friction") {
    add(
        Of::stretch, [size](const FabricTruth&) { return slider(size, 0.002); }, 0.8);
    return add(
        Of::stretch, [size](const FabricTruth&) { return slider(size, 0.006); }, 0.8);
  }
  if (name == "creep")
    return add(
        Of::stretch,
        [f](const FabricTruth& t) {
      return [k = f * static_cast<float>(t.stretch)](float, float change, double since_s, float& kept) {
        return kept = (kept + k * change) * static_cast<float>(std::exp(-since_s / 0.8));
      };
        },
        1 / std::sqrt(1 + size));
  if (name == "hem") {
    sheet.add(std::make_shared<StiffRim>(), 0.6);
    const std::vector<double> along = sheet.grid().u().node_weight, down = sheet.grid().v().node_weight;
    sheet.add(std::make_shared<AddedWeights>([=](int r, int c, const LatticeView& s) {
                const bool on_row = r == 0 || r + 1 == s.rows, on_column = c == 0 || c + 1 == s.columns;
                return 0.012 * size * 0.04 *
                       (on_row      ? along[static_cast<size_t>(c)]
                        : on_column ? down[static_cast<size_t>(r)]
                                    : 0.0);
              }),
              1);
    return true;
  }
  return false;
}

}  // namespace selvedge::hardware_sim
