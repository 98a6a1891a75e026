#include "diagnose/verdict.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <boost/math/distributions/students_t.hpp>

#include "geometry/order_statistics.h"

namespace selvedge::diagnose {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

// Noise of a marker track from second differences over neighbouring times, which motion hardly reaches, mm in space.
double noise_from_differences(const Study& study, size_t trial) {
  const auto& markers = study.simulation->trials()[trial].markers;
  if (!markers || markers->time_s.size() < 5) return 0;
  const Index first = study.rows->first(trial);
  const auto times = static_cast<Index>(markers->time_s.size());
  const double sd = study.rows->sd_mm()(first);
  std::vector<double> all;
  for (Index k = 0; k < static_cast<Index>(markers->uv.size()); ++k)
    for (Index j = 1; j + 1 < times; ++j)
      for (Index axis = 0; axis < 3; ++axis) {
        const Index at = first + 3 * (k * times + j) + axis;
        if (study.rows->seen()(at - 3) * study.rows->seen()(at) * study.rows->seen()(at + 3) == 0) continue;
        all.push_back(std::abs(study.residual(at - 3) - 2 * study.residual(at) + study.residual(at + 3)) * sd);
      }
  if (all.size() < 30) return 0;
  return std::sqrt(3.0) * 1.4826 * geometry::median(std::move(all)) / std::sqrt(6.0);
}

double stated_noise(const Study& study, size_t trial) {
  const model::ObservedTrial& t = study.simulation->trials()[trial];
  if (t.markers) return marker_noise_mm(t);
  const VectorXd sd = study.rows->sd_mm().segment(study.rows->first(trial), study.rows->count(trial));
  const double model = study.simulation->options().model_sd_mm;
  return std::sqrt(
      std::max(0.0, sd.squaredNorm() / static_cast<double>(std::max<Index>(sd.size(), 1)) - model * model));
}

double replicate_mm(const Study& study) {
  double sum = 0, count = 0;
  for (const std::vector<size_t>& group : study.groups)
    for (size_t i = 0; i + 1 < group.size(); ++i) {
      const size_t a = group[i], b = group[i + 1];
      if (study.simulation->trials()[a].still || study.rows->count(a) != study.rows->count(b)) continue;
      const Index n = study.rows->count(a);
      const VectorXd d =
          study.residual.segment(study.rows->first(a), n) - study.residual.segment(study.rows->first(b), n);
      const VectorXd mm = d.cwiseProduct(study.rows->sd_mm().segment(study.rows->first(a), n));
      sum += 0.5 * mm.squaredNorm();
      count += static_cast<double>(n);
    }
  const bool markers = study.simulation->trials()[0].markers.has_value();
  return count > 0 ? std::sqrt((markers ? 3 : 1) * sum / count) : std::numeric_limits<double>::quiet_NaN();
}

double mesh_mm(const Study& study, size_t trial) {
  const VectorXd& d = study.mesh_change[trial];
  if (d.size() == 0) return 0;
  return std::sqrt((study.simulation->trials()[trial].markers ? 3 : 1) * d.squaredNorm() /
                   static_cast<double>(d.size()));
}

// Without the largest and the smallest of four or more.
double trimmed_mean(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const size_t off = values.size() >= 4 ? 1 : 0;
  double sum = 0;
  for (size_t i = off; i + off < values.size(); ++i) sum += values[i];
  return sum / static_cast<double>(values.size() - 2 * off);
}

bool predicts_all(const Study& study, const VectorXd& mm_of_trial) {
  for (const std::vector<size_t>& group : study.groups)
    for (const size_t trial : group)
      if (!std::isfinite(mm_of_trial(static_cast<Index>(trial)))) return false;
  return true;
}

}  // namespace

double marker_noise_mm(const model::ObservedTrial& trial) {
  return std::sqrt(3.0) * 1e3 * trial.markers->noise_m / (trial.still ? std::sqrt(20.0) : 1);
}

double size_form_share(const Protocol& protocol, Side side) {
  const bool of_the_rig = side == Side::measurement || side == Side::boundary || side == Side::aerodynamic;
  return of_the_rig ? protocol.rig_size_share : protocol.fabric_size_share;
}

Floor floor_of(const Study& study, const Protocol& protocol) {
  const auto trials = static_cast<Index>(study.rows->trials());
  Floor floor{VectorXd(trials), VectorXd(trials), replicate_mm(study)};
  for (Index t = 0; t < trials; ++t) {
    const auto trial = static_cast<size_t>(t);
    floor.noise_mm(t) = std::max(stated_noise(study, trial), noise_from_differences(study, trial));
    const bool still = study.simulation->trials()[trial].still;
    const double share = still ? protocol.still_grid_share : protocol.grid_share;
    const double form_mm = still || study.nudged ? protocol.form_mm : protocol.free_form_mm;
    floor.right_mm(t) =
        std::sqrt(std::pow(floor.noise_mm(t), 2) + std::pow(share * mesh_mm(study, trial), 2) + std::pow(form_mm, 2));
  }
  return floor;
}

