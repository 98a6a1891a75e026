// Checks of a diagnosis on data that its own model drew, so that the right answer is known exactly: what no world's
// form can excuse. One campaign is linearised at known parameters; residuals are drawn about it in any number.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "diagnose/base_fit.h"
#include "diagnose/effect_sets.h"

namespace selvedge::evaluation {

enum class DrawnKind { none, one, two, three, unknown, effect_with_unknown };
constexpr size_t kDrawnKinds = 6;
const char* to_text(DrawnKind kind);

// What was drawn, and what the evidence said of it.
struct DrawnAnswer {
  DrawnKind kind = DrawnKind::none;
  std::vector<std::string> effects;
  diagnose::Verdict verdict;
  std::array<double, kDrawnKinds> kinds{};  // its probabilities
  std::string named() const;                // the likeliest name
};

class DrawnCampaign {
 public:
  // options.base_fit: where it is linearised.
  DrawnCampaign(const trial::Campaign& campaign, const std::vector<diagnose::Effect>& effects,
                const diagnose::StudyOptions& options);

  const diagnose::Study& study() const { return study_; }
  // Effects that the data can show, by their place in the study.
  const std::vector<size_t>& tellable() const { return tellable_; }
  // Of the evidence's own prior over sets.
  std::array<double, kDrawnKinds> prior() const;

  // Effects, sizes, model error and noise by their priors.
  DrawnAnswer drawn(DrawnKind kind, std::mt19937_64& random) const;
  // One effect, `times` what three standard deviations of the whitened noise show (or twice what is negligible, where
  // that is more), beside model error of the usual size. deleted: judged by a library without it.
  DrawnAnswer drawn_at(size_t effect, double times, bool deleted, std::mt19937_64& random) const;

  // Smooth forces of s times their usual size, others in every window, simulated; share of the missing force's numbers,
  // over places, windows and directions, whose 90 % band holds the force that was there.
  double forces_held(double s, std::mt19937_64& random);

 private:
  struct Draw {
    std::vector<const diagnose::Way*> ways;
    std::map<Eigen::Index, double> fixed;  // columns with a size that is not drawn
    bool unknown = false;
    bool usual_scale = false;
  };
  Eigen::VectorXd residual_of(const Draw& draw, std::mt19937_64& random) const;
  diagnose::Verdict judged(const Eigen::VectorXd& residual, std::optional<size_t> deleted) const;
  size_t drawn_scale(bool unknown, std::mt19937_64& random) const;
  DrawnAnswer answer(DrawnKind kind, const Draw& draw, std::optional<size_t> deleted, std::mt19937_64& random) const;

  diagnose::Study study_;
  std::unique_ptr<diagnose::Windows> windows_;
  std::unique_ptr<diagnose::Evidence> evidence_;
  diagnose::Linearisation about_;
  std::vector<size_t> tellable_;
};

// The linearisation with an effect's columns dropped.
diagnose::Linearisation without_effect(const diagnose::Linearisation& about, size_t effect);

// Expected calibration error of inclusion over ten bins, of those of 0.05 or more; each answer counts as its kind's
// prior over how often the kind was drawn.
double drawn_inclusion_error(const std::vector<DrawnAnswer>& answers, const std::array<double, kDrawnKinds>& prior);

// Of each kind: its mean probability over answers so weighted, less its prior; zero of an evidence that is calibrated.
std::array<double, kDrawnKinds> drawn_kind_errors(const std::vector<DrawnAnswer>& answers,
                                                  const std::array<double, kDrawnKinds>& prior);

}  // namespace selvedge::evaluation
