#include "cloth/branches.h"

#include <algorithm>
#include <limits>

#include <gtest/gtest.h>

#include "cli/proofs/cloth_cases.h"
#include "cloth/surface_point.h"

namespace selvedge::cloth {
namespace {

struct Drape {
  Sheet sheet = make_sheet(geometry::make_grid_mesh(0.3, 0.3, 11, 11));
  Experiment experiment = cli::waving_experiment(0, 1);
  std::vector<Branch> branches;
  Drape() {
    BranchOptions options;
    options.starts = 12;
    branches = find_branches(sheet, experiment, options);
  }
};

const Drape& drape() {
  static const Drape d;
  return d;
}

Eigen::Matrix3Xd mirrored(Eigen::Matrix3Xd x) {
  x.row(1) *= -1;
  return x;
}

double rms_m(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b) {
  return std::sqrt((a - b).colwise().squaredNorm().mean());
}

TEST(Branches, ComeInMirrorImagesOfOneEnergy) {
  const std::vector<Branch>& branches = drape().branches;
  ASSERT_GE(branches.size(), 2u);
  for (size_t i = 1; i < branches.size(); ++i) EXPECT_LE(branches[i - 1].potential_j, branches[i].potential_j);
  for (const Branch& b : branches) {
    const auto image = std::find_if(branches.begin(), branches.end(),
                                    [&](const Branch& c) { return rms_m(c.position, mirrored(b.position)) < 1e-3; });
    ASSERT_NE(image, branches.end());
    EXPECT_GT(rms_m(image->position, b.position), 0.01);
    EXPECT_NEAR(image->potential_j, b.potential_j, 1e-6);
  }
}

TEST(Branches, AreAtRest) {
  for (const Branch& branch : drape().branches) {
    Experiment e = drape().experiment;
    e.start_shape = branch.position;
    e.starts_at_rest = false;
    e.sample_s = {0.3};
    e.path = make_path(Hold::corners, {0.0}, e.path.left.leftCols(1), e.path.right.leftCols(1));
    const Eigen::Matrix3Xd later = simulate(drape().sheet, {e})[0].samples.back();
    EXPECT_LT((later - branch.position).colwise().norm().maxCoeff(), 5e-5);
  }
}

TEST(Branches, TheOneSeenIsTaken) {
  const std::vector<Eigen::Vector2d> uv = {{0.1, 0.1}, {0.2, 0.15}, {0.15, 0.25}, {0.05, 0.2}};
  for (size_t b = 0; b < 2; ++b) {
    Eigen::Matrix3Xd seen(3, 4);
    for (Eigen::Index k = 0; k < 4; ++k) {
      seen.col(k) =
          position_of(surface_point(drape().sheet, uv[static_cast<size_t>(k)]), drape().branches[b].position) +
          Eigen::Vector3d::Constant(1e-3);
    }
    seen.col(3).setConstant(std::numeric_limits<double>::quiet_NaN());
    const SeenBranch taken = branch_seen(drape().sheet, drape().branches, uv, seen);
    EXPECT_EQ(taken.index, b);
    EXPECT_NEAR(taken.distance_m, std::sqrt(3.0) * 1e-3, 1e-9);
  }
  EXPECT_THROW(branch_seen(drape().sheet, {}, uv, Eigen::Matrix3Xd::Zero(3, 4)), std::invalid_argument);
}

}  // namespace
}  // namespace selvedge::cloth
