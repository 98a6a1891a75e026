#include "calib/structured_light.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <map>

#include <Eigen/QR>

#include "files/bad_input.h"
#include "geometry/order_statistics.h"

namespace selvedge::calib {

namespace {

using Kind = PatternStep::Kind;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr int kLowestBitAlone = 3;  // without phases: intervals of 8 px, whose middles a ring of pixels averages

double median(std::vector<double> values) { return values.empty() ? kNan : geometry::median(std::move(values)); }

// The images of one direction, sorted by what they do.
struct Direction {
  std::map<int, std::pair<const GreyImage*, const GreyImage*>> bits;  // bit: plain, inverted
  std::vector<const PatternImage*> phases;
  double period_px = 0, first_px = 0;
  int low_bit = 0;
};

struct Sequence {
  const GreyImage* off = nullptr;
  const GreyImage* white = nullptr;  // the brightest plain picture
  double white_level = 0;
  std::vector<const PatternImage*> levels;
  Direction rows, columns;
};

Direction sort_direction(const std::vector<PatternImage>& sequence, bool horizontal) {
  Direction direction;
  const char* name = horizontal ? "horizontal" : "vertical";
  for (const PatternImage& image : sequence) {
    if (image.step.horizontal != horizontal) continue;
    if (image.step.kind == Kind::gray_code) {
      auto& pair = direction.bits[image.step.bit];
      (image.step.inverted ? pair.second : pair.first) = &image.image;
    } else if (image.step.kind == Kind::phase_shift) {
      if (!direction.phases.empty() &&
          (image.step.period_px != direction.period_px || image.step.first_px != direction.first_px))
        refuse("pattern sequence", "{} phases have periods {} and {} px, expected one", name, direction.period_px,
               image.step.period_px);
      direction.period_px = image.step.period_px;
      direction.first_px = image.step.first_px;
      direction.phases.push_back(&image);
    }
  }
  if (direction.bits.empty()) refuse("pattern sequence", "expected {} grey-code images, found none", name);
  direction.low_bit = direction.bits.begin()->first;
  const bool has_phases = !direction.phases.empty();
  if (has_phases && direction.phases.size() < 3)
    refuse("pattern sequence", "expected at least 3 {} phase-shift images, found {}", name, direction.phases.size());
  if (!has_phases && direction.low_bit > kLowestBitAlone)
    refuse("pattern sequence", "{} grey code ends at bit {}, expected bits down to {} or phase-shift images", name,
           direction.low_bit, kLowestBitAlone);
  if (has_phases && std::ldexp(1.0, direction.low_bit) > direction.period_px / 2)
    refuse("pattern sequence", "{} grey code ends at bit {}, expected bits down to half the period of {} px", name,
           direction.low_bit, direction.period_px);
  int expected = direction.low_bit;
  for (const auto& [bit, pair] : direction.bits)
    if (bit != expected++ || !pair.first) refuse("pattern sequence", "{} grey code lacks bit {}", name, expected - 1);
  return direction;
}

Sequence sort_sequence(const std::vector<PatternImage>& sequence) {
  Sequence sorted;
  for (const PatternImage& image : sequence) {
    if (image.step.kind == Kind::off) sorted.off = &image.image;
    if (image.step.kind != Kind::solid) continue;
    sorted.levels.push_back(&image);
    if (image.step.level > sorted.white_level) {
      sorted.white_level = image.step.level;
      sorted.white = &image.image;
    }
  }
  if (!sorted.off) refuse("pattern sequence", "expected an image with the lamp off, found none");
  if (!sorted.white) refuse("pattern sequence", "expected an image of plain white, found none");
  sorted.rows = sort_direction(sequence, true);
  sorted.columns = sort_direction(sequence, false);
  return sorted;
}

double grey(const GreyImage& image, const Eigen::Vector2i& pixel) { return image(pixel.y(), pixel.x()); }

// Slope of log(grey over dark) against log(level), median over pixels.
std::optional<double> gamma_from_levels(const Sequence& s, const std::vector<Eigen::Vector2i>& pixels,
                                        const DecodeOptions& options) {
  if (s.levels.size() < 3) return std::nullopt;
  std::vector<double> slopes;
  for (const Eigen::Vector2i& pixel : pixels) {
    const double dark = grey(*s.off, pixel);
    if (grey(*s.white, pixel) - dark < 4 * options.least_contrast_grey) continue;
    // Weighted by the grey itself: noise in the logarithm grows as it falls.
    double w_sum = 0, x_sum = 0, y_sum = 0, xx_sum = 0, xy_sum = 0;
    for (const PatternImage* image : s.levels) {
      const double value = grey(image->image, pixel), over = value - dark;
      if (value >= options.saturated_grey || over < options.least_contrast_grey) continue;
      const double w = over * over, x = std::log(image->step.level), y = std::log(over);
      w_sum += w;
      x_sum += w * x;
      y_sum += w * y;
      xx_sum += w * x * x;
      xy_sum += w * x * y;
    }
    const double spread = xx_sum - x_sum * x_sum / w_sum;
    if (w_sum > 0 && spread > 1e-3 * w_sum) slopes.push_back((xy_sum - x_sum * y_sum / w_sum) / spread);
  }
  if (slopes.size() < 20) return std::nullopt;
  return median(slopes);
}

// Complex amplitude of one harmonic of the phases.
std::complex<double> harmonic(const Direction& d, const std::vector<double>& values, int order) {
  std::complex<double> sum = 0;
  for (size_t k = 0; k < values.size(); ++k) sum += values[k] * std::polar(1.0, -order * d.phases[k]->step.phase_rad);
  return sum * (2.0 / static_cast<double>(values.size()));
}

// ρ = Re(c2 / c1²·|c1|) / |c1|: the second harmonic is in step with twice the first's phase.
std::optional<double> gamma_from_harmonics(const Sequence& s, const std::vector<Eigen::Vector2i>& pixels,
                                           const DecodeOptions& options) {
  if (s.rows.phases.size() < 5) return std::nullopt;
  std::vector<double> ratios;
  for (const Eigen::Vector2i& pixel : pixels) {
    std::vector<double> values;
    bool clipped = false;
    for (const PatternImage* image : s.rows.phases) {
      values.push_back(grey(image->image, pixel));
      clipped |= values.back() >= options.saturated_grey;
    }
    const std::complex<double> first = harmonic(s.rows, values, 1), second = harmonic(s.rows, values, 2);
    if (clipped || std::abs(first) < 4 * options.least_modulation_grey) continue;
    ratios.push_back((second * std::conj(first * first)).real() / std::pow(std::abs(first), 3));
  }
  if (ratios.size() < 20) return std::nullopt;
  const double ratio = std::clamp(median(ratios), -0.3, 0.5);
  return (1 + 2 * ratio) / (1 - ratio);
}

// Phases before and after the lamp's gamma is taken out; θ by least squares, so that phases need not be even.
struct Phase {
  double theta = kNan;
  double amplitude_grey = 0;  // as seen
  double amplitude = 0;       // of the drive, 0.5 when sharp
};

Phase measure_phase(const Direction& d, const Eigen::Vector2i& pixel, double dark, double white, double white_level,
                    double gamma) {
  Eigen::MatrixX3d a(d.phases.size(), 3);
  Eigen::VectorXd drive(d.phases.size()), seen(d.phases.size());
  for (size_t k = 0; k < d.phases.size(); ++k) {
    const auto row = static_cast<Eigen::Index>(k);
    const double phase = d.phases[k]->step.phase_rad;
    a.row(row) << 1, std::cos(phase), -std::sin(phase);
    seen[row] = grey(d.phases[k]->image, pixel);
    const double light = std::max((seen[row] - dark) / (white - dark), 0.0);
    drive[row] = white_level * std::pow(light, 1 / gamma);
  }
  const auto solver = a.colPivHouseholderQr();
  const Eigen::Vector3d fit = solver.solve(drive), grey_fit = solver.solve(seen);
  Phase phase;
  phase.theta = std::atan2(fit[2], fit[1]);
  phase.amplitude = std::hypot(fit[1], fit[2]) / d.phases.front()->step.level;
  phase.amplitude_grey = std::hypot(grey_fit[1], grey_fit[2]);
  return phase;
}

enum class Unread { none, clipped, dark, ambiguous };

// Middle of the code's interval; NaN where a bit that matters cannot be told.
double decode_bits(const Direction& d, const Eigen::Vector2i& pixel, double threshold, double least_difference) {
  unsigned value = 0;
  unsigned previous = 0;
  for (auto bit = d.bits.rbegin(); bit != d.bits.rend(); ++bit) {
    const double plain = grey(*bit->second.first, pixel);
    const double against = bit->second.second ? grey(*bit->second.second, pixel) : threshold;
    // At the edge of its last bits a pixel lies between two intervals, and the phase decides, where there is one.
    if (std::abs(plain - against) < least_difference && (d.phases.empty() || bit->first > d.low_bit + 1)) {
      // The bits below are then known: 1 0 0 … next to an edge. The middle of the edge is the place.
      const double edge = (value * 2.0 + 1) * std::ldexp(1.0, bit->first) - 0.5;
      return edge;
    }
    const unsigned gray = plain > against ? 1U : 0U;
    previous ^= gray;
    value = value * 2 + previous;
  }
  return (value + 0.5) * std::ldexp(1.0, d.low_bit) - 0.5;
}

struct Coordinate {
  double x = kNan;
  double amplitude_grey = 0;
  double contrast = kNan;
  Unread loss = Unread::none;
};

Coordinate decode_direction(const Sequence& s, const Direction& d, const Eigen::Vector2i& pixel,
                            const DecodeOptions& options, double gamma) {
  Coordinate result;
  const double dark = grey(*s.off, pixel), white = grey(*s.white, pixel);
  bool clipped = white >= options.saturated_grey;
  for (const PatternImage* image : d.phases) clipped |= grey(image->image, pixel) >= options.saturated_grey;
  if (clipped) {
    result.loss = Unread::clipped;
    return result;
  }
  if (white - dark < options.least_contrast_grey) {
    result.loss = Unread::dark;
    return result;
  }
  if (d.phases.empty()) {
    result.amplitude_grey = (white - dark) / 2;
    result.x = decode_bits(d, pixel, (dark + white) / 2, 0.12 * (white - dark));
    return result;
  }
  const Phase phase = measure_phase(d, pixel, dark, white, s.white_level, gamma);
  result.amplitude_grey = phase.amplitude_grey;
  result.contrast = 2 * phase.amplitude;
  if (phase.amplitude_grey < options.least_modulation_grey) {
    result.loss = Unread::dark;
    return result;
  }
  const double coarse = decode_bits(d, pixel, (dark + white) / 2, 0.12 * (white - dark));
  const double within = d.first_px + d.period_px * phase.theta / (2 * M_PI);
  const double periods = std::round((coarse - within) / d.period_px);
  result.x = within + periods * d.period_px;
  // Code and phase must point to the same half period.
  if (!(std::abs(result.x - coarse) < 0.4 * d.period_px)) {
    result.x = kNan;
    result.loss = Unread::ambiguous;
  }
  return result;
}

}  // namespace

Decoded decode(const std::vector<PatternImage>& sequence, const std::vector<Eigen::Vector2i>& pixels,
               const DecodeOptions& options) {
  const Sequence s = sort_sequence(sequence);
  Decoded result;
  std::optional<double> gamma = options.gamma;
  if (!gamma) gamma = gamma_from_levels(s, pixels, options);
  if (!gamma) gamma = gamma_from_harmonics(s, pixels, options);
  result.gamma_measured = gamma.has_value() && !options.gamma;
  result.gamma = std::clamp(gamma.value_or(1.0), 0.3, 5.0);
  std::vector<double> blurs;
  for (const Eigen::Vector2i& pixel : pixels) {
    const Coordinate row = decode_direction(s, s.rows, pixel, options, result.gamma);
    const Coordinate column = decode_direction(s, s.columns, pixel, options, result.gamma);
    result.column_row.emplace_back(column.x, row.x);
    result.amplitude.push_back(std::min(row.amplitude_grey, column.amplitude_grey));
    const Unread loss = row.loss != Unread::none ? row.loss : column.loss;
    const double one = 1.0 / static_cast<double>(pixels.size());
    if (loss == Unread::clipped) result.losses.clipped += one;
    if (loss == Unread::dark) result.losses.dark += one;
    if (loss == Unread::ambiguous) result.losses.ambiguous += one;
    for (const auto& [coordinate, direction] : {std::pair(&row, &s.rows), std::pair(&column, &s.columns)})
      if (std::isfinite(coordinate->contrast) && coordinate->contrast > 0)
        blurs.push_back(direction->period_px / (M_PI * std::sqrt(2.0)) *
                        std::sqrt(std::max(-std::log(std::min(coordinate->contrast, 1.0)), 0.0)));
  }
  result.blur_px = blurs.empty() ? 0 : median(blurs);
  return result;
}

}  // namespace selvedge::calib
