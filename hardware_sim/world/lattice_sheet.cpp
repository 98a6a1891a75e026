#include "hardware_sim/world/lattice_sheet.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "geometry/grip.h"
#include "hardware_sim/world/lattice_kernels.h"

namespace selvedge::hardware_sim {

const std::vector<FabricParameter>& fabric_parameters() {
  using T = FabricTruth;
  static const std::vector<FabricParameter> all = {
      {"stretch", "N/m", &T::stretch, 1, 1e5},
      {"shear", "N/m", &T::shear, 0.1, 1e5},
      {"bend", "N·m", &T::bend, 0, 0.1},
      {"stretch_damping", "N·s/m", &T::stretch_damping, 0, 100},
      {"shear_damping", "N·s/m", &T::shear_damping, 0, 100},
      {"bend_damping", "N·m·s", &T::bend_damping, 0, 1},
      {"drag_normal", "kg/m³", &T::drag_normal, 0, 100},
      {"drag_tangent", "kg/(m²·s)", &T::drag_tangent, 0, 100},
      {"drag_fade", "s²/m²", &T::drag_fade, 0, 100},
  };
  return all;
}

namespace {

using lattice::ConstRow;
using lattice::Row;

// Largest step at which symplectic Euler with explicit damping is stable: ω² dt² + 2 γ dt = 4.
double stable_step(double omega2, double gamma) { return (std::sqrt(gamma * gamma + 4 * omega2) - gamma) / omega2; }

}  // namespace

LatticeSheet::LatticeSheet(const FabricTruth& truth, const LatticeOptions& options)
    : truth_(truth), options_(options), columns_(options.cells_across + 1), rows_(options.cells_down + 1),
      hu_(truth.width_m / options.cells_across), hv_(truth.height_m / options.cells_down) {
  const int n = count();
  for (Field* field : {&x_, &v_, &f_})
    for (Plane& plane : field->axis) plane.assign(n, 0.0);
  mass_.resize(n);
  for (int r = 0; r < rows_; ++r)
    for (int c = 0; c < columns_; ++c)
      mass_[r * columns_ + c] =
          truth.density * hu_ * hv_ * (c == 0 || c + 1 == columns_ ? 0.5 : 1) * (r == 0 || r + 1 == rows_ ? 0.5 : 1);
  area_ = mass_;
  for (double& area : area_) area /= truth.density;
  scratch_.assign(9 * (columns_ + 2), 0.0);

  step_s_ = stable_step_s(1);

  grip_change_ = geometry::grip_softness(std::sqrt(hu_ * hv_)) - 1;

  Eigen::Matrix3Xd flat(3, n);
  const auto uv = rest_uv();
  for (int i = 0; i < n; ++i) flat.col(i) = Eigen::Vector3d(uv[i].x(), 0, -uv[i].y());
  set_position(flat);
}

// Shortest waves in the sheet's plane and out of it; rim nodes have half the mass and half the springs. Bending's
// damping acts on second differences in every direction, so what brakes either wave adds up. sharpest: cos²(φ/2) of the
// sharpest turning angle; κ = 2 tan(φ/2)/h stiffens by the square of that, and its own second derivative adds twice as
// much.
double LatticeSheet::stable_step_s(double sharpest) const {
  const double h = std::min(hu_, hv_), h2 = h * h, h4 = h2 * h2;
  const double bend = truth_.bend * (sharpest < 1 ? 3 / (sharpest * sharpest) : 1);
  const double omega2 = (4 * (truth_.stretch + truth_.shear) / h2 + 64 * bend / h4) / truth_.density;
  const double gamma =
      (4 * (truth_.stretch_damping + truth_.shear_damping) / h2 + 64 * truth_.bend_damping / h4) / truth_.density;
  return options_.step_share * step_share_ * stable_step(omega2, gamma);
}

// cos²(φ/2) of the sharpest turning angle of the lattice's lines, as the bending energy has it: ½ (1 + e·g/h²), at
// most 1.
double LatticeSheet::sharpest_crease() const {
  double least = 2;
  const auto turn = [&](size_t i, size_t next, double h) {
    double dot = 0;
    for (const Plane& x : x_.axis) dot += (x[i + next] - x[i]) * (x[i + 2 * next] - x[i + next]);
    least = std::min(least, 1 + dot / (h * h));
  };
  for (int r = 0; r < rows_; ++r)
    for (int c = 0; c < columns_; ++c) {
      const size_t i = static_cast<size_t>(r) * static_cast<size_t>(columns_) + static_cast<size_t>(c);
      if (c + 2 < columns_) turn(i, 1, hu_);
      if (r + 2 < rows_) turn(i, static_cast<size_t>(columns_), hv_);
    }
  return std::max(0.5 * least, 0.01);
}

std::vector<Eigen::Vector2d> LatticeSheet::rest_uv() const {
  std::vector<Eigen::Vector2d> uv;
  for (int r = 0; r < rows_; ++r)
    for (int c = 0; c < columns_; ++c) uv.emplace_back(c * hu_, r * hv_);
  return uv;
}

std::vector<std::array<int, 3>> LatticeSheet::triangles() const {
  std::vector<std::array<int, 3>> result;
  for (int r = 0; r + 1 < rows_; ++r)
    for (int c = 0; c + 1 < columns_; ++c) {
      const int i = r * columns_ + c;
      result.push_back({i, i + columns_, i + 1});
      result.push_back({i + 1, i + columns_, i + columns_ + 1});
    }
  return result;
}

void LatticeSheet::hang(const Eigen::Vector3d& left, const Eigen::Vector3d& right, const Eigen::Vector3d& side) {
  const Eigen::Vector3d span = right - left;
  const double slack = std::max(0.0, truth_.width_m - span.norm());
  // A sine bulge of this height takes up the slack of the top edge.
  const double bulge = 2 / M_PI * std::sqrt(slack * truth_.width_m);
  const Eigen::Vector3d across = (side - side.dot(span) / span.squaredNorm() * span).normalized();
  const Eigen::Vector3d down = options_.gravity_m_s2.normalized();
  Eigen::Matrix3Xd position(3, count());
  for (int r = 0; r < rows_; ++r)
    for (int c = 0; c < columns_; ++c) {
      const double u = double(c) / (columns_ - 1);
      position.col(r * columns_ + c) =
          left + u * span + std::sin(M_PI * u) * bulge * (0.8 * across + 0.6 * down) + r * hv_ * down;
    }
  set_position(position);
  set_velocity(Eigen::Matrix3Xd::Zero(3, count()));
}

void LatticeSheet::hang_unstrained(const Eigen::Vector3d& left, const Eigen::Vector3d& right,
                                   const Eigen::Vector3d& side) {
  const Eigen::Vector3d span = right - left, along = span.normalized(), down = options_.gravity_m_s2.normalized();
  const Eigen::Vector3d across = (side - side.dot(along) * along - side.dot(down) * down).normalized();
  constexpr int kPieces = 2000;
  // Length of the sine of height `bulge` up to each of its pieces' ends.
  const auto lengths = [&](double bulge) {
    std::vector<double> length(kPieces + 1, 0.0);
    for (int i = 1; i <= kPieces; ++i) {
      const double slope = bulge * M_PI * std::cos(M_PI * (i - 0.5) / kPieces);
      length[i] = length[i - 1] + std::hypot(span.norm(), slope) / kPieces;
    }
    return length;
  };
  double low = 0, high = truth_.width_m;
  for (int i = 0; i < 60; ++i) (lengths(0.5 * (low + high)).back() < truth_.width_m ? low : high) = 0.5 * (low + high);
  const std::vector<double> length = lengths(low);
  Eigen::Matrix3Xd position(3, count());
  for (int c = 0; c < columns_; ++c) {
    const double wanted = length.back() * c / (columns_ - 1);
    const auto next =
        std::clamp<std::ptrdiff_t>(std::lower_bound(length.begin(), length.end(), wanted) - length.begin(), 1, kPieces);
    const double u =
        (static_cast<double>(next) - (length[next] - wanted) / (length[next] - length[next - 1])) / kPieces;
    for (int r = 0; r < rows_; ++r)
      position.col(r * columns_ + c) = left + u * span + std::sin(M_PI * u) * low * across + r * hv_ * down;
  }
  set_position(position);
  set_velocity(Eigen::Matrix3Xd::Zero(3, count()));
}

void LatticeSheet::set_position(const Eigen::Matrix3Xd& position) {
  for (int a = 0; a < 3; ++a)
    for (int i = 0; i < count(); ++i) x_.axis[a][i] = position(a, i);
}

void LatticeSheet::set_velocity(const Eigen::Matrix3Xd& velocity) {
  for (int a = 0; a < 3; ++a)
    for (int i = 0; i < count(); ++i) v_.axis[a][i] = velocity(a, i);
}

Eigen::Matrix3Xd LatticeSheet::position() const {
  Eigen::Matrix3Xd result(3, count());
  for (int a = 0; a < 3; ++a)
    for (int i = 0; i < count(); ++i) result(a, i) = x_.axis[a][i];
  return result;
}

Eigen::Matrix3Xd LatticeSheet::velocity() const {
  Eigen::Matrix3Xd result(3, count());
  for (int a = 0; a < 3; ++a)
    for (int i = 0; i < count(); ++i) result(a, i) = v_.axis[a][i];
  return result;
}

void LatticeSheet::forces() {
  const auto row = [&](const Field& field, int r, int c = 0) {
    const size_t at = size_t(r) * columns_ + c;
    return ConstRow{&field.axis[0][at], &field.axis[1][at], &field.axis[2][at]};
  };
  const auto force = [&](int r, int c = 0) {
    const size_t at = size_t(r) * columns_ + c;
    return Row{&f_.axis[0][at], &f_.axis[1][at], &f_.axis[2][at]};
  };
  for (Plane& plane : f_.axis) std::fill(plane.begin(), plane.end(), 0.0);

  const double cell = hu_ * hv_;
  double* scratch = scratch_.data();
  double* out[9];
  for (int k = 0; k < 9; ++k) out[k] = scratch + k * (columns_ + 2);
  // Node k of the triple at place i of a line goes to row_of(k), column i + column_of(k).
  const auto add = [&](int k, int r, int c, int n) {
    for (int a = 0; a < 3; ++a) {
      double* f = &f_.axis[a][size_t(r) * columns_ + c];
      for (int i = 0; i < n; ++i) f[i] += out[3 * k + a][i];
    }
  };
  for (int r = 0; r < rows_; ++r) {
    const double share = r == 0 || r + 1 == rows_ ? 0.5 : 1;
    lattice::edges_along(row(x_, r), row(v_, r), force(r), columns_, hu_, cell * share, truth_.stretch,
                         truth_.stretch_damping, scratch);
    lattice::bends(row(x_, r), row(v_, r), row(x_, r, 1), row(v_, r, 1), row(x_, r, 2), row(v_, r, 2), out,
                   columns_ - 2, hu_, cell * share, truth_.bend, truth_.bend_damping);
    for (int k = 0; k < 3; ++k) add(k, r, k, columns_ - 2);
    const int above = std::max(0, r - 1), below = std::min(rows_ - 1, r + 1);
    if (r + 1 < rows_) {
      lattice::edges_across(row(x_, r), row(v_, r), force(r), row(x_, r + 1), row(v_, r + 1), force(r + 1), columns_,
                            hv_, cell, 0.5, truth_.stretch, truth_.stretch_damping);
      lattice::cells(row(x_, r), row(v_, r), force(r), row(x_, r + 1), row(v_, r + 1), force(r + 1), columns_, hu_, hv_,
                     truth_.shear, truth_.shear_damping, truth_.bend, truth_.bend_damping, scratch);
    }
    if (r + 2 < rows_) {
      lattice::bends(row(x_, r), row(v_, r), row(x_, r + 1), row(v_, r + 1), row(x_, r + 2), row(v_, r + 2), out,
                     columns_, hv_, cell, truth_.bend, truth_.bend_damping);
      for (double* plane : out) {  // the two side edges own half the area
        plane[0] *= 0.5;
        plane[columns_ - 1] *= 0.5;
      }
      for (int k = 0; k < 3; ++k) add(k, r + k, 0, columns_);
    }
    for (int c = 0; c < columns_; ++c) scratch[c] = area_[size_t(r) * columns_ + c];
    lattice::drag(row(x_, r), row(x_, above), row(x_, below), row(v_, r), force(r), columns_, scratch,
                  options_.air_m_s.data(), truth_.drag_normal, truth_.drag_tangent, truth_.drag_fade);
  }
  // What the two held cells' stretch and shear differ by from the others'.
  const double stretch = grip_change_ * truth_.stretch, stretch_damping = grip_change_ * truth_.stretch_damping;
  for (const int c : {0, columns_ - 2}) {
    for (const int r : {0, 1})
      lattice::edges_along(row(x_, r, c), row(v_, r, c), force(r, c), 2, hu_, 0.5 * cell, stretch, stretch_damping,
                           scratch);
    lattice::edges_across(row(x_, 0, c), row(v_, 0, c), force(0, c), row(x_, 1, c), row(v_, 1, c), force(1, c), 2, hv_,
                          cell, 0.5, stretch, stretch_damping);
    lattice::cells(row(x_, 0, c), row(v_, 0, c), force(0, c), row(x_, 1, c), row(v_, 1, c), force(1, c), 2, hu_, hv_,
                   grip_change_ * truth_.shear, grip_change_ * truth_.shear_damping, 0, 0, scratch);
  }
}

LatticeView LatticeSheet::view() {
  LatticeView out{columns_, rows_, hu_, hv_, time_s_, &truth_, {}, {}, {}, mass_.data(), options_.gravity_m_s2};
  for (size_t a = 0; a < 3; ++a) {
    out.x[a] = x_.axis[a].data();
    out.v[a] = v_.axis[a].data();
    out.f[a] = f_.axis[a].data();
  }
  return out;
}

void LatticeSheet::add_extra(std::shared_ptr<LatticeExtra> extra, double step_share) {
  extra->begin(view());
  step_share_ *= step_share;
  step_s_ = stable_step_s(1);
  extras_.push_back(std::move(extra));
}

void LatticeSheet::step(double dt, double brake, bool held) {
  forces();
  for (const auto& extra : extras_) extra->add(view(), dt);
  time_s_ += dt;
  const double keep = std::exp(-brake * dt);
  const int n = count();
  for (int a = 0; a < 3; ++a) {
    const double g = options_.gravity_m_s2[a];
    double* v = v_.axis[a].data();
    const double* f = f_.axis[a].data();
    double* x = x_.axis[a].data();
    const double left = v[0], right = v[columns_ - 1];
    for (int i = 0; i < n; ++i) v[i] = keep * (v[i] + dt * (f[i] / mass_[i] + g));
    if (held) {
      v[0] = left;
      v[columns_ - 1] = right;
    }
    for (int i = 0; i < n; ++i) x[i] += dt * v[i];
  }
}

// In equal steps; in parts of them from where the lattice was seen to be sharply creased.
void LatticeSheet::steps(double duration_s, double brake, bool held) {
  constexpr int kLook = 2;        // steps from one look to the next
  constexpr double kSharp = 0.8;  // a turn of 53 degrees
  const int count = std::max(1, static_cast<int>(std::ceil(duration_s / step_s_)));
  const double dt = duration_s / count;
  int parts = 1;
  for (int i = 0; i < count; ++i) {
    if (i % kLook == 0 || parts > 1) {
      const double sharpest = sharpest_crease();
      parts = sharpest < kSharp ? static_cast<int>(std::ceil(dt / stable_step_s(sharpest))) : 1;
    }
    for (int k = 0; k < parts; ++k) step(dt / parts, brake, held);
  }
}

void LatticeSheet::advance(double duration_s, const Eigen::Vector3d& left_end, const Eigen::Vector3d& right_end,
                           double brake) {
  for (int a = 0; a < 3; ++a) {
    v_.axis[a][0] = (left_end[a] - x_.axis[a][0]) / duration_s;
    v_.axis[a][columns_ - 1] = (right_end[a] - x_.axis[a][columns_ - 1]) / duration_s;
  }
  steps(duration_s, brake, true);
}

void LatticeSheet::advance_free(double duration_s) { steps(duration_s, 0, false); }

Eigen::Matrix3Xd LatticeSheet::internal_forces() {
  forces();
  Eigen::Matrix3Xd result(3, count());
  for (int a = 0; a < 3; ++a)
    for (int i = 0; i < count(); ++i) result(a, i) = f_.axis[a][i];
  return result;
}

LatticeEnergy LatticeSheet::energy() const {
  const Eigen::Matrix3Xd x = position(), v = velocity();
  const auto at = [&](int c, int r) { return Eigen::Vector3d(x.col(r * columns_ + c)); };
  const double cell = hu_ * hv_;
  LatticeEnergy e;
  const auto strain = [](const Eigen::Vector3d& edge, double h) { return 0.5 * (edge.squaredNorm() / (h * h) - 1); };
  const auto turn2 = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b, double h) {
    return (2 * a.cross(b) / (h * h + a.dot(b))).squaredNorm() / (h * h);
  };
  for (int r = 0; r < rows_; ++r)
    for (int c = 0; c < columns_; ++c) {
      const double side_u = r == 0 || r + 1 == rows_ ? 0.5 : 1, side_v = c == 0 || c + 1 == columns_ ? 0.5 : 1;
      // Shares of the cells above and below an edge, left and right of it, and of the cell itself.
      const auto held = [&](int column, int row) {
        return row == 0 && (column == 0 || column + 2 == columns_) ? 0.5 * grip_change_ : 0;
      };
      const double along = side_u + held(c, r) + held(c, r - 1), across = side_v + held(c, r) + held(c - 1, r);
      if (c + 1 < columns_)
        e.stretch += 0.5 * truth_.stretch * std::pow(strain(at(c + 1, r) - at(c, r), hu_), 2) * cell * along;
      if (r + 1 < rows_)
        e.stretch += 0.5 * truth_.stretch * std::pow(strain(at(c, r + 1) - at(c, r), hv_), 2) * cell * across;
      if (c + 2 < columns_)
        e.bend += 0.5 * truth_.bend * turn2(at(c + 1, r) - at(c, r), at(c + 2, r) - at(c + 1, r), hu_) * cell * side_u;
      if (r + 2 < rows_)
        e.bend += 0.5 * truth_.bend * turn2(at(c, r + 1) - at(c, r), at(c, r + 2) - at(c, r + 1), hv_) * cell * side_v;
      if (c + 1 < columns_ && r + 1 < rows_) {
        const Eigen::Vector3d a = 0.5 / hu_ * (at(c + 1, r) - at(c, r) + at(c + 1, r + 1) - at(c, r + 1));
        const Eigen::Vector3d b = 0.5 / hv_ * (at(c, r + 1) - at(c, r) + at(c + 1, r + 1) - at(c + 1, r));
        const Eigen::Vector3d twist = (at(c, r) - at(c + 1, r) - at(c, r + 1) + at(c + 1, r + 1)) / cell;
        e.shear += 0.5 * truth_.shear * std::pow(a.dot(b), 2) * cell * (1 + 2 * held(c, r));
        e.bend += truth_.bend * twist.squaredNorm() * cell;
      }
      const int i = r * columns_ + c;
      e.kinetic += 0.5 * mass_[i] * v.col(i).squaredNorm();
      e.weight -= mass_[i] * options_.gravity_m_s2.dot(x.col(i));
    }
  return e;
}

}  // namespace selvedge::hardware_sim
