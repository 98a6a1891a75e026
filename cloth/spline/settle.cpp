#include "cloth/spline/settle.h"

#include <algorithm>
#include <utility>

#include <Eigen/Dense>

#include "cloth/kernel/force_field.h"
#include "cloth/quasi_newton.h"
#include "cloth/spline/banded_solver.h"
#include "cloth/spline/lane_run.h"

namespace selvedge::cloth::spline {

namespace {

using Eigen::Index;
using Eigen::Matrix3Xd;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kLongest_m = 0.02;  // of a step
constexpr double kWell_m = 5e-3;     // steps so short are told best by the tangent as it is
constexpr int kMostSteps = 2000, kCoarse = 12;
constexpr int kOften = 10;             // steps that a tangent serves
constexpr double kLeast_per_s2 = 0.3;  // mass times this stiffens: lest what the grips alone hold float away
constexpr double kFar_m = 0.02;        // a tangent serves so far from where it was taken

// Masses of the control points, kg.
VectorXd lumped(const SplineSheet& sheet, const Material& m) { return densities(sheet, m).cwiseProduct(areas(sheet)); }

// Forces at rest.
class Forces {
 public:
  Forces(const SplineSheet& sheet, const Experiment& e)
      : run_(sheet, {&e}), experiment_(e), mass_(lumped(sheet, e.material)), smooth_(smooth_forces_on(sheet, e)) {}
  VectorXd at(const VectorXd& x) {
    const Matrix3Xd control = x.reshaped(3, mass_.size());
    run_.set_position(0, control);
    run_.set_forces(cloth::kernel::kBroughtFromFlat);
    Matrix3Xd f = run_.force(0) + experiment_.gravity_m_s2 * mass_.transpose();
    if (smooth_.cols() > 0) f += smooth_;
    if (experiment_.guide)
      add_nudging(*experiment_.guide, mass_.sum(), experiment_.start_s, control.data(), nullptr, f.data());
    return f.reshaped();
  }
  const VectorXd& mass() const { return mass_; }

 private:
  LaneRun<double> run_;
  const Experiment& experiment_;
  VectorXd mass_;
  Matrix3Xd smooth_;
};

// The inverse of the tangent at a shape between what is held.
class FirstGuess {
 public:
  FirstGuess(const SplineSheet& sheet, const Experiment& e, const VectorXd& mass)
      : sheet_(sheet), experiment_(e), is_held_(3 * static_cast<size_t>(sheet.count()), 0), tangent_(sheet),
        solver_(sheet) {
    const double nudging = e.guide ? e.guide->nudging_per_s * e.guide->nudging_per_s : 0;
    inertia_ = (kLeast_per_s2 + nudging) * mass;
    for (const Grip& grip : grips_of(sheet, e.path.hold)) {
      if (grip.reads.size() > 1) joined_.push_back(grip);
      else
        for (int a = 0; a < 3; ++a) is_held_[static_cast<size_t>(3 * grip.reads[0].point + a)] = 1;
    }
    const auto joined = static_cast<Index>(joined_.size());
    reads_ = MatrixXd::Zero(sheet.count(), joined);
    rows_ = MatrixXd::Zero(3 * sheet.count(), 3 * joined);
    for (Index g = 0; g < joined; ++g)
      for (const Weight& w : joined_[static_cast<size_t>(g)].reads) {
        reads_(w.point, g) = w.weight;
        for (Index a = 0; a < 3; ++a) rows_(3 * w.point + a, 3 * g + a) = w.weight;
      }
    if (!joined_.empty()) reads_gram_.compute(MatrixXd(reads_.transpose() * reads_));
  }

  // well: the shape is thought to be near its equilibrium.
  bool factorise(const VectorXd& x, bool well) {
    cloth::throw_if_stopped(experiment_.stop);
    return (well && factorised(x, Convexity::as_it_is)) || factorised(x, Convexity::kept_positive);
  }

  VectorXd times(const VectorXd& f) const {
    VectorXd y = solver_.solve(held_out(f));
    if (!joined_.empty()) y -= moved_ * gram_.solve(VectorXd(rows_.transpose() * y));
    return y;
  }

  // Less what the rig's reactions to it are, by least squares: at rest nothing is left, and rounding of it is none of
  // a step's.
  VectorXd held_out(VectorXd f) const {
    for (Index i = 0; i < f.size(); ++i)
      if (is_held_[static_cast<size_t>(i)]) f(i) = 0;
    if (joined_.empty()) return f;
    auto force = f.reshaped(3, reads_.rows());
    const Matrix3Xd reaction = reads_gram_.solve(MatrixXd((force * reads_).transpose())).transpose();
    force -= reaction * reads_.transpose();
    return f;
  }

