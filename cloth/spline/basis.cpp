#include "cloth/spline/basis.h"

#include <algorithm>
#include <functional>
#include <stdexcept>

namespace selvedge::cloth::spline {

namespace {

using Index = Eigen::Index;

struct GaussPoint {
  double at, weight;  // on [−1, 1]
};

// Abramowitz & Stegun, table 25.4.
const std::vector<GaussPoint>& gauss_points(int count) {
  static const std::vector<std::vector<GaussPoint>> tables = {
      {{0, 2}},
      {{-0.5773502691896257, 1}, {0.5773502691896257, 1}},
      {{-0.7745966692414834, 5.0 / 9}, {0, 8.0 / 9}, {0.7745966692414834, 5.0 / 9}},
      {{-0.8611363115940526, 0.3478548451374538},
       {-0.3399810435848563, 0.6521451548625461},
       {0.3399810435848563, 0.6521451548625461},
       {0.8611363115940526, 0.3478548451374538}}};
  return tables.at(static_cast<size_t>(count - 1));
}

}  // namespace

Basis::Basis(std::vector<double> breaks) : breaks_(std::move(breaks)) {
  if (breaks_.size() < 5) throw std::invalid_argument("spline::Basis: expected at least four cells");
  if (breaks_[0] != 0 || !std::is_sorted(breaks_.begin(), breaks_.end(), std::less_equal<double>()))
    throw std::invalid_argument("spline::Basis: breaks must begin at 0 and ascend");
  knots_.assign(kDegree, breaks_.front());
  knots_.insert(knots_.end(), breaks_.begin(), breaks_.end());
  knots_.insert(knots_.end(), kDegree, breaks_.back());
}

Alive Basis::at(double x_m) const {
  const double x = std::clamp(x_m, 0.0, length_m());
  const auto above = std::upper_bound(breaks_.begin() + 1, breaks_.end() - 1, x);
  const auto cell = static_cast<size_t>(above - breaks_.begin() - 1);
  const auto knot = [&](size_t i) { return knots_[i]; };
  // now[d][k]: d-th derivative of function cell + k, of the degree reached so far.
  std::array<std::array<double, 5>, 4> now{};
  now[0][kDegree] = 1;  // of degree 0, function cell + 3 is the one alive
  for (size_t degree = 1; degree <= kDegree; ++degree) {
    std::array<std::array<double, 5>, 4> next{};
    for (size_t k = kDegree - degree; k <= kDegree; ++k) {
      const size_t i = cell + k;
      const double left = knot(i + degree) - knot(i), right = knot(i + degree + 1) - knot(i + 1);
      const double a = left > 0 ? 1 / left : 0, b = right > 0 ? 1 / right : 0, p = static_cast<double>(degree);
      next[0][k] = (x - knot(i)) * a * now[0][k] + (knot(i + degree + 1) - x) * b * now[0][k + 1];
      for (size_t d = 1; d <= degree; ++d) next[d][k] = p * (a * now[d - 1][k] - b * now[d - 1][k + 1]);
    }
    now = next;
  }
  Alive out;
  out.first = static_cast<int>(cell);
  for (size_t d = 0; d < 4; ++d) std::copy_n(now[d].begin(), 4, out.of[d].begin());
  return out;
}

double Basis::greville(int i) const {
  const auto k = static_cast<size_t>(i);
  return (knots_[k + 1] + knots_[k + 2] + knots_[k + 3]) / kDegree;
}

Rule Basis::gauss(int inner, int rim) const {
  Rule rule;
  for (int c = 0; c < cells(); ++c) {
    const double from = breaks_[static_cast<size_t>(c)], half = (breaks_[static_cast<size_t>(c) + 1] - from) / 2;
    for (const GaussPoint& g : gauss_points(c == 0 || c == cells() - 1 ? rim : inner)) {
      rule.at.push_back(from + half * (1 + g.at));
      rule.weight.push_back(half * g.weight);
    }
  }
  return rule;
}

Eigen::MatrixXd products(const Basis& basis, int order) {
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(basis.count(), basis.count());
  const Rule rule = basis.gauss(4, 4);
  for (size_t q = 0; q < rule.at.size(); ++q) {
    const Alive alive = basis.at(rule.at[q]);
    const Eigen::Map<const Eigen::Vector4d> n(alive.of[static_cast<size_t>(order)].data());
    sum.block<4, 4>(alive.first, alive.first) += rule.weight[q] * n * n.transpose();
  }
  return sum;
}

Eigen::MatrixXd corrected_inverse_mass(const Basis& basis) {
  const Eigen::MatrixXd mass = products(basis, 0), one = Eigen::MatrixXd::Identity(mass.rows(), mass.cols());
  const Eigen::MatrixXd lumped = mass.rowwise().sum().cwiseInverse().asDiagonal();
  const Eigen::MatrixXd left = one - lumped * mass;
  return (one + left + left * left) * lumped;
}

}  // namespace selvedge::cloth::spline
