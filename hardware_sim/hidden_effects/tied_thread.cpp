#include <Eigen/Geometry>

#include "hardware_sim/hidden_effects/hidden_effect.h"

namespace selvedge::hardware_sim {

namespace {

// A slack thread from the lower right corner to the ground: pulls once it is taut.
class TiedThread : public LatticeExtra {
 public:
  explicit TiedThread(double strength) : strength_(strength) {}
  void add(const LatticeView& s, double) override {
    const int i = s.columns * s.rows - 1;
    const Eigen::Vector3d d = Eigen::Vector3d(0.1, 0.02, -0.5) - Eigen::Vector3d(s.x[0][i], s.x[1][i], s.x[2][i]);
    const double taut = d.norm() - 0.18;
    if (taut <= 0) return;
    const Eigen::Vector3d force = strength_ * 0.15 * taut * d.normalized();
    for (int a = 0; a < 3; ++a) s.f[a][i] += force(a);
  }

 private:
  double strength_;
};

}  // namespace

HiddenEffect tied_thread() {
  return {"tied_thread",
          [](double strength) -> std::shared_ptr<LatticeExtra> { return std::make_shared<TiedThread>(strength); }, 1};
}

}  // namespace selvedge::hardware_sim
