// The evidence against brute force: the same model as one large normal distribution.
#include <cmath>

#include <gtest/gtest.h>

#include "diagnose/base_fit.h"
#include "diagnose/evidence.h"
#include "diagnose/study.h"
#include "tests/diagnose/simulated_campaign.h"

namespace selvedge::diagnose {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

class EvidenceOfWindows : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    const SimulatedSwatch swatch = usual_fabric();
    StudyOptions options;
    options.protocol.cells = 6;
    options.protocol.rate_hz = 8;
    options.base_fit = BaseFit{base_of(swatch, swatch.material.stretch, swatch.material.shear), 0, {}};
    study_ = std::make_unique<Study>(std::move(make_study(simulated_campaign(swatch), {}, options).study));
    windows_ = std::make_unique<Windows>(*study_->simulation, study_->protocol);
  }
  static void TearDownTestSuite() {
    windows_.reset();
    study_.reset();
  }
  static inline std::unique_ptr<Study> study_;
  static inline std::unique_ptr<Windows> windows_;
};

TEST_F(EvidenceOfWindows, EverySampleOfAMarkerIsInOneWindow) {
  Index rows = 0;
  for (const Window& w : windows_->windows()) {
    EXPECT_EQ(w.first, rows);
    rows += w.count;
    EXPECT_LE(w.to_s - w.from_s, study_->protocol.free_s + 1e-9);
  }
  EXPECT_EQ(rows, windows_->rows());
  Index samples = 0;
  for (size_t t = 0; t < study_->simulation->trials().size(); ++t) samples += study_->simulation->time_s(t).size();
  EXPECT_EQ(rows, samples);
}

TEST_F(EvidenceOfWindows, TheBaseThatMadeTheTrialsLeavesTheNoise) {
  const VectorXd r = windows_->residuals(*study_->simulation, study_->state, study_->parameters, study_->base).col(0);
  ASSERT_TRUE(r.allFinite());
  // It was made on nine cells and is simulated on six.
  EXPECT_LT(std::sqrt(r.squaredNorm() / static_cast<double>(r.size())), 1.2);
}

TEST_F(EvidenceOfWindows, IsThatOfOneLargeNormalDistribution) {
  std::srand(3);
  const Index rows = windows_->rows();
  ModelError error;
  error.forces = MatrixXd::Random(rows, 4);
  error.white_mm = VectorXd::Constant(rows, 0.2);
  error.noise_mm = VectorXd::Constant(rows, 0.3);
  error.scales = {0.5, 2};
  // Every third row of a window is of one frame.
  error.frames.shapes = MatrixXd::Random(rows, 2);
  for (Index i = 0; i < rows; ++i) error.frames.frame.push_back(static_cast<int>(i % 3));
  const Evidence evidence(*windows_, error);
  const MatrixXd columns = MatrixXd::Random(rows, 3);
  const VectorXd residual = VectorXd::Random(rows);
  const std::vector<Prior> priors = {{0.1, 0.5, -1e300, 1e300}, {-0.2, 2, -1e300, 1e300}, {0, 1, -1e300, 1e300}};
  for (size_t k = 0; k < 2; ++k) {
    const double s = error.scales[k];
    MatrixXd sigma = MatrixXd::Zero(rows, rows);
    for (const Window& w : windows_->windows()) {
      const MatrixXd d = s * error.forces.middleRows(w.first, w.count);
      sigma.block(w.first, w.first, w.count, w.count) = d * d.transpose();
      for (Index i = w.first; i < w.first + w.count; ++i)
        for (Index j = w.first; j < w.first + w.count; ++j)
          if (i % 3 == j % 3) sigma(i, j) += error.frames.shapes.row(i).dot(error.frames.shapes.row(j));
    }
    sigma.diagonal().array() += 0.3 * 0.3 + s * s * 0.2 * 0.2;
    // r = −X d + …: its mean is −X m.
    VectorXd mean = VectorXd::Zero(rows);
    for (Index c = 0; c < 3; ++c) {
      const Prior& p = priors[static_cast<size_t>(c)];
      sigma += p.sd * p.sd * columns.col(c) * columns.col(c).transpose();
      mean -= p.mean * columns.col(c);
    }
    const Eigen::LLT<MatrixXd> factor(sigma);
    const VectorXd off = residual - mean;
    const double log_p = -0.5 * off.dot(factor.solve(off)) - factor.matrixLLT().diagonal().array().log().sum();
    const Posterior p = posterior(evidence.gram(columns, residual, k), priors);
    EXPECT_NEAR(p.log_evidence, log_p, 1e-6 * std::abs(log_p));
  }
}

TEST_F(EvidenceOfWindows, ForcesThatMadeWhatIsLeftAreFound) {
  std::srand(5);
  const Index rows = windows_->rows();
  ModelError error;
  error.forces = 3 * MatrixXd::Random(rows, 4);
  error.white_mm = VectorXd::Constant(rows, 0.01);
  error.noise_mm = VectorXd::Constant(rows, 0.05);
  error.scales = {1};
  const Evidence evidence(*windows_, error);
  const Window& w = windows_->windows()[1];
  const Eigen::Vector4d truly(0.5, -1, 0.2, 1.5);
  const Evidence::Forces found = evidence.forces_in(1, error.forces.middleRows(w.first, w.count) * truly, 0);
  for (Index i = 0; i < 4; ++i) EXPECT_NEAR(found.mean(i), truly(i), 4 * std::sqrt(found.covariance(i, i)) + 1e-6);
}

}  // namespace
}  // namespace selvedge::diagnose
