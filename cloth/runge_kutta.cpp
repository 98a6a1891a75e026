#include "cloth/runge_kutta.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "cloth/filtered_step.h"
#include "cloth/held_motion.h"
#include "cloth/kernel/force_field.h"

namespace selvedge::cloth {

namespace {

using Vector = Eigen::VectorXd;

// Dormand–Prince 5(4): nodes, stage weights, and the difference of the two solutions.
constexpr std::array<double, 7> kNode = {0, 1.0 / 5, 3.0 / 10, 4.0 / 5, 8.0 / 9, 1, 1};
constexpr double kStage[7][6] = {{},
                                 {1.0 / 5},
                                 {3.0 / 40, 9.0 / 40},
                                 {44.0 / 45, -56.0 / 15, 32.0 / 9},
                                 {19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729},
                                 {9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656},
                                 {35.0 / 384, 0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84}};
constexpr std::array<double, 7> kError = {71.0 / 57600,      0,          -71.0 / 16695, 71.0 / 1920,
                                          -17253.0 / 339200, 22.0 / 525, -1.0 / 40};

// y = [position; velocity], 6N; held vertices follow the path.
class System {
 public:
  System(const Sheet& sheet, const Experiment& e)
      : held_(sheet, e), count_(3 * sheet.data.vertex_count),
        field_(sheet.data, e.material, surroundings_of(e), held_.vertices()) {}

  Eigen::Index size() const { return 2 * count_; }
  const std::vector<kernel::HeldVertex>& held() const { return held_.vertices(); }

  void derivative(double t, Vector& y, double memory_step_s, Vector& dy) {
    held_.place(t, Eigen::Map<Eigen::Matrix3Xd>(y.data(), 3, count_ / 3));
    held_.move(t, Eigen::Map<Eigen::Matrix3Xd>(y.data() + count_, 3, count_ / 3));
    dy.resize(size());
    dy.head(count_) = y.tail(count_);
    field_.accelerations(y.data(), y.data() + count_, memory_step_s, dy.data() + count_);
    for (const kernel::HeldVertex& h : held_.vertices()) dy.segment<3>(count_ + 3 * h.vertex).setZero();
  }

 private:
  HeldMotion held_;
  Eigen::Index count_;
  kernel::ForceField field_;
};

// One trial step; returns the largest error (m, or m/s times 1 s) of the embedded pair.
double attempt(System& system, double t, double h, const Vector& y, std::array<Vector, 7>& k, Vector& next) {
  Vector stage;
  for (size_t s = 1; s < 7; ++s) {
    stage = y;
    for (size_t j = 0; j < s; ++j)
      if (kStage[s][j] != 0) stage += h * kStage[s][j] * k[j];
    system.derivative(t + kNode[s] * h, stage, 0, k[s]);
  }
  next = stage;  // the last stage is the fifth-order solution
  Vector error = Vector::Zero(y.size());
  for (size_t s = 0; s < 7; ++s)
    if (kError[s] != 0) error += h * kError[s] * k[s];
  const Eigen::Index half = y.size() / 2;
  return std::max(error.head(half).lpNorm<Eigen::Infinity>(), 0.01 * error.tail(half).lpNorm<Eigen::Infinity>());
}

}  // namespace

void run_runge_kutta(const Sheet& sheet, const Experiment& experiment, double tolerance_m, Trajectory& trajectory) {
  System system(sheet, experiment);
  const FilteredStep contact(sheet, experiment, system.held());
  const Eigen::Index half = system.size() / 2;
  Vector y = Vector::Zero(system.size()), next;
  y.head(half) = Eigen::Map<const Vector>(trajectory.start.data(), half);
  std::array<Vector, 7> k;
  double t = experiment.start_s, h = 1e-4;
  system.derivative(t, y, kernel::kBroughtFromFlat, k[0]);
  for (const double sample : experiment.sample_s) {
    while (t < sample - 1e-12) {
      const double step = std::min(h, sample - t);
      system.derivative(t, y, 0, k[0]);
      const double error = attempt(system, t, step, y, k, next);
      if (!std::isfinite(error)) {
        trajectory.finite = false;
        return;
      }
      const double factor = std::clamp(0.9 * std::pow(tolerance_m / std::max(error, 1e-300), 0.2), 0.2, 5.0);
      if (error <= tolerance_m) {
        contact.apply(t, step, y.data(), next.data(), next.data() + half);
        t += step;
        y = next;
        system.derivative(t, y, step, k[0]);  // friction and creep move on with the accepted step
      }
      if (error > tolerance_m || step == h) h = step * factor;
    }
    trajectory.samples.emplace_back(Eigen::Map<const Eigen::Matrix3Xd>(y.data(), 3, half / 3));
  }
}

}  // namespace selvedge::cloth
