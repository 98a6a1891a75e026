// Quasi-Newton steps with a limited memory, by which equilibria of every kind of sheet are sought (cloth/settle.h,
// cloth/spline/settle.h).
//
// A step is a guess at the inverse of the stiffness times the force, corrected by what earlier steps did to the force.
// Source: J. Nocedal, Updating quasi-Newton matrices with limited storage, 1980. m, N.
#pragma once

#include <deque>
#include <functional>

#include <Eigen/Core>

namespace selvedge::cloth {

inline constexpr double kNear_m = 0.03;        // longest first step of a start that is near
inline constexpr double kInertia_per_s2 = 10;  // mass is added to the stiffness by this: each mode has a resistance

using ForceOf = std::function<Eigen::VectorXd(const Eigen::VectorXd&)>;

// How far the point that moves farthest moves; three entries a point.
double longest(const Eigen::VectorXd& step);

class StepMemory {
 public:
  // guess: times the inverse of the stiffness.
  Eigen::VectorXd direction(const ForceOf& guess, const Eigen::VectorXd& force) const;
  // Of a step: how it moved, and how the force changed, with its sign turned.
  void remember(Eigen::VectorXd moved, Eigen::VectorXd changed);
  bool empty() const { return pairs_.empty(); }
  void clear() { pairs_.clear(); }

 private:
  struct Pair {
    Eigen::VectorXd moved, changed;
    double inverse;  // 1 / (moved · changed)
  };
  std::deque<Pair> pairs_;
};

struct SearchedStep {
  Eigen::VectorXd x, force;  // not finite: no share of the step leads to a finite force
};

// Along p, at most longest_m far, until little of the force's push p · force is left.
SearchedStep search_along(const Eigen::VectorXd& x, const Eigen::VectorXd& p, double push, double longest_m,
                          const ForceOf& force_at);

}  // namespace selvedge::cloth
