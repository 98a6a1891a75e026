// The evidence against brute force: the same model as one large normal distribution.
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "diagnose/base_fit.h"
#include "diagnose/evidence.h"
#include "diagnose/study.h"
#include "diagnose/window_errors.h"
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

// Every third row of a window is of one frame.
ModelError drawn_error(Index rows) {
  ModelError error;
  error.forces = MatrixXd::Random(rows, 4);
  error.white_mm = VectorXd::Constant(rows, 0.2);
  error.noise_mm = VectorXd::Constant(rows, 0.3);
  error.lasting = MatrixXd::Random(rows, 2);
  error.scales = {0.5, 2};
  error.frames.shapes = MatrixXd::Random(rows, 2);
  for (Index i = 0; i < rows; ++i) error.frames.frame.push_back(static_cast<int>(i % 3));
  return error;
}

// Every second window errs three times as much.
std::vector<WindowFactors> drawn_factors(const ModelError& error, size_t windows) {
  WindowFactors out{std::vector<double>(windows, 1), std::vector<double>(windows, 0)};
  for (size_t w = 1; w < windows; w += 2) out.factor[w] = 3;
  return std::vector<WindowFactors>(error.scales.size(), out);
}

MatrixXd covariance_of(const ModelError& error, const Windows& windows, size_t scale) {
  MatrixXd sigma = error.lasting * error.lasting.transpose();
  sigma.diagonal().array() += 0.3 * 0.3;
  for (size_t k = 0; k < windows.windows().size(); ++k) {
    const Window& w = windows.windows()[k];
    const double s = error.scales[scale] * error.windows[scale].factor[k];
    const MatrixXd d = s * error.forces.middleRows(w.first, w.count);
    auto block = sigma.block(w.first, w.first, w.count, w.count);
    block += d * d.transpose();
    block.diagonal().array() += s * s * 0.2 * 0.2;
    for (Index i = w.first; i < w.first + w.count; ++i)
      for (Index j = w.first; j < w.first + w.count; ++j)
        if (i % 3 == j % 3) sigma(i, j) += error.frames.shapes.row(i).dot(error.frames.shapes.row(j));
  }
  return sigma;
}

// ln p of these rows, where r = −X d + …: its mean is −X m.
double log_p(MatrixXd sigma, const MatrixXd& columns, const VectorXd& residual, const std::vector<Prior>& priors,
             const std::vector<Index>& rows) {
  VectorXd off = residual;
  for (Index c = 0; c < columns.cols(); ++c) {
    const Prior& p = priors[static_cast<size_t>(c)];
    sigma += p.sd * p.sd * columns.col(c) * columns.col(c).transpose();
    off += p.mean * columns.col(c);
  }
  const Eigen::LLT<MatrixXd> factor(MatrixXd(sigma(rows, rows)));
  const VectorXd these = off(rows);
  return -0.5 * these.dot(factor.solve(these)) - factor.matrixLLT().diagonal().array().log().sum();
}

TEST_F(EvidenceOfWindows, IsThatOfOneLargeNormalDistribution) {
  std::srand(3);
  ModelError error = drawn_error(windows_->rows());
  error.windows = drawn_factors(error, windows_->windows().size());
  const Evidence evidence(*windows_, error);
  const MatrixXd columns = MatrixXd::Random(windows_->rows(), 3);
  const VectorXd residual = VectorXd::Random(windows_->rows());
  const std::vector<Prior> priors = {{0.1, 0.5, -1e300, 1e300}, {-0.2, 2, -1e300, 1e300}, {0, 1, -1e300, 1e300}};
  const size_t left_out = windows_->windows().front().trial;
  std::vector<Index> all, others;
  for (Index i = 0; i < windows_->rows(); ++i) {
    all.push_back(i);
    if (windows_->trial(i) != left_out) others.push_back(i);
  }
  ASSERT_FALSE(others.empty());
  for (size_t k = 0; k < 2; ++k) {
    const MatrixXd sigma = covariance_of(error, *windows_, k);
    const auto expect = [&](const Gram& gram, const std::vector<Index>& rows) {
      const double truly = log_p(sigma, columns, residual, priors, rows);
      EXPECT_NEAR(posterior(gram, priors).log_evidence, truly, 1e-6 * std::abs(truly));
    };
    expect(evidence.gram(columns, residual, k), all);
    expect(evidence.grams_without({{left_out}}, columns, residual, k).front(), others);
  }
}

// Residuals of a model whose window 1 errs five times as much as the others.
TEST_F(EvidenceOfWindows, AWindowThatErrsMoreCountsLess) {
  std::srand(11);
  const Index rows = windows_->rows();
  const Protocol protocol;
  ModelError error;
  error.forces = 2 * MatrixXd::Random(rows, 4);
  error.white_mm = VectorXd::Constant(rows, 0.5);
  error.noise_mm = VectorXd::Constant(rows, 0.1);
  error.scales = {0.5, 0.5 * protocol.scale_ratio, 1, protocol.scale_ratio};
  Linearisation about;
  about.x = study_->base;
  about.columns.resize(3);
  for (Column& c : about.columns) c.is_base = true;
  about.changes = MatrixXd::Random(rows, 3);
  about.residual.resize(rows);
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  const Eigen::Vector3d truly(0.8, -0.5, 0.3);
  for (size_t k = 0; k < windows_->windows().size(); ++k) {
    const Window& w = windows_->windows()[k];
    const double s = k == 1 ? 5 : 1;
    VectorXd forces(4);
    for (double& f : forces) f = s * normal(random);
    auto of = about.residual.segment(w.first, w.count);
    of = error.forces.middleRows(w.first, w.count) * forces - about.changes.middleRows(w.first, w.count) * truly;
    for (double& r : of) r += std::hypot(0.5 * s, 0.1) * normal(random);
  }
  const ModelError found = by_windows(*study_, *windows_, about, error);
  ASSERT_EQ(found.windows.size(), error.scales.size());
  double others = 0;
  for (size_t k = 0; k < windows_->windows().size(); ++k)
    if (k != 1) others += std::log(found.windows[2].factor[k]) / static_cast<double>(windows_->windows().size() - 1);
  EXPECT_NEAR(others, 0, 0.2);
  EXPECT_GT(found.windows[2].factor[1], 2.5);
  EXPECT_LT(found.windows[2].factor[1], 8);
  const std::vector<Prior> priors(3);
  const Posterior same = posterior(Evidence(*windows_, error).gram(about.changes, about.residual, 2), priors),
                  each = posterior(Evidence(*windows_, found).gram(about.changes, about.residual, 2), priors);
  EXPECT_GT(each.log_evidence, same.log_evidence + 10);
  for (Index i = 0; i < 3; ++i) EXPECT_NEAR(each.mean(i), truly(i), 4 * each.sd(i)) << i;
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
