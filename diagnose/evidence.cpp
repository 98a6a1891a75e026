#include "diagnose/evidence.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>

namespace selvedge::diagnose {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kHeld = 1e-6;  // of a prior's deviation: what is held at a bound

double normal_cdf(double x) { return 0.5 * std::erfc(-x / std::sqrt(2.0)); }

// Woodbury: Σ = diag(v) + B Bᵀ.
struct Woodbury {
  VectorXd inverse_variance;
  MatrixXd scaled;  // B
  Eigen::LLT<MatrixXd> inner;
  double log_determinant = 0;

  Woodbury(const VectorXd& variance, MatrixXd shared)
      : inverse_variance(variance.cwiseInverse()), scaled(std::move(shared)) {
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

ModelError model_error(const Protocol& protocol, const Windows& windows, const MatrixXd& forces, const VectorXd& grid,
                       SeenError seen, const MatrixXd& second, FrameNoise frames) {
  ModelError error;
  error.lasting = std::move(seen.lasting);
  error.forces.resize(forces.rows(), forces.cols() + 1);
  error.forces << forces, protocol.grid_share * grid;
  error.white_mm = protocol.white_share * forces.rowwise().norm();
  error.noise_mm = (windows.noise_mm().array().square() + seen.rough_mm.array().square()).sqrt();
  error.bent = protocol.straight_within * protocol.straight_within * second;
  error.frames = std::move(frames);
  for (long k = 0; k < protocol.scales; ++k)
    error.scales.push_back(protocol.least_scale * std::pow(protocol.scale_ratio, static_cast<double>(k)));
  return error;
}

Evidence::Evidence(const Windows& windows, ModelError error) : windows_(windows), error_(std::move(error)) {}

VectorXd Evidence::variance(const Window& w, double s) const {
  return error_.noise_mm.segment(w.first, w.count).array().square() +
         s * s * error_.white_mm.segment(w.first, w.count).array().square();
}

MatrixXd Evidence::shared(const Window& w, double s) const {
  const MatrixXd& shapes = error_.frames.shapes;
  std::vector<int> frames;
  for (Index row = w.first; row < w.first + w.count && shapes.cols() > 0; ++row)
    if (const int f = error_.frames.frame[static_cast<size_t>(row)];
        std::find(frames.begin(), frames.end(), f) == frames.end())
      frames.push_back(f);
  const Index forces = error_.forces.cols(), bent = error_.bent.cols(), first = forces + bent;
  MatrixXd out = MatrixXd::Zero(w.count, first + static_cast<Index>(frames.size()) * shapes.cols());
  out.leftCols(forces) = s * error_.forces.middleRows(w.first, w.count);
  if (bent > 0) out.middleCols(forces, bent) = error_.bent.middleRows(w.first, w.count);
  for (size_t k = 0; k < frames.size(); ++k)
    for (Index i = 0; i < w.count; ++i)
      if (error_.frames.frame[static_cast<size_t>(w.first + i)] == frames[k])
        out.row(i).segment(first + static_cast<Index>(k) * shapes.cols(), shapes.cols()) = shapes.row(w.first + i);
  return out;
}

Gram& Gram::operator+=(const Gram& more) {
  of += more.of;
  log_determinant += more.log_determinant;
  return *this;
}

Gram Evidence::added(const MatrixXd& columns, const VectorXd& residual, size_t scale,
                     const std::vector<size_t>& trials) const {
  const MatrixXd& lasting = error_.lasting;
  MatrixXd all(columns.rows(), columns.cols() + lasting.cols());
  all.leftCols(columns.cols()) = columns;
  if (lasting.cols() > 0) all.rightCols(lasting.cols()) = lasting;
  Gram out;
  out.of = MatrixXd::Zero(all.cols() + 1, all.cols() + 1);
  for (size_t k = 0; k < windows_.windows().size(); ++k) {
    const size_t trial = windows_.windows()[k].trial;
    if (!trials.empty() && std::find(trials.begin(), trials.end(), trial) == trials.end()) continue;
    out += of_window(k, all, residual, scale_in(k, scale));
    if (!error_.windows.empty()) out.log_determinant -= 2 * error_.windows[scale].log_p[k];
  }
  return out;
}

Gram Evidence::marginal(const Gram& added) const {
  const Index lasting = error_.lasting.cols(), columns = added.of.cols() - lasting - 1;
  if (lasting == 0) return added;
  std::vector<Index> kept(static_cast<size_t>(columns) + 1);
  std::iota(kept.begin(), kept.end(), 0);
  kept.back() = columns + lasting;
  const MatrixXd across = added.of.middleRows(columns, lasting)(Eigen::all, kept);
  const Eigen::LLT<MatrixXd> inner(MatrixXd::Identity(lasting, lasting) +
                                   added.of.block(columns, columns, lasting, lasting));
  return {added.of(kept, kept) - across.transpose() * inner.solve(across),
          added.log_determinant + 2 * inner.matrixLLT().diagonal().array().log().sum()};
}

Gram Evidence::gram(const MatrixXd& columns, const VectorXd& residual, size_t scale) const {
  return marginal(added(columns, residual, scale, {}));
}

std::vector<Gram> Evidence::grams_without(const std::vector<std::vector<size_t>>& groups, const MatrixXd& columns,
                                          const VectorXd& residual, size_t scale) const {
  const Gram all = added(columns, residual, scale, {});
  std::vector<Gram> out(groups.size());
  tbb::parallel_for(size_t{0}, groups.size(), [&](size_t g) {
    const Gram own = added(columns, residual, scale, groups[g]);
    out[g] = marginal({all.of - own.of, all.log_determinant - own.log_determinant});
  });
  return out;
}

std::vector<Gram> Evidence::grams(const MatrixXd& columns, const VectorXd& residual) const {
  std::vector<Gram> out(scales());
  tbb::parallel_for(size_t{0}, scales(), [&](size_t k) { out[k] = gram(columns, residual, k); });
  return out;
}

double Evidence::trust(const Window& w, double typical_mm) const {
  if (error_.bent.cols() == 0) return 1;
  const double square = error_.bent.middleRows(w.first, w.count).squaredNorm() / static_cast<double>(w.count);
  return 1 / (1 + square / (typical_mm * typical_mm));
}

Evidence::Forces Evidence::forces_in(size_t window, const VectorXd& left, size_t scale) const {
  const Window& w = windows_.windows()[window];
  const double s = scale_in(window, scale);
  const Woodbury sigma(variance(w, s), shared(w, s));
  return {sigma.inner.solve(sigma.scaled.transpose() * sigma.inverse_variance.cwiseProduct(left)),
          sigma.inner.solve(MatrixXd::Identity(sigma.scaled.cols(), sigma.scaled.cols()))};
}

double Evidence::scale_in(size_t window, size_t scale) const {
  const double s = error_.scales[scale];
  return error_.windows.empty() ? s : s * error_.windows[scale].factor[window];
}

Gram Evidence::of_window(size_t window, const MatrixXd& columns, const VectorXd& residual, double s) const {
  const Window& w = windows_.windows()[window];
  const Woodbury sigma(variance(w, s), shared(w, s));
  MatrixXd rows(w.count, columns.cols() + 1);
  rows << columns.middleRows(w.first, w.count), residual.segment(w.first, w.count);
  return {rows.transpose() * sigma.solve(rows), sigma.log_determinant};
}

namespace {

Posterior unbounded(const Gram& gram, const VectorXd& m, const VectorXd& sd) {
  const Index n = m.size();
  MatrixXd scaled = sd.asDiagonal() * gram.of.topLeftCorner(n, n) * sd.asDiagonal();  // Λ^½ A Λ^½
  scaled.diagonal().array() += 1;
  Posterior out;
  out.scaled.compute(scaled);
  const VectorXd b = m.cwiseQuotient(sd) - sd.cwiseProduct(gram.of.col(n).head(n));  // the residual is behind columns
  out.mean = sd.cwiseProduct(out.scaled.solve(b));
  const double log_a = 2 * out.scaled.matrixLLT().diagonal().array().log().sum();
  out.log_evidence = -0.5 * (gram.of(n, n) + m.cwiseQuotient(sd).squaredNorm() - b.dot(out.mean.cwiseQuotient(sd)) +
                             gram.log_determinant + log_a);
  out.prior_sd = sd;
  return out;
}

}  // namespace

Posterior posterior(const Gram& gram, const std::vector<Prior>& priors) {
  const auto n = static_cast<Index>(priors.size());
  VectorXd sd(n), m(n);
  for (Index i = 0; i < n; ++i) {
    sd(i) = priors[static_cast<size_t>(i)].sd;
    m(i) = priors[static_cast<size_t>(i)].mean;
  }
  Posterior out = unbounded(gram, m, sd);
  double inside_share = 0;
  std::vector<Index> bounded;
  for (Index i = 0; i < n; ++i) {
    const Prior& p = priors[static_cast<size_t>(i)];
    if (p.lower < -1e299 && p.upper > 1e299) continue;
    bounded.push_back(i);
    const auto inside = [&](double mean, double s) {
      return std::max(1e-30, normal_cdf((p.upper - mean) / s) - normal_cdf((p.lower - mean) / s));
    };
    inside_share += std::log(inside(out.mean(i), out.sd(i))) - std::log(inside(p.mean, p.sd));
  }
  const double log_evidence = out.log_evidence + inside_share;
  // The likeliest within bounds: whatever leaves them is held at them, the furthest first.
  for (size_t round = 0; round < bounded.size(); ++round) {
    Index worst = -1;
    double most = 1e-9;
    for (const Index i : bounded) {
      const Prior& p = priors[static_cast<size_t>(i)];
      const double beyond = std::max(p.lower - out.mean(i), out.mean(i) - p.upper) / p.sd;
      if (beyond <= most) continue;
      most = beyond;
      worst = i;
    }
    if (worst < 0) break;
    const Prior& p = priors[static_cast<size_t>(worst)];
    m(worst) = out.mean(worst) < p.lower ? p.lower : p.upper;
    sd(worst) = kHeld * p.sd;
    out = unbounded(gram, m, sd);
  }
  out.log_evidence = log_evidence;
  return out;
}

MatrixXd Posterior::covariance() const {
  const Index n = prior_sd.size();
  return prior_sd.asDiagonal() * scaled.solve(MatrixXd::Identity(n, n)) * prior_sd.asDiagonal();
}

double Posterior::sd_along(const VectorXd& direction) const {
  return scaled.matrixL().solve(prior_sd.cwiseProduct(direction)).norm();
}

double Posterior::sd(Index i) const { return sd_along(VectorXd::Unit(prior_sd.size(), i)); }

double log_sum(const std::vector<double>& logs) {
  const double most = *std::max_element(logs.begin(), logs.end());
  double sum = 0;
  for (const double l : logs) sum += std::exp(l - most);
  return most + std::log(sum);
}

}  // namespace selvedge::diagnose
