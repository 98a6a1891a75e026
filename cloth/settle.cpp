#include "cloth/settle.h"

#include <utility>

#include <Eigen/SparseCholesky>

#include "cloth/energy.h"
#include "cloth/held_motion.h"
#include "cloth/kernel/force_field.h"
#include "cloth/quasi_newton.h"
#include "cloth/stiffness.h"

namespace selvedge::cloth {

namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kLongest_m = 0.004;  // of a step
constexpr int kMostSteps = 120;

// Forces at rest, with the held vertices' left out.
class Forces {
 public:
  Forces(const Sheet& sheet, const Experiment& e, const Material& still, const HeldMotion& held)
      : field_(sheet.data, still, surroundings_of(e), held.vertices()), mass_(vertex_masses(sheet, still)),
        is_held_(held.is_held()), zero_(VectorXd::Zero(3 * mass_.size())), guide_(e.guide), start_s_(e.start_s) {}
  VectorXd at(const VectorXd& x) {
    VectorXd f(x.size());
    field_.accelerations(x.data(), zero_.data(), kernel::kBroughtFromFlat, f.data());
    for (Index i = 0; i < f.size(); ++i) f(i) *= mass_(i / 3);
    if (guide_) add_nudging(*guide_, mass_.sum(), start_s_, x.data(), nullptr, f.data());
    for (Index i = 0; i < f.size(); ++i)
      if (is_held_[static_cast<size_t>(i)]) f(i) = 0;
    return f;
  }
  // Resistance of the pull, spread over the sheet like its mass, 1/s².
  double nudging_per_s2() const { return guide_ ? guide_->nudging_per_s * guide_->nudging_per_s : 0; }
  const VectorXd& mass() const { return mass_; }
  const std::vector<char>& is_held() const { return is_held_; }

 private:
  kernel::ForceField field_;
  VectorXd mass_;
  std::vector<char> is_held_;
  VectorXd zero_;
  std::shared_ptr<const Guide> guide_;
  double start_s_;
};

// The inverse of the stiffness at a shape, held vertices kept.
class FirstGuess {
 public:
  FirstGuess(const Sheet& sheet, const Material& m, const Forces& forces, const VectorXd& x) {
    StiffnessMatrix k = stiffness_matrix(sheet, m, (kInertia_per_s2 + forces.nudging_per_s2()) * forces.mass(),
                                         x.reshaped(3, x.size() / 3), {1, 0}, true);
    hold_still(forces.is_held(), k);
    solver_.compute(k);
  }
  bool ok() const { return solver_.info() == Eigen::Success; }
  VectorXd times(const VectorXd& f) const { return solver_.solve(f); }

 private:
  Eigen::SimplicialLLT<StiffnessMatrix> solver_;
};

}  // namespace

Settled settle(const Sheet& sheet, const Experiment& experiment, const Eigen::Matrix3Xd& start, double change_m) {
  Material still = experiment.material;
  still.added_mass = 0;
  const HeldMotion held(sheet, experiment);
  Forces forces(sheet, experiment, still, held);
  Settled out{start, false};
  held.place(experiment.start_s, out.position);
  VectorXd x = out.position.reshaped(), f = forces.at(x);
  const FirstGuess guess(sheet, still, forces, x);
  if (!guess.ok() || !f.allFinite()) return out;
  const ForceOf inverse = [&](const VectorXd& force) { return guess.times(force); };
  StepMemory memory;
  for (int k = 0; k < kMostSteps; ++k) {
    VectorXd p = memory.direction(inverse, f);
    double push = p.dot(f);
    if (!(push > 0)) {
      memory.clear();
      p = guess.times(f);
      push = p.dot(f);
      if (!(push > 0)) break;
    }
    const double length = longest(p);
    if (k == 0 && length > kNear_m) return out;
    if (length < 0.1 * change_m) {
      out.position = x.reshaped(3, x.size() / 3);
      out.at_rest = true;
      return out;
    }
    SearchedStep there = search_along(x, p, push, kLongest_m, [&](const VectorXd& at) { return forces.at(at); });
    if (!there.force.allFinite()) break;
    memory.remember(there.x - x, f - there.force);
    x = std::move(there.x);
    f = std::move(there.force);
  }
  return out;
}

}  // namespace selvedge::cloth
