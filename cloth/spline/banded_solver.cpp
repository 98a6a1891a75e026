#include "cloth/spline/banded_solver.h"

#include <algorithm>

namespace selvedge::cloth::spline {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr int kBlock = 8, kSides = kernel::kBandedSides;

}  // namespace

BandedSolver::BandedSolver(const SplineSheet& sheet) : columns_(sheet.columns()), rows_(sheet.rows()) {
  const bool across = columns_ <= rows_;
  const int shorter = std::min(columns_, rows_), last = 3 * (3 * shorter + 3) + 2;
  blocks_ = (3 * sheet.count() + kBlock - 1) / kBlock;
  reach_ = std::min(blocks_ - 1, (last + kBlock - 1) / kBlock);
  for (int i = 0; i < sheet.count(); ++i) place_.push_back(across ? i : (i % columns_) * rows_ + i / columns_);
  block_.resize(static_cast<size_t>(blocks_) * static_cast<size_t>(reach_ + 1) * kBlock * kBlock);
  inverse_.resize(static_cast<size_t>(blocks_) * kBlock * kBlock);
}

double& BandedSolver::entry(int i, int j) {
  const auto block =
      static_cast<size_t>(j / kBlock) * static_cast<size_t>(reach_ + 1) + static_cast<size_t>(i / kBlock - j / kBlock);
  return block_[block * kBlock * kBlock + static_cast<size_t>(j % kBlock * kBlock + i % kBlock)];
}

kernel::BandedMatrix BandedSolver::matrix() const { return {blocks_, reach_, block_.data(), inverse_.data()}; }

bool BandedSolver::factorise(const Tangent& tangent, const Eigen::VectorXd& added, const std::vector<char>& is_held) {
  std::fill(block_.begin(), block_.end(), 0.0);
  const auto free = [&](int number) { return !is_held[static_cast<size_t>(number)]; };
  const int n = columns_, count = n * rows_;
  for (int i = 0; i < count; ++i) {
    for (int r = std::max(0, i / n - 3); r <= i / n; ++r)
      for (int c = std::max(0, i % n - 3); c <= std::min(n - 1, i % n + 3); ++c) {
        const int j = r * n + c;
        if (j > i) continue;
        const Eigen::Matrix3d& of = tangent.at(i, j);
        const int p = place_[static_cast<size_t>(i)], q = place_[static_cast<size_t>(j)];
        for (int a = 0; a < 3; ++a)
          for (int b = 0; b < 3; ++b) {
            if (p == q && b > a) continue;
            if (free(3 * i + a) && free(3 * j + b))
              (p >= q ? entry(3 * p + a, 3 * q + b) : entry(3 * q + b, 3 * p + a)) = of(a, b);
          }
      }
    for (int a = 0; a < 3; ++a) {
      const int p = 3 * place_[static_cast<size_t>(i)] + a;
      if (free(3 * i + a)) entry(p, p) += added(i);
      else entry(p, p) = 1;
    }
  }
  for (int p = 3 * count; p < kBlock * blocks_; ++p) entry(p, p) = 1;
  return kernel::banded_kernels().factor(matrix());
}

MatrixXd BandedSolver::solve(const MatrixXd& right) const {
  Aligned<double> sides(static_cast<size_t>(kBlock * blocks_ * kSides));
  const auto at = [&](Index row, Index side) -> double& {
    const auto p = static_cast<size_t>(3 * place_[static_cast<size_t>(row / 3)] + static_cast<int>(row % 3));
    return sides[p * kSides + static_cast<size_t>(side)];
  };
  MatrixXd out(right.rows(), right.cols());
  for (Index first = 0; first < right.cols(); first += kSides) {
    const Index count = std::min<Index>(kSides, right.cols() - first);
    std::fill(sides.begin(), sides.end(), 0.0);
    for (Index row = 0; row < right.rows(); ++row)
      for (Index s = 0; s < count; ++s) at(row, s) = right(row, first + s);
    kernel::banded_kernels().solve(matrix(), sides.data());
    for (Index row = 0; row < right.rows(); ++row)
      for (Index s = 0; s < count; ++s) out(row, first + s) = at(row, s);
  }
  return out;
}

}  // namespace selvedge::cloth::spline
