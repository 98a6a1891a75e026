#include "material_tests/ring_matrix.h"

#include <Eigen/Cholesky>

namespace selvedge::material_tests {

using Eigen::MatrixXd;
using Eigen::VectorXd;

RingMatrix::RingMatrix(int blocks, int size)
    : size_(size), diagonal_(static_cast<size_t>(blocks), MatrixXd::Zero(size, size)), after_(diagonal_),
      lower_(diagonal_), below_(diagonal_), last_(diagonal_) {}

void RingMatrix::set_zero() {
  for (auto* all : {&diagonal_, &after_})
    for (MatrixXd& block : *all) block.setZero();
}

bool RingMatrix::factorise(const VectorXd& added) {
  const size_t end = diagonal_.size() - 1;
  const auto with_added = [&](size_t i) {
    MatrixXd block = diagonal_[i];
    block.diagonal() += added.segment(static_cast<Eigen::Index>(i) * size_, size_);
    return block;
  };
  MatrixXd corner = with_added(end), next = with_added(0), reach = after_[end].transpose();
  for (size_t i = 0; i < end; ++i) {
    const Eigen::LLT<MatrixXd> factor(next);
    if (factor.info() != Eigen::Success) return false;
    lower_[i] = factor.matrixL();
    const auto l = lower_[i].triangularView<Eigen::Lower>();
    if (i + 1 == end) reach += after_[i];
    last_[i] = l.solve(reach.transpose()).transpose();
    corner.noalias() -= last_[i] * last_[i].transpose();
    if (i + 1 == end) break;
    below_[i] = l.solve(after_[i].transpose()).transpose();
    next = with_added(i + 1);
    next.noalias() -= below_[i] * below_[i].transpose();
    reach.noalias() = -last_[i] * below_[i].transpose();
  }
  const Eigen::LLT<MatrixXd> factor(corner);
  lower_[end] = factor.matrixL();
  return factor.info() == Eigen::Success;
}

VectorXd RingMatrix::solve(VectorXd x) const {
  const size_t end = lower_.size() - 1;
  const auto part = [&](size_t i) { return x.segment(static_cast<Eigen::Index>(i) * size_, size_); };
  for (size_t i = 0; i < end; ++i) {
    lower_[i].triangularView<Eigen::Lower>().solveInPlace(part(i));
    if (i + 1 < end) part(i + 1) -= below_[i] * part(i);
    part(end) -= last_[i] * part(i);
  }
  lower_[end].triangularView<Eigen::Lower>().solveInPlace(part(end));
  lower_[end].transpose().triangularView<Eigen::Upper>().solveInPlace(part(end));
  for (size_t i = end; i-- > 0;) {
    part(i) -= last_[i].transpose() * part(end);
    if (i + 1 < end) part(i) -= below_[i].transpose() * part(i + 1);
    lower_[i].transpose().triangularView<Eigen::Upper>().solveInPlace(part(i));
  }
  return x;
}

}  // namespace selvedge::material_tests
