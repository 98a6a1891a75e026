#include "evaluation/drawn_campaign.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "diagnose/missing_force.h"
#include "evaluation/set_score.h"

namespace selvedge::evaluation {

using diagnose::Column;
using diagnose::Linearisation;
using diagnose::Prior;
using diagnose::Size;
using diagnose::Way;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

double normal(std::mt19937_64& random) { return std::normal_distribution<double>()(random); }

double within_bounds(const Prior& p, std::mt19937_64& random) {
  for (;;)
    if (const double d = p.mean + p.sd * normal(random); d >= p.lower && d <= p.upper) return d;
}

DrawnKind kind_of(const diagnose::Weight& w) {
  if (w.and_unknown) return w.effects.empty() ? DrawnKind::unknown : DrawnKind::effect_with_unknown;
  return static_cast<DrawnKind>(std::min<size_t>(w.effects.size(), 3));
}

double choose(size_t n, size_t k) {
  double out = 1;
  for (size_t i = 0; i < k; ++i) out *= static_cast<double>(n - i) / static_cast<double>(i + 1);
  return out;
}

std::vector<double> weights_of(const std::vector<DrawnAnswer>& answers, const std::array<double, kDrawnKinds>& prior) {
  std::array<double, kDrawnKinds> count{};
  for (const DrawnAnswer& a : answers) ++count[static_cast<size_t>(a.kind)];
  std::vector<double> out;
  for (const DrawnAnswer& a : answers)
    out.push_back(prior[static_cast<size_t>(a.kind)] / count[static_cast<size_t>(a.kind)]);
  return out;
}

}  // namespace

const char* to_text(DrawnKind kind) {
  constexpr const char* names[kDrawnKinds] = {"none",          "one effect", "two effects",
                                              "three effects", "unknown",    "an effect with unknown"};
  return names[static_cast<size_t>(kind)];
}

std::string DrawnAnswer::named() const {
  return std::max_element(verdict.probability.begin(), verdict.probability.end(),
                          [](const auto& a, const auto& b) { return a.second < b.second; })
      ->first;
}

DrawnCampaign::DrawnCampaign(const trial::Campaign& campaign, const std::vector<diagnose::Effect>& effects,
                             const diagnose::StudyOptions& options)
    : study_(diagnose::make_study(campaign, effects, options).study) {
  windows_ = std::make_unique<diagnose::Windows>(*study_.simulation, study_.protocol);
  const MatrixXd forces = responses_to_forces(study_, *windows_);
  about_ = linearise(study_, *windows_, study_.state, study_.base, forces);
  if (!about_.residual.allFinite()) throw std::runtime_error("DrawnCampaign: the base diverges at its parameters");
  evidence_ = std::make_unique<diagnose::Evidence>(
      *windows_, model_error(study_.protocol, *windows_, forces, about_.grid,
                             seen_error(study_.protocol, *study_.simulation, *windows_, about_.grid), about_.second,
                             frame_noise(study_.measured, *study_.simulation, *windows_)));
  for (size_t e = 0; e < study_.effects.size(); ++e)
    if (about_.can_tell[e]) tellable_.push_back(e);
}

std::array<double, kDrawnKinds> DrawnCampaign::prior() const {
  const diagnose::Protocol& p = study_.protocol;
  const size_t n = study_.effects.size(), m = tellable_.size();
  const auto share = [&](size_t k) { return n < k ? 0 : choose(m, k) / std::max(1.0, choose(n, k)); };
  const double one = (1 - p.prior_none - p.prior_unknown - p.prior_two - p.prior_three) * share(1),
               two = p.prior_two * share(2), three = p.prior_three * share(3), alone = 1 - p.prior_beside;
  std::array<double, kDrawnKinds> out = {p.prior_none,  alone * one,     alone * two,
                                         alone * three, p.prior_unknown, p.prior_beside * (one + two + three)};
  double sum = 0;
  for (const double x : out) sum += x;
  for (double& x : out) x /= sum;
  return out;
}

size_t DrawnCampaign::drawn_scale(bool unknown, std::mt19937_64& random) const {
  const diagnose::ScalePriors priors = scale_priors(study_, evidence_->error().scales);
  std::vector<double> p;
  for (const double l : unknown ? priors.unknown : priors.right) p.push_back(std::exp(l));
  return std::discrete_distribution<size_t>(p.begin(), p.end())(random);
}

