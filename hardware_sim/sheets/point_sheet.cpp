#include "hardware_sim/sheets/point_sheet.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <Eigen/Geometry>

namespace selvedge::hardware_sim {

using Eigen::Index;
using Eigen::MatrixX3d;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

constexpr double kLag_s = 2e-3, kBendLag_s = 1e-3;  // of dashpots behind their springs
constexpr double kSlidingGrading = 0.4;             // elements have their nodes nearer to each other at their ends
constexpr int kSlidingCells = 32, kElements = 8;
constexpr int kDragEvery = 4;                   // leaps
constexpr double kLeap = 2, kRungeKutta = 2.7;  // of 1/ω: what the step may be
constexpr double kStepShare = 0.9;

PointLine line_of(PointKind kind, double length_m, double fineness, bool both) {
  const bool sliding = kind == PointKind::sliding;
  const int cells = static_cast<int>(std::lround(fineness * (sliding ? kSlidingCells : kElements)));
  const std::vector<double> ends = graded_places(length_m, cells, sliding ? kSlidingGrading : 0, both);
  return sliding ? sliding_line(ends) : element_line(ends);
}

}  // namespace

PointSheet::PointSheet(PointKind kind, const FabricTruth& truth, const SwatchOptions& options)
    : kind_(kind), truth_(truth), options_(options), grid_(line_of(kind, truth.width_m, options.fineness, true),
                                                           line_of(kind, truth.height_m, options.fineness, false)),
      places_(grid_.u().node, grid_.v().node),
      measure_(kind == PointKind::sliding ? StrainMeasure::biot : StrainMeasure::hencky), at_(grid_.make_fields()),
      pulls_(grid_.make_fields()) {
  const Index n = count();
  x_ = v_ = drag_ = bent_before_ = bent_lag_ = bent_lag_now_ = MatrixX3d::Zero(n, 3);
  area_.resize(n);
  for (Index i = 0; i < n; ++i)
    area_(i) = grid_.u().node_weight[static_cast<size_t>(i % grid_.columns())] *
               grid_.v().node_weight[static_cast<size_t>(i / grid_.columns())];
  mass_ = truth.density * area_;
  for (PointStrain* s : {&along_, &down_, &shear_}) {
    s->strain.assign(grid_.points(), 0.0f);
    s->stress.assign(grid_.points(), 0.0f);
  }
  for (int k = 0; k < 3; ++k) before_[k] = lag_[k] = lag_now_[k] = std::vector<float>(grid_.points(), 0.0f);
  make_grips();
  step_s_ = stable_step_s();
  MatrixX3d flat(n, 3);
  for (Index i = 0; i < n; ++i)
    flat.row(i) << grid_.u().node[static_cast<size_t>(i % grid_.columns())], 0,
        -grid_.v().node[static_cast<size_t>(i / grid_.columns())];
  set_position(flat);
}

void PointSheet::make_grips() {
  const PointLine &u = grid_.u(), &v = grid_.v();
  if (options_.hold == SwatchHold::top_edge) {
    for (int c = 0; c < grid_.columns(); ++c)
      grips_.push_back({{c}, {1.0}, {}, u.node[static_cast<size_t>(c)] / truth_.width_m, Vector3d::Zero()});
  } else {
    const auto value_on = [](const PointLine& line) { return [&line](double place) { return line.value_at(place); }; };
    for (const bool right : {false, true})
      grips_.push_back(corner_grip(u.node, value_on(u), v.node, value_on(v), right));
  }
  set_responses();
}

void PointSheet::set_responses() {
  for (SheetGrip& grip : grips_) grip.set_responses(mass_.data());
}