std::vector<double> group_mm(const Study& study, const VectorXd& mm_of_trial) {
  std::vector<double> out;
  for (const std::vector<size_t>& group : study.groups) out.push_back(pooled_mm(study, mm_of_trial, group));
  return out;
}

Scores score(const Study& study, const std::vector<Hypothesis>& hypotheses, const HeldOut& held_out, const Floor& floor,
             const Protocol& c) {
  Scores out;
  const double kappa = study.nudged ? c.kappa : c.free_kappa;
  const std::vector<double> base = group_mm(study, held_out.mm.row(0)), right = group_mm(study, floor.right_mm),
                            noise = group_mm(study, floor.noise_mm);
  const auto form2 = [&](size_t g) { return right[g] * right[g] - noise[g] * noise[g]; };
  const auto beyond_noise = [&](size_t g, double mm) { return std::max(mm * mm - noise[g] * noise[g], 0.0); };
  const auto mean_log_ratio = [&](const std::vector<double>& after) {
    std::vector<double> logs;
    for (size_t g = 0; g < base.size(); ++g)
      logs.push_back(std::log((beyond_noise(g, base[g]) + form2(g)) / (beyond_noise(g, after[g]) + form2(g))));
    return trimmed_mean(std::move(logs));
  };
  std::vector<double> of_right;  // what an effect of another form than nature's leaves
  for (size_t g = 0; g < base.size(); ++g)
    of_right.push_back(std::sqrt(right[g] * right[g] + c.form_share * c.form_share * beyond_noise(g, base[g])));
  std::map<std::string, double> score_of;
  const auto effects = static_cast<double>(std::max<size_t>(1, study.effects.size()));
  const double prior_effect = (1 - c.prior_none - c.prior_unknown) / effects,
               prior_pair = c.two_share * prior_effect / std::max(0.5 * (effects - 1), 1.0);
  for (const Effect& e : study.effects)
    score_of[e.name] = std::log(prior_effect) - c.cost_per_parameter * static_cast<double>(e.parameters.size());
  for (size_t i = 0; i < hypotheses.size(); ++i) {
    const Hypothesis& h = hypotheses[i];
    const VectorXd mm = held_out.mm.row(static_cast<Index>(i));
    const double ratio = predicts_all(study, mm) ? mean_log_ratio(group_mm(study, mm)) : -1;
    out.log_ratio.push_back(ratio);
    if (h.effects.size() == 1) score_of[study.effects[h.effects[0]].name] += kappa * ratio;
    if (h.effects.size() == 2) {
      double parameters = 0;
      for (const size_t e : h.effects) parameters += static_cast<double>(study.effects[e].parameters.size());
      score_of[name_of(study, h)] = std::log(prior_pair) - c.cost_per_parameter * parameters + kappa * ratio;
      out.of_two[name_of(study, h)] = 0;
    }
  }
  out.log_ratio_unknown = mean_log_ratio(of_right);
  out.log_ratio_right = mean_log_ratio(right);
  score_of["none"] = std::log(c.prior_none);
  score_of["unknown"] = std::log(c.prior_unknown) + kappa * out.log_ratio_unknown - c.cost_unknown;
  // How often a null campaign lies so far above what a right model leaves; few are known, so tails are
  // heavy.
  double above = 0;
  for (size_t g = 0; g < base.size(); ++g) above += std::log(base[g] / right[g]) / static_cast<double>(base.size());
  const double z = study.nudged ? (above - c.null_mean) / c.null_sd : (above - c.free_null_mean) / c.free_null_sd;
  out.p_value =
      std::isfinite(z) ? boost::math::cdf(boost::math::complement(boost::math::students_t(c.null_freedom), z)) : 0;
  score_of["none"] += std::log(std::clamp(out.p_value / c.plain_gap, 1e-12, 1.0));
  double most = -1e300, sum = 0;
  for (const auto& [name, value] : score_of) most = std::max(most, value);
  for (const auto& [name, value] : score_of) sum += std::exp(value - most);
  for (const auto& [name, value] : score_of) {
    if (value == most) out.likeliest = name;
    if (!out.of_two.contains(name)) out.probability[name] = std::exp(value - most) / sum;
  }
  for (const Hypothesis& h : hypotheses) {
    if (h.effects.size() != 2) continue;
    const double together = out.of_two[name_of(study, h)] = std::exp(score_of.at(name_of(study, h)) - most) / sum;
    for (const size_t e : h.effects) out.probability[study.effects[e].name] += 0.5 * together;
  }
  return out;
}

}  // namespace selvedge::diagnose
