#include "diagnose/window_errors.h"

#include <cmath>

#include <tbb/parallel_for.h>

namespace selvedge::diagnose {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int kRounds = 4;
constexpr int kSteps = 6;  // of λ to each side, each Protocol::scale_ratio

// What each window says of all columns, at each size of its model error.
class WindowGrams {
 public:
  // error: without what lasts, which is among the columns.
  WindowGrams(const Windows& windows, const ModelError& error, double ratio, const MatrixXd& columns,
              const VectorXd& residual)
      : grams_(windows.windows().size()) {
    const Evidence evidence(windows, error);
    const size_t sizes = error.scales.size() + 2 * kSteps;
    tbb::parallel_for(size_t{0}, grams_.size(), [&](size_t w) {
      for (size_t k = 0; k < sizes; ++k) {
        const double s = error.scales.front() * std::pow(ratio, static_cast<double>(k) - kSteps);
        grams_[w].push_back(evidence.of_window(w, columns, residual, s));
      }
    });
  }

  size_t windows() const { return grams_.size(); }
  // Where s is that of this scale, and λ so many steps from 1.
  const Gram& at(size_t window, size_t scale, int steps) const {
    return grams_[window][static_cast<size_t>(static_cast<int>(scale) + kSteps + steps)];
  }

 private:
  std::vector<std::vector<Gram>> grams_;
};

// E [d 1]ᵀ [d 1].
MatrixXd second_moment(const Posterior& p) {
  const Index n = p.mean.size();
  VectorXd mean(n + 1);
  mean << p.mean, 1;
  MatrixXd out = mean * mean.transpose();
  out.topLeftCorner(n, n) += p.covariance();
  return out;
}

// own: whether a window may have a λ of its own.
WindowFactors likeliest(const Protocol& protocol, const WindowGrams& grams, const std::vector<Prior>& priors,
                        const std::vector<char>& own, size_t scale) {
  const double step = std::log(protocol.scale_ratio);
  const auto log_p = [&](int steps) { return -0.5 * std::pow(steps * step / protocol.window_sd, 2); };
  std::vector<int> steps(grams.windows(), 0);
  for (int round = 0; round < kRounds; ++round) {
    Gram all = grams.at(0, scale, steps[0]);
    for (size_t w = 1; w < steps.size(); ++w) all += grams.at(w, scale, steps[w]);
    const MatrixXd moment = second_moment(posterior(all, priors));
    for (size_t w = 0; w < steps.size(); ++w) {
      if (!own[w]) continue;
      double most = -1e300;
      for (int k = -kSteps; k <= kSteps; ++k) {
        const Gram& gram = grams.at(w, scale, k);
        const double here = log_p(k) - 0.5 * (gram.of.cwiseProduct(moment).sum() + gram.log_determinant);
        if (here <= most) continue;
        most = here;
        steps[w] = k;
      }
    }
  }
  WindowFactors out;
  for (const int k : steps) {
    out.factor.push_back(std::exp(k * step));
    out.log_p.push_back(log_p(k));
  }
  return out;
}

}  // namespace

ModelError by_windows(const Study& study, const Windows& windows, const Linearisation& about, ModelError error) {
  if (!has_markers(study.simulation->trials())) return error;
  const Index of_model = about.changes.cols(), lasting = error.lasting.cols();
  MatrixXd columns(about.changes.rows(), of_model + lasting);
  columns.leftCols(of_model) = about.changes;
  if (lasting > 0) columns.rightCols(lasting) = error.lasting;
  ModelError alone = error;
  alone.lasting.resize(columns.rows(), 0);
  const WindowGrams grams(windows, alone, study.protocol.scale_ratio, columns, about.residual);
  error.windows.resize(error.scales.size());
  std::vector<char> of_points;
  for (const Window& w : windows.windows()) of_points.push_back(study.simulation->trials()[w.trial].markers ? 1 : 0);
  tbb::parallel_for(size_t{0}, error.scales.size(), [&](size_t k) {
    std::vector<Prior> priors;
    for (const Column& c : about.columns) priors.push_back(prior_of(study, c, about.x, Size::free, error.scales[k]));
    priors.resize(static_cast<size_t>(columns.cols()), {0, 1, -1e300, 1e300});
    error.windows[k] = likeliest(study.protocol, grams, priors, of_points, k);
  });
  return error;
}

}  // namespace selvedge::diagnose
