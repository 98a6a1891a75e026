// A symmetric matrix whose blocks lie in a ring: each couples to itself and to the block before and after it.
#pragma once

#include <vector>

#include <Eigen/Core>

namespace selvedge::material_tests {

class RingMatrix {
 public:
  // At least three blocks of `size` rows each.
  RingMatrix(int blocks, int size);

  Eigen::Index rows() const { return Eigen::Index(diagonal_.size()) * size_; }
  void set_zero();
  Eigen::MatrixXd& diagonal(size_t block) { return diagonal_[block]; }
  // Rows of the block after (the first one after the last), columns of this one.
  Eigen::MatrixXd& after(size_t block) { return after_[block]; }

  // Cholesky's factorisation of this + diag(added); false: it is not positive definite.
  bool factorise(const Eigen::VectorXd& added);
  Eigen::VectorXd solve(Eigen::VectorXd right) const;

 private:
  Eigen::Index size_;
  std::vector<Eigen::MatrixXd> diagonal_, after_;
  std::vector<Eigen::MatrixXd> lower_, below_, last_;  // of the factor: diagonal, row after, row of the last block
};

}  // namespace selvedge::material_tests
