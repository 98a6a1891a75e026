#include "diagnose/evidence.h"

#include <algorithm>
#include <cmath>

#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>

namespace selvedge::diagnose {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

double normal_cdf(double x) { return 0.5 * std::erfc(-x / std::sqrt(2.0)); }

// Woodbury: Σ = diag(v) + s² D Dᵀ.
struct Woodbury {
  VectorXd inverse_variance;
  MatrixXd scaled;  // s D
  Eigen::LLT<MatrixXd> inner;
  double log_determinant = 0;

  Woodbury(const VectorXd& variance, const MatrixXd& forces, double s)
      : inverse_variance(variance.cwiseInverse()), scaled(s * forces) {
    const Index n = scaled.cols();
    inner.compute(MatrixXd::Identity(n, n) + scaled.transpose() * inverse_variance.asDiagonal() * scaled);
    log_determinant = variance.array().log().sum() + 2 * inner.matrixLLT().diagonal().array().log().sum();
  }
  MatrixXd solve(const MatrixXd& y) const {
    const MatrixXd first = inverse_variance.asDiagonal() * y;
    return first - inverse_variance.asDiagonal() * (scaled * inner.solve(scaled.transpose() * first));
  }
};

}  // namespace

ModelError model_error(const Protocol& protocol, const Windows& windows, const MatrixXd& forces, const VectorXd& grid) {
  ModelError error;
  error.forces.resize(forces.rows(), forces.cols() + 1);
  error.forces << forces, protocol.grid_share * grid;
  error.white_mm = protocol.white_share * forces.rowwise().norm();
  error.noise_mm = windows.noise_mm();
  for (long k = 0; k < protocol.scales; ++k)
    error.scales.push_back(protocol.least_scale * std::pow(protocol.scale_ratio, static_cast<double>(k)));
  return error;
}

Evidence::Evidence(const Windows& windows, ModelError error) : windows_(windows), error_(std::move(error)) {}

VectorXd Evidence::variance(const Window& w, double s) const {
  return error_.noise_mm.segment(w.first, w.count).array().square() +
         s * s * error_.white_mm.segment(w.first, w.count).array().square();
}

Gram Evidence::gram(const MatrixXd& columns, const VectorXd& residual, size_t scale,
                    const std::vector<size_t>& trials) const {
  MatrixXd all(columns.rows(), columns.cols() + 1);
  all << columns, residual;
  Gram out;
  out.of = MatrixXd::Zero(all.cols(), all.cols());
  const double s = error_.scales[scale];
  for (const Window& w : windows_.windows()) {
    if (!trials.empty() && std::find(trials.begin(), trials.end(), w.trial) == trials.end()) continue;
    const Woodbury sigma(variance(w, s), error_.forces.middleRows(w.first, w.count), s);
    const MatrixXd rows = all.middleRows(w.first, w.count);
    out.of += rows.transpose() * sigma.solve(rows);
    out.log_determinant += sigma.log_determinant;
  }
  return out;
}

std::vector<Gram> Evidence::grams(const MatrixXd& columns, const VectorXd& residual) const {
  std::vector<Gram> out(scales());
  tbb::parallel_for(size_t{0}, scales(), [&](size_t k) { out[k] = gram(columns, residual, k); });
  return out;
}

Evidence::Forces Evidence::forces_in(size_t window, const VectorXd& left, size_t scale) const {
  const Window& w = windows_.windows()[window];
  const double s = error_.scales[scale];
  const Woodbury sigma(variance(w, s), error_.forces.middleRows(w.first, w.count), s);
  return {sigma.inner.solve(sigma.scaled.transpose() * sigma.inverse_variance.cwiseProduct(left)),
          sigma.inner.solve(MatrixXd::Identity(sigma.scaled.cols(), sigma.scaled.cols()))};
}

Posterior posterior(const Gram& gram, const std::vector<Prior>& priors) {
  const auto n = static_cast<Index>(priors.size()), r = n;  // the residual stands behind the columns
  const MatrixXd of = gram.of.topLeftCorner(n, n);
  const VectorXd with_r = gram.of.col(r).head(n);
  VectorXd sd(n), m(n);
  for (Index i = 0; i < n; ++i) {
    sd(i) = priors[static_cast<size_t>(i)].sd;
    m(i) = priors[static_cast<size_t>(i)].mean;
  }
  MatrixXd scaled = sd.asDiagonal() * of * sd.asDiagonal();  // Λ^½ A Λ^½
  scaled.diagonal().array() += 1;
  const Eigen::LLT<MatrixXd> factor(scaled);
  Posterior out;
  const VectorXd b = m.cwiseQuotient(sd) - sd.cwiseProduct(with_r);
  out.mean = sd.cwiseProduct(factor.solve(b));
  const double log_a = 2 * factor.matrixLLT().diagonal().array().log().sum();
  out.log_evidence = -0.5 * (gram.of(r, r) + m.cwiseQuotient(sd).squaredNorm() - b.dot(out.mean.cwiseQuotient(sd)) +
                             gram.log_determinant + log_a);
  out.scaled = factor;
  out.prior_sd = sd;
  for (Index i = 0; i < n; ++i) {
    const Prior& p = priors[static_cast<size_t>(i)];
    if (p.lower < -1e299 && p.upper > 1e299) continue;
    const auto inside = [&](double mean, double s) {
      return std::max(1e-30, normal_cdf((p.upper - mean) / s) - normal_cdf((p.lower - mean) / s));
    };
    out.log_evidence += std::log(inside(out.mean(i), out.sd(i))) - std::log(inside(p.mean, p.sd));
  }
  return out;
}

double Posterior::sd(Index i) const {
  VectorXd one = VectorXd::Zero(prior_sd.size());
  one(i) = 1;
  scaled.matrixL().solveInPlace(one);
  return prior_sd(i) * one.norm();
}

double log_sum(const std::vector<double>& logs) {
  const double most = *std::max_element(logs.begin(), logs.end());
  double sum = 0;
  for (const double l : logs) sum += std::exp(l - most);
  return most + std::log(sum);
}

}  // namespace selvedge::diagnose
