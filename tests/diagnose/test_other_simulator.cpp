// What another simulator lacks, told by our sheet: a sheet without drag, and the very sheet that made the recording.
#include <cmath>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "diagnose/diagnosis_report.h"
#include "diagnose/simulator_report.h"
#include "tests/diagnose/simulated_campaign.h"

namespace selvedge::diagnose {
namespace {

// The fabric of the recording, with so much of its drag and damping.
class SheetOf : public model::Simulator {
 public:
  SheetOf(const SimulatedSwatch& swatch, double drag, double damping) : material_(swatch.material) {
    for (double* d : {&material_.drag_normal, &material_.drag_tangent}) *d *= drag;
    for (double* d : {&material_.stretch_damping, &material_.shear_damping, &material_.bend_damping}) *d *= damping;
  }
  std::string name() const override { return "another sheet"; }
  std::string identity() const override { return "another sheet, of a test"; }
  std::vector<model::Parameter> parameters() const override {
    model::Parameter unused;
    unused.name = "unused";
    unused.start = unused.lower = 1;
    unused.upper = 2;
    unused.apply = [](model::Prediction&, double) {};
    return {unused};
  }
  bool begins_at_shapes() const override { return true; }
  std::vector<cloth::Trajectory> simulate(const cloth::spline::SplineSheet& sheet,
                                          const std::vector<cloth::Experiment>& lanes) const override {
    std::vector<cloth::Experiment> own = lanes;
    for (cloth::Experiment& e : own) {
      const double density = e.material.density;
      e.material = material_;
      e.material.density = density;
    }
    return cloth::spline::simulate(sheet, own);
  }
  std::string last_divergence() const override { return ""; }

 private:
  cloth::Material material_;
};

SimulatorGap gap_of(double drag, double damping) {
  const SimulatedSwatch fabric = usual_fabric();
  DiagnosisOptions options;
  options.study.protocol.cells = 9;
  options.study.fitted = base_of(fabric, fabric.material.stretch, fabric.material.shear);
  options.other = FittedSimulator{std::make_shared<SheetOf>(fabric, drag, damping), Eigen::VectorXd::Zero(1)};
  trial::Campaign campaign = simulated_campaign(fabric);
  campaign.trials.pop_back();
  const Diagnosis d = diagnose(campaign, {}, options);
  EXPECT_EQ(d.cause, "none");
  EXPECT_EQ(to_json(d).at("simulator").at("name"), "another sheet");
  EXPECT_FALSE(d.other.diverged);
  EXPECT_EQ(lines_of(d.other).size(), 2u) << d.other.imitated_mm << " mm beside " << d.other.before_mm;
  return d.other;
}

TEST(OtherSimulator, WithoutDragLacksDrag) {
  const SimulatorGap gap = gap_of(0.05, 1);
  ASSERT_FALSE(gap.parts.empty());
  EXPECT_EQ(gap.parts[0].name, "no drag");
  EXPECT_GT(gap.parts[0].share.value, 0.7);
  EXPECT_LT(gap.parts[0].alone_mm, 0.5 * gap.before_mm);
  EXPECT_GT(gap.before_mm, 2 * gap.after_mm);
  EXPECT_LT(gap.imitated_mm, gap.after_mm);
}

TEST(OtherSimulator, DampedNumericallyIsToldSo) {
  const SimulatorGap gap = gap_of(1, 10);
  ASSERT_GT(gap.parts.size(), 1u);
  EXPECT_EQ(gap.parts[1].name, "numerical damping");
  EXPECT_GT(gap.parts[1].share.value, 0.7);
}

TEST(OtherSimulator, ThatIsTheFabricItselfLacksNothing) {
  const SimulatorGap gap = gap_of(1, 1);
  EXPECT_LT(gap.before_mm, 1.2 * gap.after_mm);
}

}  // namespace
}  // namespace selvedge::diagnose
