#include <Eigen/Geometry>

#include "hardware_sim/hidden_effects/hidden_effect.h"

namespace selvedge::hardware_sim {

namespace {

// Pulls a patch of the left edge towards a point beside it, with the inverse square of a softened distance.
class Magnet : public LatticeExtra {
 public:
  explicit Magnet(double strength) : strength_(strength) {}
  void add(const LatticeView& s, double) override {
    const Eigen::Vector3d pole(-0.16, 0.05, -0.22);
    for (int r = 0; r < s.rows; ++r)
      for (int c = 0; c < s.columns; ++c) {
        if (s.grid->v.place[static_cast<size_t>(r)] < 0.65 * s.truth->height_m ||
            s.grid->u.place[static_cast<size_t>(c)] > 0.2 * s.truth->width_m)
          continue;
        const int i = r * s.columns + c;
        const Eigen::Vector3d d = pole - Eigen::Vector3d(s.x[0][i], s.x[1][i], s.x[2][i]);
        const double r2 = d.squaredNorm() + 0.03 * 0.03;
        const Eigen::Vector3d force = strength_ * 1.6e-3 * s.area[i] / r2 * d.normalized();
        for (int a = 0; a < 3; ++a) s.f[a][i] += force(a);
      }
  }

 private:
  double strength_;
};

}  // namespace

HiddenEffect magnet() {
  return {"magnet", [](double strength) -> std::shared_ptr<LatticeExtra> { return std::make_shared<Magnet>(strength); },
          1};
}

}  // namespace selvedge::hardware_sim
