#include "material_tests/cusick.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "files/bad_input.h"
#include "material_tests/bending_length.h"
#include "material_tests/disc_energy.h"
#include "material_tests/silhouette.h"

namespace selvedge::material_tests {

namespace {

using Eigen::Index;
using Eigen::Matrix3Xd;
using Eigen::Matrix4d;
using Eigen::MatrixXd;
using Eigen::Vector4d;
using Eigen::VectorXd;

// Drape coefficient, elongation along and across (m), fold amplitude (m).
const Vector4d kModelSd(0.005, 3e-4, 3e-4, 5e-4);
constexpr RestOptions kEvenFolds{.change_m = 2e-4}, kFromNear{.change_m = 1e-4, .inertia_per_s2 = 20},
    kSlope{.change_m = 1e-6, .most_steps = 2, .inertia_per_s2 = 20};
// Of real fabrics (docs/real-fabric.md): ½ ln of bend both ways; share by which bending softens at the curvature 1/l.
constexpr double kAnisotropySd = 0.4, kSofteningSd = 0.1;
constexpr double kMostSoftening = 0.3, kMostAnisotropy = 1.2;
constexpr int kRounds = 5;
constexpr double kLead = 1;  // of log evidence before isotropic bending, which has a parameter less

struct Capture {
  std::string trial;
  size_t sample = 0;
  int number = 0;
  OutlineMeasures measured;
};

Vector4d features(const OutlineMeasures& m) {
  return {m.drape_coefficient, m.harmonics_m[2].real(), m.harmonics_m[2].imag(), m.fold_amplitude_m()};
}

Eigen::Matrix2Xd turned(const Eigen::Matrix2Xd& outline, const Eigen::Vector2d& offset_m, double angle_rad) {
  return Eigen::Rotation2Dd(-angle_rad).toRotationMatrix() * (outline.colwise() - offset_m);
}

// All captures of the trials, about their common middle and turned by −axis.
std::vector<Capture> captures_of(const std::vector<const trial::Trial*>& discs, const Eigen::Vector2d& offset_m,
                                 double axis_rad) {
  std::vector<Capture> out;
  for (size_t s = 0; s < discs.size(); ++s)
    for (const trial::Outline& o : discs[s]->cusick->outlines)
      out.push_back({discs[s]->name, s, o.capture,
                     measure_outline(turned(o.point_m, offset_m, axis_rad), discs[s]->cusick->disc_m,
                                     discs[s]->cusick->support_m)});
  return out;
}

Vector4d mean_of(const std::vector<Capture>& captures) {
  Vector4d sum = Vector4d::Zero();
  for (const Capture& c : captures) sum += features(c.measured);
  return sum / static_cast<double>(captures.size());
}

// Of the mean over all captures: between samples and between captures of a sample, each from its mean square.
Matrix4d covariance_of_mean(const std::vector<Capture>& captures) {
  const size_t samples = captures.back().sample + 1;
  const double n = static_cast<double>(captures.size()), each = n / static_cast<double>(samples);
  std::vector<Vector4d> mean(samples, Vector4d::Zero());
  std::vector<double> count(samples, 0);
  for (const Capture& c : captures) {
    mean[c.sample] += features(c.measured);
    count[c.sample] += 1;
  }
  for (size_t s = 0; s < samples; ++s) mean[s] /= count[s];
  const Vector4d all = mean_of(captures);
  Matrix4d within = Matrix4d::Zero(), between = within;
  for (const Capture& c : captures) {
    const Vector4d gap = features(c.measured) - mean[c.sample];
    within += gap * gap.transpose();
  }
  for (size_t s = 0; s < samples; ++s) between += count[s] * (mean[s] - all) * (mean[s] - all).transpose();
  within /= std::max(1.0, n - static_cast<double>(samples));
  between /= std::max(1.0, static_cast<double>(samples) - 1);
  // Where samples differ by less than captures explain, captures alone are counted.
  const Eigen::SelfAdjointEigenSolver<Matrix4d> excess((between - within) / each);
  const Matrix4d of_samples =
      excess.eigenvectors() * excess.eigenvalues().cwiseMax(0).asDiagonal() * excess.eigenvectors().transpose();
  return of_samples / static_cast<double>(samples) + within / n;
}

std::vector<DrapePair> spread(const std::vector<Capture>& captures, size_t most) {
  std::vector<DrapePair> out;
  const size_t count = std::min(most, captures.size());
  for (size_t i = 0; i < count; ++i) {
    const Capture& c = captures[i * captures.size() / count];
    out.push_back({c.trial, c.number, c.measured, {}, 0, false, {}});
  }
  return out;
}

// What fabric weighs and how it bends, by coordinates: ln bend, anisotropy, softening at the curvature 1/l of the
// start.
struct Law {
  const char* name;
  bool turns = false, softens = false;
  Index count() const { return 1 + (turns || softens); }
};
const Law kLaws[] = {{"isotropic"}, {"anisotropic", true, false}, {"softening", false, true}};

class Search {
 public:
  Search(const Disc& disc, double density, const CusickOptions& options, std::vector<DrapePair> pairs)
      : sheet_(disc, options.cells, options.spokes), pairs_(std::move(pairs)) {
    base_.density = density;
    base_.stretch = options.stretch;
    base_.shear = options.shear;
  }

