// The campaign under the base model.
#include <gtest/gtest.h>

#include "diagnose/base_fit.h"
#include "tests/diagnose/simulated_campaign.h"

namespace selvedge::diagnose {
namespace {

// Two shapes in which a swatch may hang, mirrored: a fit that comes to other parameters may leave the fine mesh in the
// one that was not recorded.
TEST(Study, AFineMeshThatFellIntoTheOtherFoldComesBackToTheRecordedOne) {
  const SimulatedSwatch swatch = usual_fabric();
  StudyOptions options;
  options.protocol.cells = 6;
  options.protocol.rate_hz = 20;
  options.base_fit = BaseFit{base_of(swatch, swatch.material.stretch, swatch.material.shear), 0, {}, {}};
  Study study = std::move(make_study(simulated_campaign(swatch), {}, options).study);
  const Eigen::VectorXd before = study.mesh_change[0];  // of what hangs still
  ASSERT_GT(before.norm(), 0);
  std::vector<Eigen::Matrix3Xd> mirrored;
  for (const Eigen::Matrix3Xd& shape : study.fine_state.branch) {
    mirrored.push_back(shape);
    mirrored.back().row(1) = 2 * shape(1, 0) - mirrored.back().row(1).array();
  }
  study.fine_state.branch = mirrored;
  correct_mesh(study);
  EXPECT_LT((study.mesh_change[0] - before).norm(), 0.1 * before.norm());
}

}  // namespace
}  // namespace selvedge::diagnose
