// A Gauss-Newton step that stays within bounds.
#pragma once

#include <Eigen/Core>

namespace selvedge::estimate {

// An s that lessens gradient·s + ½ sᵀ normal s, with low ≤ s ≤ high and low ≤ 0 ≤ high, by an active set: the
// coordinate that would leave its bounds furthest is put on them, and stays there, and the rest is solved again. Where
// no bound is met it is the least. A step that is solved without bounds and cut off at them afterwards has the other
// coordinates make up for moves that are not taken: from a point on a bound it may lead uphill however short it is.
// normal: n × n, symmetric and positive definite; the others n.
Eigen::VectorXd bounded_step(const Eigen::MatrixXd& normal, const Eigen::VectorXd& gradient, const Eigen::VectorXd& low,
                             const Eigen::VectorXd& high);

}  // namespace selvedge::estimate
