#include <Eigen/Geometry>

#include "hardware_sim/hidden_effects/hidden_effect.h"

namespace selvedge::hardware_sim {

namespace {

// A seam slanting across the sheet: edges along it resist bending eight times as much.
class StitchedLine : public LatticeExtra {
 public:
  explicit StitchedLine(double strength) : strength_(strength) {}
  void add(const LatticeView& s, double) override {
    const double k = strength_ * 8 * s.truth->bend / (s.hu * s.hu);
    const auto at = [&](int i) { return Eigen::Vector3d(s.x[0][i], s.x[1][i], s.x[2][i]); };
    for (int r = 1; r + 1 < s.rows; ++r) {
      const int c = s.columns / 4 + r / 2;
      if (c < 1 || c + 1 >= s.columns) continue;
      const int i = r * s.columns + c, before = i - s.columns - 1, after = i + s.columns + 1;
      const Eigen::Vector3d pull = k * (at(before) - 2 * at(i) + at(after));
      for (int a = 0; a < 3; ++a) {
        s.f[a][before] -= pull(a);
        s.f[a][i] += 2 * pull(a);
        s.f[a][after] -= pull(a);
      }
    }
  }

 private:
  double strength_;
};

}  // namespace

HiddenEffect stitched_line() {
  return {"stitched_line",
          [](double strength) -> std::shared_ptr<LatticeExtra> { return std::make_shared<StitchedLine>(strength); },
          0.5};
}

}  // namespace selvedge::hardware_sim