  const DiscSheet& sheet() const { return sheet_; }

  // bend at which an evenly folded drape has this coefficient: from stiff to soft.
  double first_guess(double drape_coefficient, int folds) const {
    cloth::Material m = base_;
    const double reach = sheet_.disc().radius_m - sheet_.disc().support_radius_m;
    m.bend = bend_of(0.6 * reach, m.density);
    Matrix3Xd control = folded(sheet_, folds);
    double last = 1, ln_last = std::log(m.bend);
    for (int i = 0; i < 24; ++i, m.bend *= 0.6) {
      const Drape drape = come_to_rest(sheet_, m, control, kEvenFolds);
      control = drape.control;
      const double here = seen(control).drape_coefficient;
      if (here < drape_coefficient)
        return std::exp(ln_last + (std::log(m.bend) - ln_last) * (last - drape_coefficient) / (last - here));
      last = here;
      ln_last = std::log(m.bend);
    }
    return m.bend;
  }

  double softening_scale_m2() const { return length_m_ * length_m_; }
  void scale_softening(double bend) { length_m_ = bending_length_m(bend, base_.density); }

  cloth::Material material(const Law& law, const VectorXd& at) const {
    cloth::Material m = base_;
    m.bend = std::exp(at(0));
    if (law.turns) m.bend_anisotropy = at(1);
    if (law.softens) m.bend_stiffening = -at(1) * softening_scale_m2();
    return m;
  }

  // Each pair's drape, from where it was or, without `from_near`, from its own outline.
  void settle(const cloth::Material& m, const std::optional<RestOptions>& from_near,
              std::vector<DrapePair>& pairs) const {
    tbb::parallel_for(size_t{0}, pairs.size(), [&](size_t i) {
      DrapePair& p = pairs[i];
      const Drape drape =
          from_near ? come_to_rest(sheet_, m, p.control, *from_near) : drape_like(sheet_, m, p.measured.radius_m);
      p.control = drape.control;
      p.at_rest = drape.at_rest;
      p.fitted = seen(p.control);
      p.left_m = std::sqrt((p.measured.radius_m - p.fitted.radius_m).squaredNorm() /
                           static_cast<double>(p.measured.radius_m.size()));
    });
  }

  std::vector<DrapePair> begun(const cloth::Material& m) const {
    std::vector<DrapePair> pairs = pairs_;
    settle(m, std::nullopt, pairs);
    return pairs;
  }

 private:
  OutlineMeasures seen(const Matrix3Xd& control) const {
    const Silhouette s = silhouette_of(sheet_, control);
    return measure_outline(outline_of(s.image, s.scale), 2 * sheet_.disc().radius_m,
                           2 * sheet_.disc().support_radius_m);
  }

