#include "cloth/settle.h"

#include <algorithm>
#include <cmath>
#include <deque>

#include <Eigen/SparseCholesky>

#include "cloth/energy.h"
#include "cloth/held_motion.h"
#include "cloth/kernel/force_field.h"
#include "cloth/stiffness.h"

namespace selvedge::cloth {

namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kNear_m = 0.03;        // longest first step of a start that is near
constexpr double kLongest_m = 0.004;    // of a step
constexpr double kInertia_per_s2 = 10;  // mass is added to the stiffness by this: no mode is without resistance
constexpr int kMemory = 16, kMostSteps = 120, kMostTries = 4;
constexpr double kLeft = 0.9;  // share of the push along a step that may be left at its end

double longest(const VectorXd& step) {
  return std::sqrt(step.reshaped(3, step.size() / 3).colwise().squaredNorm().maxCoeff());
}

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

struct Pair {
  VectorXd moved, changed;  // of positions, and of forces with their sign turned
  double inverse;           // 1 / (moved · changed)
};

VectorXd direction(const FirstGuess& guess, const std::deque<Pair>& pairs, const VectorXd& force) {
  VectorXd q = force;
  std::vector<double> alpha(pairs.size());
  for (size_t i = pairs.size(); i-- > 0;) {
    alpha[i] = pairs[i].inverse * pairs[i].moved.dot(q);
    q -= alpha[i] * pairs[i].changed;
  }
  VectorXd r = guess.times(q);
  for (size_t i = 0; i < pairs.size(); ++i)
    r += (alpha[i] - pairs[i].inverse * pairs[i].changed.dot(r)) * pairs[i].moved;
  return r;
}

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
  std::deque<Pair> pairs;
  for (int k = 0; k < kMostSteps; ++k) {
    VectorXd p = direction(guess, pairs, f);
    double push = p.dot(f);
    if (!(push > 0)) {
      pairs.clear();
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
    double share = std::min(1.0, kLongest_m / length);
    VectorXd there, force_there;
    for (int t = 0; t < kMostTries; ++t) {
      there = x + share * p;
      force_there = forces.at(there);
      const double left = force_there.allFinite() ? p.dot(force_there) : -1e9 * push;
      if (left > -kLeft * push) break;
      share *= std::clamp(push / (push - left), 0.1, 0.6);
    }
    if (!force_there.allFinite()) break;
    Pair pair{there - x, f - force_there, 0};
    const double curvature = pair.moved.dot(pair.changed);
    if (curvature > 1e-8 * pair.moved.norm() * pair.changed.norm()) {
      pair.inverse = 1 / curvature;
      pairs.push_back(std::move(pair));
      if (pairs.size() > kMemory) pairs.pop_front();
    }
    x = there;
    f = force_there;
  }
  return out;
}

}  // namespace selvedge::cloth