// What grips hold gets their velocity, or none.
void PointSheet::hold(MatrixX3d& of, bool at_rest) const {
  for (const SheetGrip& grip : grips_) {
    Eigen::RowVector3d lacks = at_rest ? Eigen::RowVector3d::Zero() : Eigen::RowVector3d(grip.velocity.transpose());
    for (size_t i = 0; i < grip.node.size(); ++i) lacks -= grip.weight[i] * of.row(grip.node[i]);
    for (size_t i = 0; i < grip.node.size(); ++i) of.row(grip.node[i]) += grip.response[i] * lacks;
  }
}

void PointSheet::stress_of(PointStrain& strain, std::vector<float>& before, std::vector<float>& lag,
                           std::vector<float>& lag_now, double stiffness, double viscosity, double since_s) const {
  const auto k = static_cast<float>(stiffness);
  if (since_s <= 0) {
    for (size_t i = 0; i < strain.strain.size(); ++i) strain.stress[i] = k * strain.strain[i] + lag[i];
    lag_now = lag;
    return;
  }
  const double decay = std::exp(-since_s / kLag_s);
  const auto stays = static_cast<float>(decay), gain = static_cast<float>(viscosity / since_s * (1 - decay));
  for (size_t i = 0; i < strain.strain.size(); ++i) {
    const float e = strain.strain[i], m = stays * lag[i] + gain * (e - before[i]);
    lag_now[i] = m;
    strain.stress[i] = k * e + m;
  }
}

// The fabric's curvatures, without the dashpots, and what effects add to bending's pulls.
void PointSheet::add_moments() {
  if (std::none_of(effects_.begin(), effects_.end(), [](const auto& e) { return e->bends(); })) return;
  PointFields curved = grid_.make_fields();
  grid_.look(place_, place_, curved);
  const int n = grid_.v().points();
  PointStrain along{std::vector<float>(grid_.points()), std::vector<float>(grid_.points(), 0.0f)}, down = along;
  std::vector<Eigen::Vector3f> normal(grid_.points());
  const auto read = [&](const std::vector<float>& field, size_t p, size_t q) {
    const float* at = &field[3 * p * static_cast<size_t>(n) + q];
    return Eigen::Vector3f(at[0], at[n], at[2 * n]);
  };
  const auto rows = static_cast<size_t>(n), count = grid_.points() / rows;
  for (size_t p = 0; p < count; ++p)
    for (size_t q = 0; q < rows; ++q) {
      const size_t i = p * rows + q;
      normal[i] = read(curved.a, p, q).cross(read(curved.b, p, q)).normalized();
      along.strain[i] = read(curved.uu, p, q).dot(normal[i]);
      down.strain[i] = read(curved.vv, p, q).dot(normal[i]);
    }
  const PointView view{&grid_, &truth_, since_kept_s_};
  for (const auto& effect : effects_) effect->moment(view, along, down);
  for (size_t p = 0; p < count; ++p)
    for (size_t q = 0; q < rows; ++q) {
      const size_t i = p * rows + q;
      for (int a = 0; a < 3; ++a) {
        const size_t k = 3 * p * rows + static_cast<size_t>(a) * rows + q;
        pulls_.uu[k] += grid_.weight()[i] * along.stress[i] * normal[i](a);
        pulls_.vv[k] += grid_.weight()[i] * down.stress[i] * normal[i](a);
      }
    }
}