VectorXd DrawnCampaign::residual_of(const Draw& draw, std::mt19937_64& random) const {
  const diagnose::ModelError& error = evidence_->error();
  const double s = draw.usual_scale ? study_.right_scale : error.scales[drawn_scale(draw.unknown, random)];
  const std::vector<Size> sizes = sizes_of(about_, draw.ways);
  // Of an effect that may be there in several ways what is negligible is of every way.
  VectorXd d(static_cast<Index>(about_.columns.size()));
  for (size_t k = 0; k < about_.columns.size(); ++k) {
    const auto at = draw.fixed.find(static_cast<Index>(k));
    d(static_cast<Index>(k)) = at != draw.fixed.end()
                                   ? at->second
                                   : within_bounds(prior_of(study_, about_.columns[k], about_.x, sizes[k], s), random);
  }
  VectorXd r = -about_.changes * d;
  for (const diagnose::Window& w : windows_->windows()) {
    VectorXd forces(error.forces.cols());
    for (Index k = 0; k < forces.size(); ++k) forces(k) = s * normal(random);
    r.segment(w.first, w.count) += error.forces.middleRows(w.first, w.count) * forces;
    for (Index k = 0; k < error.bent.cols(); ++k)
      r.segment(w.first, w.count) += normal(random) * error.bent.col(k).segment(w.first, w.count);
  }
  for (Index k = 0; k < error.lasting.cols(); ++k) r += normal(random) * error.lasting.col(k);
  for (Index i = 0; i < r.size(); ++i) r(i) += std::hypot(error.noise_mm(i), s * error.white_mm(i)) * normal(random);
  return r;
}

Linearisation without_effect(const Linearisation& about, size_t effect) {
  Linearisation out = about;
  out.columns.clear();
  out.ways.clear();
  out.can_tell[effect] = 0;
  std::vector<Index> place(about.columns.size(), -1), kept;
  for (size_t k = 0; k < about.columns.size(); ++k) {
    const Column& c = about.columns[k];
    if (!c.is_base && !c.is_force && c.effect == effect) continue;
    place[k] = static_cast<Index>(kept.size());
    kept.push_back(static_cast<Index>(k));
    out.columns.push_back(c);
  }
  out.changes = about.changes(Eigen::all, kept);
  for (Way way : about.ways) {
    if (way.effect == effect) continue;
    for (Index& k : way.columns) k = place[static_cast<size_t>(k)];
    out.ways.push_back(std::move(way));
  }
  return out;
}

diagnose::Verdict DrawnCampaign::judged(const VectorXd& residual, std::optional<size_t> deleted) const {
  Linearisation about = deleted ? without_effect(about_, *deleted) : about_;
  about.residual = residual;
  return judge(study_, weigh_sets(study_, *evidence_, about), evidence_->error().scales, {});
}

DrawnAnswer DrawnCampaign::answer(DrawnKind kind, const Draw& draw, std::optional<size_t> deleted,
                                  std::mt19937_64& random) const {
  DrawnAnswer out;
  out.kind = kind;
  for (const Way* way : draw.ways) out.effects.push_back(study_.effects[way->effect].name);
  out.verdict = judged(residual_of(draw, random), deleted);
  for (const diagnose::Weight& w : out.verdict.weights) out.kinds[static_cast<size_t>(kind_of(w))] += w.probability;
  return out;
}

DrawnAnswer DrawnCampaign::drawn(DrawnKind kind, std::mt19937_64& random) const {
  Draw draw;
  draw.unknown = kind == DrawnKind::unknown || kind == DrawnKind::effect_with_unknown;
  size_t count = kind == DrawnKind::unknown ? 0 : static_cast<size_t>(kind);
  if (kind == DrawnKind::effect_with_unknown) {
    const diagnose::Protocol& p = study_.protocol;
    const double one = 1 - p.prior_none - p.prior_unknown - p.prior_two - p.prior_three;
    count = 1 + std::discrete_distribution<size_t>({one, p.prior_two, p.prior_three})(random);
  }
  std::vector<size_t> effects = tellable_;
  std::shuffle(effects.begin(), effects.end(), random);
  effects.resize(std::min(count, effects.size()));
  std::sort(effects.begin(), effects.end());
  for (const size_t e : effects) {
    std::vector<const Way*> ways;
    for (const Way& w : about_.ways)
      if (w.effect == e) ways.push_back(&w);
    draw.ways.push_back(ways[std::uniform_int_distribution<size_t>(0, ways.size() - 1)(random)]);
  }
  return answer(kind, draw, {}, random);
}

DrawnAnswer DrawnCampaign::drawn_at(size_t effect, double times, bool deleted, std::mt19937_64& random) const {
  constexpr double kFlat = 1e3, kDeviations = 3, kNegligible = 2;
  size_t scale = 0;
  for (size_t k = 0; k < evidence_->scales(); ++k)
    if (std::abs(std::log(evidence_->error().scales[k] / study_.right_scale)) <
        std::abs(std::log(evidence_->error().scales[scale] / study_.right_scale)))
      scale = k;
  const diagnose::Gram gram = evidence_->gram(about_.changes, about_.residual, scale);
  Draw draw;
  draw.usual_scale = true;
  // The way, and its column, that shows at the smallest size.
  Index column = 0;
  double least = std::numeric_limits<double>::infinity();
  for (const Way& way : about_.ways) {
    if (way.effect != effect) continue;
    for (const Index k : way.columns) {
      std::vector<Prior> priors;
      for (size_t i = 0; i < about_.columns.size(); ++i)
        priors.push_back(prior_of(study_, about_.columns[i], about_.x, Size::negligible, study_.right_scale));
      priors[static_cast<size_t>(k)] = {0, kFlat};
      const double shows = std::max(kDeviations * posterior(gram, priors).sd(k),
                                    kNegligible * about_.columns[static_cast<size_t>(k)].negligible_sd);
      if (shows >= least) continue;
      least = shows;
      column = k;
      draw.ways = {&way};
    }
  }
  for (const Index k : draw.ways[0]->columns) draw.fixed[k] = 0;
  const Column& c = about_.columns[static_cast<size_t>(column)];
  draw.fixed[column] = std::min(times * least, c.upper - (c.coordinate < 0 ? 0 : about_.x(c.coordinate)));
  return answer(DrawnKind::one, draw, deleted ? std::optional(effect) : std::nullopt, random);
}

