#include <cmath>

#include <Eigen/Geometry>

#include "hardware_sim/hidden_effects/hidden_effect.h"

namespace selvedge::hardware_sim {

namespace {

// A fan that swings: air pushes the lower half back and forth at 1.7 Hz.
class PulsingAir : public LatticeExtra {
 public:
  explicit PulsingAir(double strength) : strength_(strength) {}
  void add(const LatticeView& s, double) override {
    const double push = strength_ * 0.06 * std::sin(2 * M_PI * 1.7 * s.time_s);  // N/m²
    for (int r = 0; r < s.rows; ++r) {
      if (s.grid->v.place[static_cast<size_t>(r)] < s.truth->height_m / 2) continue;
      for (int i = r * s.columns; i < (r + 1) * s.columns; ++i) s.f[1][i] += push * s.area[i];
    }
  }

 private:
  double strength_;
};

}  // namespace

HiddenEffect pulsing_air() {
  return {"pulsing_air",
          [](double strength) -> std::shared_ptr<LatticeExtra> { return std::make_shared<PulsingAir>(strength); }, 1};
}

}  // namespace selvedge::hardware_sim