 private:
  bool factorised(const VectorXd& x, Convexity convexity) {
    const Matrix3Xd control = x.reshaped(3, inertia_.size());
    tangent_.set(experiment_.material, control, convexity);
    if (!solver_.factorise(tangent_, inertia_, is_held_)) return false;
    if (joined_.empty()) return true;
    moved_ = solver_.solve(rows_);
    gram_.compute(MatrixXd(rows_.transpose() * moved_));
    return true;
  }

  const SplineSheet& sheet_;
  const Experiment& experiment_;
  std::vector<char> is_held_;
  std::vector<Grip> joined_;  // that read more than one control point
  VectorXd inertia_;
  Tangent tangent_;
  BandedSolver solver_;
  MatrixXd reads_, rows_, moved_;  // of the joined grips: one a grip, one a grip and axis, how these move
  Eigen::LDLT<MatrixXd> gram_, reads_gram_;
};

Matrix3Xd placed(const SplineSheet& sheet, const Experiment& e, Matrix3Xd control) {
  const std::vector<Grip> grips = grips_of(sheet, e.path.hold);
  const auto moves = responses(sheet, grips, {sheet.u.inverse, sheet.v.inverse, {}});
  const Eigen::Matrix<double, 3, 2> corners = e.path.at(e.start_s);
  std::vector<Eigen::Vector3d> lack;
  for (const Grip& grip : grips) {
    lack.push_back(held_position(grip, e.path, corners));
    for (const Weight& w : grip.reads) lack.back() -= w.weight * control.col(w.point);
  }
  for (size_t g = 0; g < grips.size(); ++g)
    for (const Weight& w : moves[g]) control.col(w.point) += w.weight * lack[g];
  return control;
}

// Every other of them.
std::vector<double> thinned(const std::vector<double>& breaks) {
  std::vector<double> out;
  for (size_t i = 0; i + 1 < breaks.size(); i += 2) out.push_back(breaks[i]);
  out.push_back(breaks.back());
  return out;
}

// A start for this sheet from the equilibrium on half its cells a direction.
Matrix3Xd brought_nearer(const SplineSheet& sheet, const Experiment& e, const Matrix3Xd& start, double change_m) {
  const SplineSheet coarse =
      make_spline_sheet(sheet.swatch, {thinned(sheet.u.basis.breaks()), thinned(sheet.v.basis.breaks())});
  Experiment there = e;
  there.guide = nullptr;  // it reads control points of this sheet
  const Settled settled = settle(coarse, there, carried_over(sheet, start, coarse), change_m);
  return carried_over(coarse, settled.position, sheet);
}

}  // namespace

Settled settle(const SplineSheet& sheet, const Experiment& e, const Matrix3Xd& start, double change_m) {
  Forces forces(sheet, e);
  FirstGuess guess(sheet, e, forces.mass());
  Settled out{placed(sheet, e, start)};
  VectorXd x = out.position.reshaped(), taken_at = x;
  VectorXd f = guess.held_out(forces.at(x));
  const ForceOf inverse = [&](const VectorXd& force) { return guess.times(force); };
  const ForceOf force_at = [&](const VectorXd& at) { return guess.held_out(forces.at(at)); };
  StepMemory memory;
  int since = 0;
  bool well = true;
  for (bool fresh = false; out.steps < kMostSteps; ++out.steps) {
    if (!fresh) {
      if (!f.allFinite() || !guess.factorise(x, well)) break;
      ++out.factorised;
      memory.clear();
      taken_at = x;
      fresh = true;
      since = 0;
    }
    const VectorXd p = memory.direction(inverse, f);
    const double push = p.dot(f), length = longest(p);
    if (!(push > 0) && !memory.empty()) {
      fresh = false;
      continue;
    }
    if (length < 0.1 * change_m) {
      x += p;
      out.at_rest = true;
      break;
    }
    if (out.steps == 0 && length > kNear_m && !e.guide &&
        std::min(sheet.u.basis.cells(), sheet.v.basis.cells()) > kCoarse) {
      x = placed(sheet, e, brought_nearer(sheet, e, x.reshaped(3, x.size() / 3), 10 * change_m)).reshaped();
      f = force_at(x);
      fresh = false;
      continue;
    }
    well = length < kWell_m;
    SearchedStep there = search_along(x, p, push, kLongest_m, force_at);
    if (!there.force.allFinite()) break;
    memory.remember(there.x - x, f - there.force);
    x = std::move(there.x);
    f = std::move(there.force);
    if (longest(x - taken_at) > kFar_m || ++since == kOften) fresh = false;
  }
  out.position = x.reshaped(3, x.size() / 3);
  return out;
}

}  // namespace selvedge::cloth::spline
