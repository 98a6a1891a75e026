#include "evaluation/true_shares.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include <Eigen/Cholesky>
#include <nlohmann/json.hpp>

#include "diagnose/windows.h"
#include "fit/stages.h"
#include "model/simulation.h"

namespace selvedge::evaluation {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

double base_gap_mm2(const trial::Campaign& campaign, const nlohmann::json& diagnosis) {
  constexpr int kRounds = 2;
  constexpr double kLongest = 0.5;  // ln, of a step
  const diagnose::Protocol protocol;
  const std::vector<model::ObservedTrial> trials = fit::observe_campaign(
      campaign, protocol.rate_hz, protocol.image_rate_hz, [](double, const std::string&) {},
      observe::Thinning::averaged);
  model::SimulationOptions options;
  options.cells = diagnosis.at("grid_cells")[0].get<int>();
  const model::Simulation simulation(trials, options);
  const diagnose::Windows windows(simulation, protocol);
  const std::vector<model::Parameter> base =
      model::base_parameters(model::drag_named(diagnosis.at("base").get<std::string>()));
  const nlohmann::json& values = diagnosis.at("fit").at("none");
  VectorXd x(static_cast<Index>(base.size()));
  for (size_t k = 0; k < base.size(); ++k)
    x(static_cast<Index>(k)) = model::to_coordinate(base[k], values.at(base[k].name).get<double>());
  const model::State state = simulation.state_at(base, x);
  const VectorXd noise = windows.noise_mm();
  const VectorXd weight = (noise.array().square() + std::pow(diagnose::form_along_an_axis_mm(protocol), 2)).inverse();
  const auto gap = [&](const VectorXd& r) {
    return 3 * (r.squaredNorm() - noise.squaredNorm()) / static_cast<double>(r.size());
  };
  const Index n = x.size();
  const VectorXd start = x;
  double least = 1e300;
  for (int round = 0; round <= kRounds; ++round) {
    MatrixXd sets = x.replicate(1, 1 + n);
    for (Index k = 0; k < n; ++k) sets(k, 1 + k) += protocol.base_difference;
    const MatrixXd r = windows.residuals(simulation, state, base, round < kRounds ? sets : MatrixXd(x));
    if (!r.col(0).allFinite()) break;
    least = std::min(least, gap(r.col(0)));
    if (round == kRounds) break;
    MatrixXd change = (r.rightCols(n).colwise() - r.col(0)) / protocol.base_difference;
    for (Index k = 0; k < n; ++k)
      if (!change.col(k).allFinite()) change.col(k).setZero();
    MatrixXd normal = change.transpose() * weight.asDiagonal() * change;
    normal.diagonal().array() += 1 / (protocol.base_sd * protocol.base_sd);
    const VectorXd d = normal.ldlt().solve(-change.transpose() * weight.cwiseProduct(r.col(0)) -
                                           (x - start) / (protocol.base_sd * protocol.base_sd));
    x += d * std::min(1.0, kLongest / std::max(1e-12, d.cwiseAbs().maxCoeff()));
    const auto [lower, upper] = model::bounds_of(base);
    x = x.cwiseMax(lower).cwiseMin(upper);
  }
  return least;
}

std::vector<double> shapley(size_t count, const std::function<double(unsigned)>& worth) {
  const unsigned all = (1u << count) - 1;
  std::vector<double> value(all + 1);
  for (unsigned s = 0; s <= all; ++s) value[s] = worth(s);
  std::vector<double> factorial(count + 1, 1.0);
  for (size_t k = 1; k <= count; ++k) factorial[k] = factorial[k - 1] * static_cast<double>(k);
  std::vector<double> out(count, 0.0);
  for (size_t k = 0; k < count; ++k)
    for (unsigned s = 0; s <= all; ++s) {
      if ((s >> k & 1u) != 0) continue;
      const auto size = static_cast<size_t>(std::popcount(s));
      out[k] += factorial[size] * factorial[count - size - 1] / factorial[count] * (value[s | 1u << k] - value[s]);
    }
  return out;
}

}  // namespace selvedge::evaluation