void PointSheet::elastic(const MatrixX3d& x, double since_s, MatrixX3d& force) {
  const Index columns = grid_.columns(), rows = grid_.rows();
  const Eigen::RowVector3d origin = x.colwise().mean();
  place_.resize(static_cast<size_t>(3 * count()));
  bent_.resize(place_.size());
  since_kept_s_ = since_s;
  const bool moves = since_s > 0;
  const double decay = moves ? std::exp(-since_s / kBendLag_s) : 1;
  const double gain = moves ? truth_.bend_damping / since_s * (1 - decay) : 0;
  bent_lag_now_ = decay * bent_lag_ + gain * (x - bent_before_);
  for (Index r = 0; r < rows; ++r)
    for (Index a = 0; a < 3; ++a)
      for (Index c = 0; c < columns; ++c) {
        const auto k = static_cast<size_t>((3 * r + a) * columns + c);
        const double here = x(r * columns + c, a) - origin(a);
        place_[k] = static_cast<float>(here);
        bent_[k] = static_cast<float>(truth_.bend * here + bent_lag_now_(r * columns + c, a));
      }
  grid_.look(place_, bent_, at_);
  grid_.strain(measure_, at_, along_, down_, shear_);
  stress_of(along_, before_[0], lag_[0], lag_now_[0], truth_.stretch, truth_.stretch_damping, since_s);
  stress_of(down_, before_[1], lag_[1], lag_now_[1], truth_.stretch, truth_.stretch_damping, since_s);
  stress_of(shear_, before_[2], lag_[2], lag_now_[2], truth_.shear, truth_.shear_damping, since_s);
  const PointView view{&grid_, &truth_, since_s};
  for (const auto& effect : effects_) effect->stress(view, along_, down_);
  grid_.pull(measure_, at_, along_, down_, shear_, pulls_);
  grid_.bend(at_, pulls_);
  add_moments();
  grid_.gather(pulls_, force_);
  force.resize(count(), 3);
  for (Index r = 0; r < rows; ++r)
    for (Index a = 0; a < 3; ++a)
      for (Index c = 0; c < columns; ++c)
        force(r * columns + c, a) = static_cast<double>(force_[static_cast<size_t>((3 * r + a) * columns + c)]);
}

// What dashpots and effects remember is as they were last looked at, of nodes at x.
void PointSheet::keep(const MatrixX3d& x) {
  before_[0] = along_.strain;
  before_[1] = down_.strain;
  before_[2] = shear_.strain;
  for (int k = 0; k < 3; ++k) lag_[k].swap(lag_now_[k]);
  bent_before_ = x;
  bent_lag_ = bent_lag_now_;
  for (const auto& effect : effects_) effect->keep();
}

void PointSheet::drag(const MatrixX3d& x, const MatrixX3d& v) {
  const Index columns = grid_.columns(), rows = grid_.rows();
  const LineRows &along = grid_.u().node_slope, &down = grid_.v().node_slope;
  const auto slope = [&](const LineRows& line, Index i, Index start, Index stride) {
    Vector3d sum = Vector3d::Zero();
    const Index first = line.first[static_cast<size_t>(i)];
    for (Index k = 0; k < line.reach; ++k)
      sum += static_cast<double>(line.weight[static_cast<size_t>(i * line.reach + k)]) *
             x.row(start + (first + k) * stride).transpose();
    return sum;
  };
  for (Index r = 0; r < rows; ++r)
    for (Index c = 0; c < columns; ++c) {
      const Index i = r * columns + c;
      const Vector3d n = slope(along, c, r * columns, 1).cross(slope(down, r, c, columns)).normalized();
      const Vector3d w = v.row(i).transpose() - options_.air_m_s;
      const double across = w.dot(n), fade = truth_.drag_fade * across * across;
      const Vector3d slide = w - across * n;
      const double push = kind_ == PointKind::sliding
                              ? std::abs(across) / std::sqrt(1 + 2 * fade)
                              : std::sqrt(across * across + 0.25 * slide.squaredNorm()) / (1 + fade);
      drag_.row(i) = -area_(i) * (truth_.drag_normal * push * across * n + truth_.drag_tangent * slide).transpose();
    }
}

LatticeView PointSheet::view(const MatrixX3d& x, const MatrixX3d& v, MatrixX3d& force) {
  LatticeView out{grid_.columns(), grid_.rows(),         &places_, time_s_, &truth_, {}, {}, {}, mass_.data(),
                  area_.data(),    options_.gravity_m_s2};
  for (Index a = 0; a < 3; ++a) {
    out.x[a] = x.col(a).data();
    out.v[a] = v.col(a).data();
    out.f[a] = force.col(a).data();
  }
  return out;
}