double DrawnCampaign::forces_held(double s, std::mt19937_64& random) {
  constexpr Index kSimulated = 8;  // windows take turns
  constexpr double k90 = 1.6448536269514722;
  const auto count = static_cast<Index>(study_.parameters.size() - study_.first_force);
  MatrixXd sets = study_.base.replicate(1, 1 + kSimulated);
  for (Index j = 0; j < kSimulated; ++j)
    for (Index k = 0; k < count; ++k) sets(static_cast<Index>(study_.first_force) + k, 1 + j) = s * normal(random);
  const MatrixXd r = simulated(study_, *windows_, study_.state, sets);
  diagnose::Linearisation about = about_;
  about.residual = VectorXd::Zero(r.rows());
  for (size_t w = 0; w < windows_->windows().size(); ++w) {
    const diagnose::Window& window = windows_->windows()[w];
    const Index j = 1 + static_cast<Index>(w) % kSimulated;
    about.residual.segment(window.first, window.count) =
        r.col(0).segment(window.first, window.count) - r.col(j).segment(window.first, window.count);
  }
  for (Index i = 0; i < r.rows(); ++i) about.residual(i) += evidence_->error().noise_mm(i) * normal(random);
  const diagnose::EffectSet none = weigh_set(study_, *evidence_, about, {});
  const diagnose::MissingForce map = missing_force(study_, *windows_, *evidence_, arm_at(about, {}), none.scale);
  const model::ObservedTrial& first = study_.simulation->trials().front();
  size_t held = 0, of = 0;
  for (size_t w = 0; w < map.windows.size(); ++w) {
    model::Prediction p;
    p.experiment = first.experiment;
    const Index j = 1 + static_cast<Index>(w) % kSimulated;
    for (Index k = 0; k < count; ++k)
      study_.parameters[study_.first_force + static_cast<size_t>(k)].apply(
          p, sets(static_cast<Index>(study_.first_force) + k, j));
    for (size_t i = 0; i < map.uv_m.size(); ++i) {
      Eigen::Vector3d truly = Eigen::Vector3d::Zero();
      for (const cloth::SmoothForce& f : p.experiment.smooth_forces)
        truly += f.at(map.uv_m[i], first.width_m, first.height_m);
      const auto place = static_cast<Index>(i);
      for (Index a = 0; a < 3; ++a) {
        ++of;
        held += std::abs(map.windows[w].mean_n_m2(a, place) - truly(a)) <= k90 * map.windows[w].sd_n_m2(a, place);
      }
    }
  }
  return static_cast<double>(held) / static_cast<double>(of);
}

double drawn_inclusion_error(const std::vector<DrawnAnswer>& answers, const std::array<double, kDrawnKinds>& prior) {
  constexpr size_t kBins = 10;
  std::array<double, kBins> said{}, there{};
  double all = 0;
  const std::vector<double> weight = weights_of(answers, prior);
  for (size_t i = 0; i < answers.size(); ++i)
    for (const auto& [effect, p] : answers[i].verdict.inclusion) {
      if (p < kWorthSaying) continue;
      const auto bin = std::min(kBins - 1, static_cast<size_t>(p * kBins));
      const std::vector<std::string>& truly = answers[i].effects;
      said[bin] += weight[i] * p;
      there[bin] += std::find(truly.begin(), truly.end(), effect) != truly.end() ? weight[i] : 0;
      all += weight[i];
    }
  double error = 0;
  for (size_t bin = 0; bin < kBins; ++bin) error += std::abs(said[bin] - there[bin]);
  return all > 0 ? error / all : 0;
}

std::array<double, kDrawnKinds> drawn_kind_errors(const std::vector<DrawnAnswer>& answers,
                                                  const std::array<double, kDrawnKinds>& prior) {
  std::array<double, kDrawnKinds> out{};
  const std::vector<double> weight = weights_of(answers, prior);
  for (size_t i = 0; i < answers.size(); ++i)
    for (size_t k = 0; k < kDrawnKinds; ++k) out[k] += weight[i] * answers[i].kinds[k];
  for (size_t k = 0; k < kDrawnKinds; ++k) out[k] -= prior[k];
  return out;
}

}  // namespace selvedge::evaluation