  DiscSheet sheet_;
  cloth::Material base_;
  double length_m_ = 0.02;
  std::vector<DrapePair> pairs_;
};

Vector4d mean_fitted(const std::vector<DrapePair>& pairs) {
  Vector4d sum = Vector4d::Zero();
  for (const DrapePair& p : pairs) sum += features(p.fitted);
  return sum / static_cast<double>(pairs.size());
}

// What is minimised: half the squares of gaps and of what priors say.
struct Objective {
  Vector4d measured;
  Matrix4d precision;
  Eigen::Vector2d prior_precision;  // of the coordinates; ln bend has none
  double chi_squared(const Vector4d& fitted) const { return (measured - fitted).dot(precision * (measured - fitted)); }
  double operator()(const Vector4d& fitted, const VectorXd& at) const {
    double sum = chi_squared(fitted);
    for (Index i = 0; i < at.size(); ++i) sum += prior_precision(i) * at(i) * at(i);
    return sum / 2;
  }
};

VectorXd within_bounds(const Law& law, VectorXd at) {
  if (law.turns) at(1) = std::clamp(at(1), -kMostAnisotropy, kMostAnisotropy);
  if (law.softens) at(1) = std::clamp(at(1), 0.0, kMostSoftening);
  return at;
}

// Derivatives of the mean features by the coordinates, from where the drapes are.
MatrixXd slopes(const Search& search, const Law& law, const VectorXd& at, const std::vector<DrapePair>& pairs) {
  MatrixXd out(4, at.size());
  const Vector4d here = mean_fitted(pairs);
  for (Index i = 0; i < at.size(); ++i) {
    const double step = i == 0 ? -0.05 : law.turns ? 0.05 : 0.01;
    VectorXd there = at;
    there(i) += step;
    std::vector<DrapePair> moved = pairs;
    search.settle(search.material(law, there), kSlope, moved);
    out.col(i) = (mean_fitted(moved) - here) / step;
  }
  return out;
}

// From these coordinates and drapes, which are at rest there.
BendingModel fit_law(const Search& search, const Law& law, const Objective& objective, VectorXd at,
                     std::vector<DrapePair> pairs) {
  double cost = objective(mean_fitted(pairs), at);
  MatrixXd curvature = MatrixXd::Identity(at.size(), at.size());
  for (int round = 0; round < kRounds; ++round) {
    const MatrixXd j = slopes(search, law, at, pairs);
    const Eigen::VectorXd prior = objective.prior_precision.head(at.size());
    curvature = j.transpose() * objective.precision * j;
    curvature.diagonal() += prior;
    const VectorXd pull =
        j.transpose() * objective.precision * (objective.measured - mean_fitted(pairs)) - prior.cwiseProduct(at);
    VectorXd step = curvature.ldlt().solve(pull);
    if (step.cwiseAbs().maxCoeff() > 0.5) step *= 0.5 / step.cwiseAbs().maxCoeff();
    bool better = false;
    double gained = 0;
    for (int halved = 0; halved < 3 && !better; ++halved, step /= 2) {
      const VectorXd there = within_bounds(law, at + step);
      std::vector<DrapePair> moved = pairs;
      search.settle(search.material(law, there), kFromNear, moved);
      const double here = objective(mean_fitted(moved), there);
      if (!(here < cost)) continue;
      better = true;
      gained = cost - here;
      at = there;
      cost = here;
      pairs = std::move(moved);
    }
    if (!better || gained < 0.05) break;
  }
  BendingModel out{
      law.name,        search.material(law, at), 0, objective.chi_squared(mean_fitted(pairs)), curvature.inverse(),
      std::move(pairs)};
  // ln bend has the same wide prior in all laws and is left out of them; each other coordinate pays for its width.
  out.log_evidence = -cost + 0.5 * std::log(out.covariance.determinant());
  for (Index i = 1; i < at.size(); ++i) out.log_evidence += 0.5 * std::log(objective.prior_precision(i));
  return out;
}

// The direction of anisotropy was read off the outlines: a coordinate more, across b, as uncertain as elongation is.
double evidence_of_direction(const Objective& objective, const BendingModel& model) {
  const double b = std::max(0.05, std::abs(model.material.bend_anisotropy));
  const double per_b = std::abs(mean_fitted(model.drapes)(1)) / b;  // elongation for a unit of b
  const double precision = objective.precision(2, 2) * per_b * per_b + 1 / (kAnisotropySd * kAnisotropySd);
  return -0.5 * std::log(precision * kAnisotropySd * kAnisotropySd);
}

void check(const std::vector<const trial::Trial*>& discs) {
  if (discs.empty()) throw std::invalid_argument("fit_cusick: no trials");
  for (const trial::Trial* t : discs) {
    if (!t->cusick) refuse(t->name, "found a trial of kind {}, expected cusick", trial::to_text(t->experiment));
    if (t->cusick->disc_m != discs[0]->cusick->disc_m || t->cusick->support_m != discs[0]->cusick->support_m)
      refuse(t->name, "found a disc of {} m on a support of {} m, expected {} m on {} m as in {}", t->cusick->disc_m,
             t->cusick->support_m, discs[0]->cusick->disc_m, discs[0]->cusick->support_m, discs[0]->name);
    for (const trial::Outline& o : t->cusick->outlines)
      if (const double k = measure_outline(o.point_m, t->cusick->disc_m, t->cusick->support_m).drape_coefficient;
          k < 0.02 || k > 0.98)
        refuse(t->name,
               "capture {} has a drape coefficient of {:.1f} %, expected 2 to 98: are its scale, disc_m and "
               "support_m right?",
               o.capture, 100 * k);
  }
}

Disc disc_of(const trial::Trial& t) { return {t.cusick->disc_m / 2, t.cusick->support_m / 2}; }

}  // namespace

CusickFit fit_cusick_models(const std::vector<const trial::Trial*>& discs, const CusickOptions& options) {
  check(discs);
  CusickFit fit;
  std::vector<Capture> captures = captures_of(discs, fit.offset_m, 0);
  std::complex<double> middle = 0;
  for (const Capture& c : captures) middle += c.measured.harmonics_m[1] / static_cast<double>(captures.size());
  fit.offset_m = {middle.real(), -middle.imag()};
  captures = captures_of(discs, fit.offset_m, 0);
  const Vector4d seen = mean_of(captures);
  fit.axis_rad = -std::arg(std::complex<double>(seen(1), seen(2))) / 2;
  captures = captures_of(discs, fit.offset_m, fit.axis_rad);

  Search search(disc_of(*discs[0]), trial::areal_mass(*discs[0]), options, spread(captures, options.drapes));
  const Matrix4d model_sd = kModelSd.cwiseAbs2().asDiagonal();
  Objective objective{mean_of(captures), (covariance_of_mean(captures) + model_sd).inverse(), {0, 0}};
  double folds = 0;
  for (const Capture& c : captures) folds += c.measured.folds / static_cast<double>(captures.size());
  const double guess = search.first_guess(objective.measured(0), std::max(3, static_cast<int>(std::lround(folds))));
  search.scale_softening(guess);
  fit.softening_scale_m2 = search.softening_scale_m2();
  for (const Capture& c : captures)
    fit.measured_percent.sd += std::pow(c.measured.drape_coefficient - objective.measured(0), 2);
  fit.measured_percent = {100 * objective.measured(0),
                          100 * std::sqrt(fit.measured_percent.sd / std::max(1.0, double(captures.size()) - 1))};
  for (const Law& law : kLaws) {
    options.progress(static_cast<double>(fit.models.size()) / 3, law.name);
    VectorXd from = VectorXd::Zero(law.count());
    from(0) = fit.models.empty() ? std::log(guess) : std::log(fit.models[0].material.bend);
    if (law.turns) from(1) = std::clamp(objective.measured(1) / 9e-3, 0.05, 0.8);
    const double sd = law.turns ? kAnisotropySd : kSofteningSd;
    objective.prior_precision = {0, 1 / (sd * sd)};
    // A fabric that softens by nothing is the isotropic one; where fabric turns, folds lie elsewhere.
    std::vector<DrapePair> drapes = law.softens ? fit.models[0].drapes : search.begun(search.material(law, from));
    fit.models.push_back(fit_law(search, law, objective, from, std::move(drapes)));
    if (law.turns) fit.models.back().log_evidence += evidence_of_direction(objective, fit.models.back());
    if (fit.models.back().log_evidence > fit.best().log_evidence + (fit.picked == 0 ? kLead : 0))
      fit.picked = fit.models.size() - 1;
  }
  return fit;
}

std::vector<DrapePair> predict_drapes(const CusickFit& fit, const std::vector<const trial::Trial*>& discs,
                                      const CusickOptions& options) {
  check(discs);
  const std::vector<Capture> captures = captures_of(discs, fit.offset_m, fit.axis_rad);
  std::vector<DrapePair> pairs = spread(captures, captures.size());
  const Search search(disc_of(*discs[0]), trial::areal_mass(*discs[0]), options, {});
  search.settle(fit.best().material, std::nullopt, pairs);
  return pairs;
}

}  // namespace selvedge::material_tests