void PointSheet::accelerate(const MatrixX3d& x, const MatrixX3d& v, double since_s, double brake, MatrixX3d& out) {
  elastic(x, since_s, out);
  out += drag_;
  if (!extras_.empty()) {
    const LatticeView seen = view(x, v, out);
    for (const auto& extra : extras_) extra->add(seen, since_s);
  }
  out.array().colwise() /= mass_.array();
  out.rowwise() += options_.gravity_m_s2.transpose();
  if (brake > 0) out -= brake * v;
  hold(out, true);
}

void PointSheet::leap(double dt, double brake) {
  MatrixX3d pull;
  if (since_drag_ == 0) drag(x_, v_);
  since_drag_ = (since_drag_ + 1) % kDragEvery;
  accelerate(x_, v_, dt, brake, pull);
  keep(x_);
  v_ += dt * pull;
  x_ += dt * v_;
  time_s_ += dt;
}

void PointSheet::runge_kutta(double dt, double brake) {
  MatrixX3d a1, a2, a3, a4;
  drag(x_, v_);
  accelerate(x_, v_, dt, brake, a1);
  keep(x_);
  const MatrixX3d v2 = v_ + 0.5 * dt * a1;
  accelerate(x_ + 0.5 * dt * v_, v2, 0.5 * dt, brake, a2);
  const MatrixX3d v3 = v_ + 0.5 * dt * a2;
  accelerate(x_ + 0.5 * dt * v2, v3, 0.5 * dt, brake, a3);
  const MatrixX3d v4 = v_ + dt * a3;
  accelerate(x_ + dt * v3, v4, dt, brake, a4);
  x_ += dt / 6 * (v_ + 2 * v2 + 2 * v3 + v4);
  v_ += dt / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
  time_s_ += dt;
}

void PointSheet::advance(double duration_s, const Vector3d& left_end, const Vector3d& right_end, double brake) {
  for (SheetGrip& grip : grips_) {
    Vector3d here = Vector3d::Zero();
    for (size_t i = 0; i < grip.node.size(); ++i) here += grip.weight[i] * x_.row(grip.node[i]).transpose();
    grip.velocity = (left_end + grip.along * (right_end - left_end) - here) / duration_s;
  }
  hold(v_, false);
  const int steps = std::max(1, static_cast<int>(std::ceil(duration_s / step_s_)));
  for (int i = 0; i < steps; ++i)
    kind_ == PointKind::sliding ? leap(duration_s / steps, brake) : runge_kutta(duration_s / steps, brake);
}

void PointSheet::stop() {
  v_.setZero();
  since_drag_ = 0;
}

double PointSheet::kinetic_energy() const { return 0.5 * mass_.dot(v_.rowwise().squaredNorm()); }

void PointSheet::set_position(const MatrixX3d& position) {
  x_ = position;
  bent_before_ = position;
  bent_lag_.setZero();
  for (int k = 0; k < 3; ++k) std::fill(lag_[k].begin(), lag_[k].end(), 0.0f);
  MatrixX3d force;
  elastic(position, 0, force);
  keep(position);
  stop();
}

std::vector<Eigen::Vector2d> PointSheet::rest_uv() const {
  std::vector<Eigen::Vector2d> uv;
  for (const double v : grid_.v().node)
    for (const double u : grid_.u().node) uv.emplace_back(u, v);
  return uv;
}

void PointSheet::place(const Eigen::Matrix3Xd& nodes) { set_position(nodes.transpose()); }

