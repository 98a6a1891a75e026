#include "hardware_sim/sheets/swatch_sheet.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

namespace selvedge::hardware_sim {

namespace {

std::vector<double> sine_lengths(double span_m, double bulge_m) {
  constexpr int kPieces = 2000;
  std::vector<double> length(kPieces + 1, 0.0);
  for (int i = 1; i <= kPieces; ++i)
    length[static_cast<size_t>(i)] =
        length[static_cast<size_t>(i) - 1] +
        std::hypot(span_m, bulge_m * M_PI * std::cos(M_PI * (i - 0.5) / kPieces)) / kPieces;
  return length;
}

}  // namespace

HungCurve::HungCurve(const Eigen::Vector3d& left, const Eigen::Vector3d& right, const Eigen::Vector3d& side,
                     const Eigen::Vector3d& gravity, double width_m)
    : left_(left), span_(right - left), down_(gravity.normalized()), width_m_(width_m) {
  const Eigen::Vector3d along = span_.normalized();
  down_ = (down_ - down_.dot(along) * along).normalized();
  across_ = (side - side.dot(along) * along - side.dot(down_) * down_).normalized();
  double low = 0, high = width_m;
  for (int i = 0; i < 60; ++i)
    (sine_lengths(span_.norm(), 0.5 * (low + high)).back() < width_m ? low : high) = 0.5 * (low + high);
  bulge_m_ = low;
  length_m_ = sine_lengths(span_.norm(), low);
}

Eigen::Vector3d HungCurve::at(double u_m, double v_m) const {
  const double wanted = length_m_.back() * u_m / width_m_;
  const auto pieces = static_cast<std::ptrdiff_t>(length_m_.size()) - 1;
  const auto next = std::clamp<std::ptrdiff_t>(
      std::lower_bound(length_m_.begin(), length_m_.end(), wanted) - length_m_.begin(), 1, pieces);
  const double to = length_m_[static_cast<size_t>(next)], from = length_m_[static_cast<size_t>(next) - 1];
  const double share = (static_cast<double>(next) - (to - wanted) / (to - from)) / static_cast<double>(pieces);
  return left_ + share * span_ + std::sin(M_PI * share) * bulge_m_ * across_ + v_m * down_;
}

void hang(SwatchSheet& sheet, const HungCurve& curve) {
  const std::vector<Eigen::Vector2d> uv = sheet.rest_uv();
  Eigen::Matrix3Xd nodes(3, static_cast<Eigen::Index>(uv.size()));
  for (size_t i = 0; i < uv.size(); ++i) nodes.col(static_cast<Eigen::Index>(i)) = curve.at(uv[i].x(), uv[i].y());
  sheet.place(nodes);
}

void lie_as(SwatchSheet& sheet, const SwatchSheet& other) { sheet.place(other.points(sheet.rest_uv())); }

void settle(SwatchSheet& sheet, const Eigen::Vector3d& left, const Eigen::Vector3d& right) {
  constexpr double kLook_s = 0.004, kBraked_s = 0.4, kLongest_s = 3;
  constexpr int kStops = 60;
  sheet.advance(kBraked_s, left, right, 20);
  sheet.stop();
  double before = 0;
  int stops = 0;
  for (double time_s = 0; time_s < kLongest_s && stops < kStops; time_s += kLook_s) {
    sheet.advance(kLook_s, left, right, 0);
    const double now = sheet.kinetic_energy();
    if (now < before) {
      sheet.stop();
      ++stops;
      before = 0;
    } else {
      before = now;
    }
  }
  sheet.stop();
}

}  // namespace selvedge::hardware_sim
