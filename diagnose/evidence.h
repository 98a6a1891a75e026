// The evidence for sets of effects: one linear model, everything Gaussian, in closed form.
//
// About where a model was simulated, with r its residual, the rows of one window are
//   r = −X d + λ s D w + ε,   d ~ N(m, Λ),   w ~ N(0, 1),   ε ~ N(0, R + λ² s² white),   R = noise² + F Fᵀ,
// X: how the residual changes with the coordinates d of a model (Windows' rows: simulated less seen). D: what smooth
// forces that no law gives do to a window, each of the size that a right model's errors have; windows do not share
// their w. s: how much larger than that size the model error is; λ: by how much it is larger still in this window, or
// smaller (window_errors.h). R: the sensor, and what the mesh leaves of each depth (seen_error.h); F: what errs
// together in a frame (measured.h). What lasts, the same in all windows (seen_error.h), stands among the columns with a
// prior of its own and is summed over. So
//   Σ = λ² s² (D Dᵀ + white) + R,   A = Λ⁻¹ + Xᵀ Σ⁻¹ X,   b = Λ⁻¹ m − Xᵀ Σ⁻¹ r,
//   ln p(r | s) = −½ (rᵀ Σ⁻¹ r + mᵀ Λ⁻¹ m − bᵀ A⁻¹ b) − ½ ln|Σ| − ½ ln|ΛA| + const,
// and d given r is N(A⁻¹ b, A⁻¹) (Kaipio and Somersalo 2007 on approximation errors; Kennedy and O'Hagan 2001).
// What data say of all columns at once is in Gram matrices [X r]ᵀ Σ⁻¹ [X r], one for each s; sets of effects then cost
// a small Cholesky factor each.
#pragma once

#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "diagnose/measured.h"
#include "diagnose/seen_error.h"
#include "diagnose/windows.h"

namespace selvedge::diagnose {

// How much larger or smaller than s the model error of each window is, where the campaign's is s.
struct WindowFactors {
  std::vector<double> factor;  // λ, of each window
  std::vector<double> log_p;   // ln p(λ), of each
};

// What is unsure of a window's rows beside the model's coordinates.
struct ModelError {
  Eigen::MatrixXd forces;    // rows × forces, mm, at s = 1: D
  Eigen::VectorXd white_mm;  // a row, at s = 1: what no smooth force makes
  Eigen::VectorXd noise_mm;  // a row: the sensor's, with what the mesh leaves of it by itself
  Eigen::MatrixXd bent;      // rows × base coordinates, mm: what derivatives miss; no columns: nothing
  Eigen::MatrixXd lasting;   // rows × patterns, mm, each of unit variance: the same in all windows
  FrameNoise frames;
  std::vector<double> scales;               // s, ascending
  std::vector<WindowFactors> windows = {};  // at each s; none: 1
};

// forces: what those of usual size do; grid: what a finer grid changes; seen: what cameras err by;
// second: half the second derivatives by the base's coordinates. Where a fold snaps within a window these are a hundred
// times those of others, and no derivative serves: such a window says little.
ModelError model_error(const Protocol& protocol, const Windows& windows, const Eigen::MatrixXd& forces,
                       const Eigen::VectorXd& grid, SeenError seen, const Eigen::MatrixXd& second, FrameNoise frames);

// [X r]ᵀ Σ⁻¹ [X r] of some windows, the residual behind the columns.
struct Gram {
  Eigen::MatrixXd of;
  double log_determinant = 0;  // ln|Σ|

  Gram& operator+=(const Gram& more);  // of other rows
};

// A coordinate's distribution before the data.
struct Prior {
  double mean = 0, sd = 1;               // of d
  double lower = -1e300, upper = 1e300;  // of d
};

struct Posterior {
  double log_evidence = 0;
  Eigen::VectorXd mean;
  Eigen::VectorXd prior_sd;
  Eigen::LLT<Eigen::MatrixXd> scaled;  // of Λ^½ A Λ^½

  Eigen::MatrixXd covariance() const;
  double sd(Eigen::Index i) const;
  double sd_along(const Eigen::VectorXd& direction) const;  // of its product with d
};

class Evidence {
 public:
  Evidence(const Windows& windows, ModelError error);

  const ModelError& error() const { return error_; }
  size_t scales() const { return error_.scales.size(); }

  // One for each s.
  std::vector<Gram> grams(const Eigen::MatrixXd& columns, const Eigen::VectorXd& residual) const;

  Gram gram(const Eigen::MatrixXd& columns, const Eigen::VectorXd& residual, size_t scale) const;

  // Of all trials but those of each group.
  std::vector<Gram> grams_without(const std::vector<std::vector<size_t>>& groups, const Eigen::MatrixXd& columns,
                                  const Eigen::VectorXd& residual, size_t scale) const;

  // How much of a window derivatives can say: 1 where they serve, 0 where a fold snaps. typical_mm: that a right model
  // leaves of a row.
  double trust(const Window& window, double typical_mm) const;

  // Of what is shared in a window, at s: the forces' w, then the frames', given what they left of its rows.
  struct Forces {
    Eigen::VectorXd mean;
    Eigen::MatrixXd covariance;
  };
  Forces forces_in(size_t window, const Eigen::VectorXd& left, size_t scale) const;

  // λ s of a window.
  double scale_in(size_t window, size_t scale) const;

  // Of one window, if the size of its model error is s.
  Gram of_window(size_t window, const Eigen::MatrixXd& columns, const Eigen::VectorXd& residual, double s) const;

 private:
  Eigen::VectorXd variance(const Window& w, double s) const;
  // [s D F] of a window.
  Eigen::MatrixXd shared(const Window& w, double s) const;
  // Of the columns, what lasts and the residual; a sum over windows, of these trials, or of all where there are none.
  Gram added(const Eigen::MatrixXd& columns, const Eigen::VectorXd& residual, size_t scale,
             const std::vector<size_t>& trials) const;
  // Summed over what lasts.
  Gram marginal(const Gram& added) const;

  const Windows& windows_;
  ModelError error_;
};

// Of all columns of a Gram matrix, with a prior each. In the evidence bounds count by the share of each coordinate's
// own distribution that they leave; the mean is the likeliest within them.
Posterior posterior(const Gram& gram, const std::vector<Prior>& priors);

// ln Σ exp.
double log_sum(const std::vector<double>& logs);

}  // namespace selvedge::diagnose