Eigen::Matrix3Xd PointSheet::points(const std::vector<Eigen::Vector2d>& uv) const {
  Eigen::Matrix3Xd out(3, static_cast<Index>(uv.size()));
  for (size_t p = 0; p < uv.size(); ++p) {
    const PointLine::Stencil u = grid_.u().stencil_at(uv[p].x()), v = grid_.v().stencil_at(uv[p].y());
    Vector3d sum = Vector3d::Zero();
    for (int r = 0; r <= kDegree; ++r)
      for (int c = 0; c <= kDegree; ++c)
        sum += v.share[0][r] * u.share[0][c] * x_.row((v.first + r) * grid_.columns() + u.first + c).transpose();
    out.col(static_cast<Index>(p)) = sum;
  }
  return out;
}

MatrixX3d PointSheet::elastic_forces() {
  MatrixX3d force;
  elastic(x_, 0, force);
  return force;
}

double PointSheet::elastic_energy() {
  MatrixX3d force;
  elastic(x_, 0, force);
  double sum = 0;
  for (size_t i = 0; i < grid_.points(); ++i) {
    const auto square = [&](const PointStrain& s) { return std::pow(static_cast<double>(s.strain[i]), 2); };
    sum += 0.5 * static_cast<double>(grid_.weight()[i]) *
           (truth_.stretch * (square(along_) + square(down_)) + truth_.shear * square(shear_));
  }
  // Bending is a quadratic form of the place: half of what its own forces do along it.
  const PointFields bare = pulls_;
  for (std::vector<float>* f : {&pulls_.a, &pulls_.b}) std::fill(f->begin(), f->end(), 0.0f);
  grid_.gather(pulls_, force_);
  for (size_t k = 0; k < force_.size(); ++k)
    sum -= 0.5 * static_cast<double>(force_[k]) * static_cast<double>(place_[k]);
  pulls_ = bare;
  return sum;
}

// From the highest frequency of the flat sheet with its dashpots as stiff as the springs behind them, by power
// iteration.
double PointSheet::stable_step_s() {
  const FabricTruth truth = truth_;
  truth_.stretch += truth.stretch_damping / kLag_s;
  truth_.shear += truth.shear_damping / kLag_s;
  truth_.bend += truth.bend_damping / kBendLag_s;
  const std::vector<std::shared_ptr<PointEffect>> effects = std::move(effects_);
  effects_.clear();
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  MatrixX3d flat(count(), 3), moved(count(), 3), force;
  for (Index i = 0; i < count(); ++i)
    flat.row(i) << grid_.u().node[static_cast<size_t>(i % grid_.columns())], 0,
        -grid_.v().node[static_cast<size_t>(i / grid_.columns())];
  for (Index i = 0; i < moved.size(); ++i) moved.data()[i] = normal(random);
  bent_lag_.setZero();
  for (int k = 0; k < 3; ++k) std::fill(lag_[k].begin(), lag_[k].end(), 0.0f);
  MatrixX3d at_rest;
  elastic(flat, 0, at_rest);
  constexpr double kSmall_m = 1e-3;  // large beside the rounding of floats
  double omega2 = 0;
  for (int round = 0; round < 60; ++round) {
    moved /= moved.norm();
    elastic(flat + kSmall_m * moved, 0, force);
    moved = (at_rest - force).array().colwise() / (kSmall_m * mass_).array();
    omega2 = moved.norm();
  }
  truth_ = truth;
  effects_ = effects;
  const double bound = kind_ == PointKind::sliding ? kLeap : kRungeKutta;
  return kStepShare * step_share_ * bound / std::sqrt(omega2);
}

void PointSheet::add(std::shared_ptr<PointEffect> effect, double step_share) {
  effects_.push_back(std::move(effect));
  step_share_ *= step_share;
  step_s_ *= step_share;
}

void PointSheet::add(std::shared_ptr<LatticeExtra> extra, double step_share) {
  MatrixX3d force = MatrixX3d::Zero(count(), 3);
  extra->begin(view(x_, v_, force));
  set_responses();
  extras_.push_back(std::move(extra));
  step_share_ *= step_share;
  const MatrixX3d here = x_;
  step_s_ = stable_step_s();
  set_position(here);
}

}  // namespace selvedge::hardware_sim
