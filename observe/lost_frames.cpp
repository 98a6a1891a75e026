#include "observe/lost_frames.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include <Eigen/QR>

#include "geometry/order_statistics.h"

namespace selvedge::observe {

using Eigen::Index;
using Eigen::Matrix3Xd;
using Eigen::MatrixXd;

namespace {

constexpr double kEven = 0.2;    // of the usual time between stamps
constexpr Index kEachSide = 4;   // frames that are looked at
constexpr Index kPowers = 5;     // of time, that a coordinate follows over them
constexpr double kMostLost = 3;  // at once
// In variances of the noise: by so much more do coordinates follow powers of time where a frame is taken to be missing.
// Where none is they follow them less, by 30 to 140 of these where it is seen at all; noise turns a few.
constexpr double kTold = 40;
constexpr double kMoreTold = 12;  // where several are, against fewer

struct Frames {
  std::vector<double> time_s;  // ascending
  std::vector<Matrix3Xd> position;
};

Frames by_time(const trial::Markers& m) {
  std::map<int, Index> row;
  for (const int id : m.marker) row.emplace(id, static_cast<Index>(row.size()));
  std::map<double, Matrix3Xd> at;
  for (size_t i = 0; i < m.marker.size(); ++i) {
    const auto [frame, is_new] = at.try_emplace(m.time_s[i]);
    if (is_new)
      frame->second = Matrix3Xd::Constant(3, static_cast<Index>(row.size()), std::numeric_limits<double>::quiet_NaN());
    frame->second.col(row.at(m.marker[i])) = m.position.col(static_cast<Index>(i));
  }
  Frames out;
  for (auto& [t, position] : at) {
    out.time_s.push_back(t);
    out.position.push_back(std::move(position));
  }
  return out;
}

// Takes away what follows powers of time over frames between whose halves so many are missing.
MatrixXd beside_powers(double missing) {
  constexpr Index kFrames = 2 * kEachSide;
  MatrixXd powers(kFrames, kPowers);
  for (Index i = 0; i < kFrames; ++i) {
    const double t = (static_cast<double>(i - kEachSide) + 0.5 + (i < kEachSide ? 0 : missing)) / kEachSide;
    for (Index p = 0; p < kPowers; ++p) powers(i, p) = std::pow(t, p);
  }
  const MatrixXd q = Eigen::HouseholderQR<MatrixXd>(powers).householderQ() * MatrixXd::Identity(kFrames, kPowers);
  return MatrixXd::Identity(kFrames, kFrames) - q * q.transpose();
}

// The coordinates of markers that are seen in all frames from `first` on, a row a frame.
MatrixXd coordinates(const Frames& f, size_t first) {
  std::vector<Index> seen;
  for (Index j = 0; j < f.position[first].cols(); ++j) {
    bool always = true;
    for (Index i = 0; i < 2 * kEachSide; ++i)
      always = always && f.position[first + static_cast<size_t>(i)].col(j).allFinite();
    if (always) seen.push_back(j);
  }
  MatrixXd out(2 * kEachSide, 3 * static_cast<Index>(seen.size()));
  for (Index i = 0; i < 2 * kEachSide; ++i)
    out.row(i) = f.position[first + static_cast<size_t>(i)](Eigen::all, seen).reshaped().transpose();
  return out;
}

// How many frames are missing in the middle of these.
struct Missing {
  double count = 0, told = 0;
};

Missing missing_in(const MatrixXd& x, double noise_m) {
  static const std::vector<MatrixXd> beside = [] {
    std::vector<MatrixXd> out;
    for (double missing = 0; missing <= kMostLost; ++missing) out.push_back(beside_powers(missing));
    return out;
  }();
  std::vector<double> left;
  for (const MatrixXd& b : beside) left.push_back((b * x).squaredNorm() / (noise_m * noise_m));
  const double least = *std::min_element(left.begin() + 1, left.end()),
               noise = static_cast<double>(x.cols() * (2 * kEachSide - kPowers));
  for (size_t k = 1; k < left.size(); ++k) {
    const double told = left[0] - left[k];
    if (left[k] < least + kMoreTold && told > kTold && told > left[k] - noise) return {static_cast<double>(k), told};
  }
  return {};
}

}  // namespace

std::vector<LostFrames> lost_frames(const trial::Markers& markers, double noise_m) {
  const Frames f = by_time(markers);
  std::vector<double> intervals;
  for (size_t k = 1; k < f.time_s.size(); ++k) intervals.push_back(f.time_s[k] - f.time_s[k - 1]);
  if (intervals.size() < 2 * kEachSide) return {};
  const double usual_s = geometry::median(intervals);
  std::vector<LostFrames> out;
  double told = 0;
  for (size_t first = 0; first + 2 * kEachSide <= f.time_s.size(); ++first) {
    const auto begin = intervals.begin() + static_cast<std::ptrdiff_t>(first);
    if (!std::all_of(begin, begin + 2 * kEachSide - 1,
                     [&](double s) { return std::abs(s - usual_s) < kEven * usual_s; }))
      continue;
    const Missing missing = missing_in(coordinates(f, first), noise_m);
    if (missing.count == 0) continue;
    const LostFrames here{f.time_s[first + kEachSide - 1], f.time_s[first + kEachSide], missing.count};
    const bool is_same = !out.empty() && here.from_s - out.back().from_s < kEachSide * usual_s;
    if (is_same && missing.told <= told) continue;
    if (is_same) out.back() = here;
    else out.push_back(here);
    told = missing.told;
  }
  return out;
}

double StampDrift::shown_at(double stamp_s) const {
  if (each_s <= 0) return stamp_s - per_s * (stamp_s - from_s);
  double out = stamp_s;
  for (const LostFrames& l : lost)
    out -= per_s * each_s * l.count * std::clamp((stamp_s - l.from_s) / (l.to_s - l.from_s), 0.0, 1.0);
  return out;
}

double StampDrift::stamp_of(double shown_s) const {
  if (each_s <= 0) return (shown_s - per_s * from_s) / (1 - per_s);
  constexpr double kLeast_s = 1e-6;
  double stamp = shown_s;
  for (const LostFrames& l : lost) {
    if (stamp <= l.from_s) break;
    const double late_s = per_s * each_s * l.count, between = l.to_s - l.from_s,
                 shown = std::max(between - late_s, kLeast_s);
    stamp = stamp < l.from_s + shown ? l.from_s + (stamp - l.from_s) / shown * between : stamp + late_s;
  }
  return stamp;
}

}  // namespace selvedge::observe
