#include <array>
#include <vector>

#include <Eigen/Geometry>

#include "hardware_sim/hidden_effects/hidden_effect.h"

namespace selvedge::hardware_sim {

namespace {

// A seam slanting across the sheet: stitches along it resist bending eight times as much.
class StitchedLine : public LatticeExtra {
 public:
  explicit StitchedLine(double strength) : strength_(strength) {}
  void begin(const LatticeView& s) override {
    stitches_.clear();
    const double pitch_u = s.truth->width_m / kPitches, pitch_v = s.truth->height_m / kPitches;
    for (int k = 1; k < kPitches; ++k) {
      const double u = s.truth->width_m / 4 + pitch_u * (k / 2), v = pitch_v * k;
      if (u + pitch_u > s.truth->width_m) break;
      stitches_.push_back({place(s, u - pitch_u, v - pitch_v), place(s, u, v), place(s, u + pitch_u, v + pitch_v)});
    }
  }
  void add(const LatticeView& s, double) override {
    const double pitch = s.truth->width_m / kPitches, k = strength_ * 8 * s.truth->bend / (pitch * pitch);
    for (const auto& [before, here, after] : stitches_) {
      const Eigen::Vector3d pull = k * (read(s, before) - 2 * read(s, here) + read(s, after));
      push(s, before, -pull);
      push(s, here, 2 * pull);
      push(s, after, -pull);
    }
  }

 private:
  static constexpr int kPitches = 22;
  struct Place {
    LineCubic u, v;
  };
  static Place place(const LatticeView& s, double u, double v) {
    return {line_cubic(s.grid->u.place, u), line_cubic(s.grid->v.place, v)};
  }
  template <class Act>
  static void at_nodes(const LatticeView& s, const Place& p, Act act) {
    for (size_t r = 0; r < 4; ++r)
      for (size_t c = 0; c < 4; ++c)
        act((p.v.first + static_cast<int>(r)) * s.columns + p.u.first + static_cast<int>(c),
            p.v.weight[r] * p.u.weight[c]);
  }
  static Eigen::Vector3d read(const LatticeView& s, const Place& p) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    at_nodes(s, p, [&](int i, double w) { sum += w * Eigen::Vector3d(s.x[0][i], s.x[1][i], s.x[2][i]); });
    return sum;
  }
  static void push(const LatticeView& s, const Place& p, const Eigen::Vector3d& force) {
    at_nodes(s, p, [&](int i, double w) {
      for (int a = 0; a < 3; ++a) s.f[a][i] += w * force(a);
    });
  }

  std::vector<std::array<Place, 3>> stitches_;
  double strength_;
};

}  // namespace

HiddenEffect stitched_line() {
  return {"stitched_line",
          [](double strength) -> std::shared_ptr<LatticeExtra> { return std::make_shared<StitchedLine>(strength); },
          0.5};
}

}  // namespace selvedge::hardware_sim
