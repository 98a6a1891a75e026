// Louchet's identification: costs at the reference, coordinates, and the sheet recovered from its last frame.
#include <gtest/gtest.h>

#include "experiments/spring_identification.h"

namespace selvedge::experiments {
namespace {

ProvotScene heavy_scene() {
  ProvotScene scene;
  scene.mass_kg = 0.015;
  scene.damping_kg_s = 0.02;
  return scene;
}

TEST(SpringIdentification, ReferenceCostsNothingAndAnythingElseSomething) {
  const SpringRecording recording = record_springs(heavy_scene(), {}, 5, 30);
  const ProvotSheet sheet(recording.scene);
  EXPECT_GT(share_at_critical(recording, {}), 0.1);
  for (const SpringCost cost : {SpringCost::every_frame, SpringCost::last_frame}) {
    EXPECT_EQ(spring_cost(recording, sheet, {}, cost), 0);
    for (int k = 0; k < 5; ++k) {
      Eigen::VectorXd x = to_coordinates({}, SpringCoordinates::lengths);
      x(k) *= 1.02;
      EXPECT_GT(spring_cost(recording, sheet, to_fabric(x, SpringCoordinates::lengths), cost), 1e-9) << k;
    }
  }
  EXPECT_GT(spring_cost(recording, sheet, {0.09, 0.13, 0.18, 3, 0.4}, SpringCost::every_frame),
            spring_cost(recording, sheet, {0.09, 0.13, 0.18, 3, 0.4}, SpringCost::last_frame));
}

TEST(SpringIdentification, CoordinatesGoThereAndBack) {
  const IsotropicFabric fabric{0.08, 0.12, 0.17, 2.5, 0.3};
  for (const SpringCoordinates c : {SpringCoordinates::lengths, SpringCoordinates::longest}) {
    const Eigen::VectorXd back = to_coordinates(to_fabric(to_coordinates(fabric, c), c), SpringCoordinates::lengths);
    EXPECT_LT((back - to_coordinates(fabric, SpringCoordinates::lengths)).norm(), 1e-12);
  }
}

TEST(SpringIdentification, OursRecoversTheSheetFromItsLastFrame) {
  const SpringRecording recording = record_springs(heavy_scene(), {}, 1, 200);
  const Eigen::VectorXd truth = to_coordinates({}, SpringCoordinates::lengths);
  for (unsigned seed = 1; seed <= 2; ++seed) {
    const estimate::SearchProblem problem =
        spring_problem(recording, SpringCost::last_frame, SpringCoordinates::longest);
    estimate::EvolutionOptions options =
        spring_evolution(recording, SpringCost::last_frame, SpringCoordinates::longest);
    options.variant = estimate::EvolutionOptions::Variant::ours;
    estimate::SearchLimits limits;
    limits.seed = seed;
    limits.evaluations = 30000;
    limits.stop_cost = 1e-9;
    const estimate::SearchResult found = estimate::evolve(problem, limits, options);
    const Eigen::VectorXd x =
        to_coordinates(to_fabric(found.point, SpringCoordinates::longest), SpringCoordinates::lengths);
    EXPECT_LT(((x - truth).cwiseQuotient(truth)).cwiseAbs().maxCoeff(), 0.01) << x.transpose();
    EXPECT_EQ(found.ended, "cost reached");
  }
}

}  // namespace
}  // namespace selvedge::experiments
