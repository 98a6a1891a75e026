#include "cloth/spline/lane_run.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <Eigen/Dense>

#include "cloth/kernel/vertex_parts.h"
#include "cloth/spline/damped_inertia.h"

namespace selvedge::cloth::spline {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

bool is_uneven(const Material& m) { return m.hem_density != 0 || m.local_mass_kg != 0; }

bool bends_otherwise(const Material& m) {
  return m.bend_stiffening != 0 || m.hem_stiffness != 0 || m.rest_curvature_u != 0 || m.rest_curvature_v != 0 ||
         m.bend_friction != 0;
}

bool stretch_remembers(const Material& m) { return m.stretch_friction != 0 || m.creep != 0; }

// All rows of the kernels' table, in their order.
std::vector<double> numbers_of(const Experiment& e) {
  const Material& m = e.material;
  const double ku = m.stretch * std::exp(m.stretch_anisotropy), kv = m.stretch * std::exp(-m.stretch_anisotropy);
  std::vector<double> row(kernel::kRows);
  row[kernel::kStretchU] = ku;
  row[kernel::kStretchV] = kv;
  row[kernel::kCoupling] = m.coupling * std::sqrt(ku * kv);
  row[kernel::kStiffening] = std::max(0.0, m.stretch_stiffening);
  row[kernel::kSoftening] = std::max(0.0, -m.stretch_stiffening);
  row[kernel::kShear] = m.shear;
  row[kernel::kStretchDamping] = m.stretch_damping;
  row[kernel::kShearDamping] = m.shear_damping;
  row[kernel::kBendUU] = m.bend * std::exp(m.bend_anisotropy);
  row[kernel::kBendUV] = m.bend;
  row[kernel::kBendVV] = m.bend * std::exp(-m.bend_anisotropy);
  row[kernel::kBendDamping] = m.bend_damping;
  row[kernel::kBendStiffening] = m.bend_stiffening;
  row[kernel::kRestU] = m.rest_curvature_u;
  row[kernel::kRestV] = m.rest_curvature_v;
  row[kernel::kDragNormal] = m.drag_normal;
  row[kernel::kDragTangent] = m.drag_tangent;
  row[kernel::kDragFade] = m.drag_fade;
  row[kernel::kDragLinear] = m.drag_linear;
  row[kernel::kInverseDensity] = 1 / m.density;
  row[kernel::kStretchFriction] = m.stretch_friction;
  row[kernel::kStretchFrictionSlope] = m.stretch_friction / m.stretch_friction_strain;
  row[kernel::kBendFriction] = m.bend_friction;
  row[kernel::kBendFrictionSlope] = m.bend_friction / m.bend_friction_curvature;
  row[kernel::kCreep] = m.creep;
  row[kernel::kCreepRate] = 1 / m.creep_time_s;
  for (int a = 0; a < 3; ++a) {
    row[static_cast<size_t>(kernel::kGravityX + a)] = e.gravity_m_s2(a);
    row[static_cast<size_t>(kernel::kAirX + a)] = e.air_velocity_m_s(a);
  }
  return row;
}

}  // namespace

int extras_of(const Material& m) {
  return 8 * (m.bend_friction != 0 || stretch_remembers(m)) + 4 * bends_otherwise(m) + 2 * (m.added_mass != 0) +
         is_uneven(m);
}

VectorXd areas(const SplineSheet& sheet) {
  return (sheet.u.mass.rowwise().sum() * sheet.v.mass.rowwise().sum().transpose()).reshaped();
}

Eigen::Matrix3Xd smooth_forces_on(const SplineSheet& sheet, const Experiment& e) {
  if (e.smooth_forces.empty()) return {};
  const std::vector<Eigen::Vector2d> points = greville_points(sheet);
  const VectorXd area = areas(sheet);
  Eigen::Matrix3Xd out = Eigen::Matrix3Xd::Zero(3, sheet.count());
  for (const SmoothForce& f : e.smooth_forces)
    for (Index p = 0; p < area.size(); ++p)
      out.col(p) += area(p) * f.at(points[static_cast<size_t>(p)], sheet.swatch.width_m, sheet.swatch.height_m);
  return out;
}

VectorXd densities(const SplineSheet& sheet, const Material& m) {
  const std::vector<Eigen::Vector2d> points = greville_points(sheet);
  const VectorXd area = areas(sheet);
  VectorXd density(sheet.count()), share(sheet.count());
  for (Index i = 0; i < density.size(); ++i) {
    const Eigen::Vector2d& uv = points[static_cast<size_t>(i)];
    density(i) = m.density + m.hem_density * cloth::kernel::hem_share(rim_distance(sheet.swatch, uv), m.hem_width_m);
    // A weight is a Gaussian of 12 mm, as on triangles.
    share(i) = std::exp(-(uv - Eigen::Vector2d(m.local_u_m, m.local_v_m)).squaredNorm() / (2 * 0.012 * 0.012));
  }
  if (m.local_mass_kg != 0) density += m.local_mass_kg / std::max(share.dot(area), 1e-300) * share;
  return density;
}

template <class T>
LaneRun<T>::LaneRun(const SplineSheet& sheet, const std::vector<const Experiment*>& lanes)
    : sheet_(sheet), kernels_(kernel::kernels_for<T>(static_cast<int>(lanes.size()))),
      width_(static_cast<size_t>(kernels_.lanes)), asked_(lanes.size()), u_(sheet.u), v_(sheet.v),
      grips_(grips_of(sheet, lanes[0]->path.hold)) {
  const size_t points = static_cast<size_t>(sheet.count());
  material_.resize(kernel::kRows * width_);
  for (Aligned<T>* field : {&x_, &v_half_, &force_, &acceleration_, &change_[0], &change_[1], &change_[2]})
    field->assign(3 * points * width_, T(0));
  run_.u = u_.tables();
  run_.v = v_.tables();
  scratch_.assign(static_cast<size_t>(kernel::scratch_size(run_, kernels_.lanes)), T(0));
  bool uneven = false, carries_air = false;
  for (const Experiment* e : lanes) {
    const Material& m = e->material;
    carries_air = carries_air || m.added_mass != 0;
    uneven = uneven || is_uneven(m);
    run_.uses_moments = run_.uses_moments || bends_otherwise(m);
    run_.uses_normals = run_.uses_normals || m.bend_friction != 0 || m.rest_curvature_u != 0 || m.rest_curvature_v != 0;
  }
  const size_t rule = u_.first.size() * v_.first.size();
  for (const Experiment* e : lanes) {
    if (e->material.hem_stiffness != 0) bend_factor_.assign(rule * width_, T(1));
    if (e->material.bend_friction != 0) bend_memory_.assign(rule * width_ * kernel::kBendMemory, T(0));
    if (stretch_remembers(e->material)) membrane_memory_.assign(rule * width_ * kernel::kMembraneMemory, T(0));
  }
  if (uneven) mass_scale_.assign(points * width_, T(1));
  if (carries_air) {
    air_share_.assign(points * width_, T(0));
    air_.assign(3 * points * width_, T(0));
  }
  for (size_t i = 0; i < width_; ++i) {
    const Experiment& e = *lanes[std::min(i, lanes.size() - 1)];
    materials_.push_back(e.material);
    fill_material(i, e);
  }
  held_position_.assign(grips_.size() * 3 * width_, T(0));
  held_velocity_ = held_position_;
  point_at_memory();
}

template <class T>
void LaneRun<T>::point_at_memory() {
  const auto start = [](Aligned<T>& field) { return field.empty() ? nullptr : field.data(); };
  run_.material = material_.data();
  run_.mass_scale = start(mass_scale_);
  run_.air_share = start(air_share_);
  run_.air = start(air_);
  run_.bend_factor = start(bend_factor_);
  run_.x = x_.data();
  run_.v_half = v_half_.data();
  run_.force = force_.data();
  run_.acceleration = acceleration_.data();
  for (int k = 0; k < 3; ++k) run_.change[k] = change_[k].data();
  run_.scratch = scratch_.data();
  run_.membrane_memory = start(membrane_memory_);
  run_.bend_memory = start(bend_memory_);
  run_.held.count = static_cast<int>(grips_.size());
  run_.held.reads_start = reads_start_.data();
  run_.held.reads_point = reads_point_.data();
  run_.held.reads_weight = reads_weight_.data();
  run_.held.moves_start = moves_start_.data();
  run_.held.moves_point = moves_point_.data();
  run_.held.moves_weight = moves_weight_.data();
  run_.held.position = held_position_.data();
  run_.held.velocity = held_velocity_.data();
  run_.inverse_u = start(inverse_u_);
  run_.inverse_v = start(inverse_v_);
  run_.mu = mu_.data();
  run_.nu = nu_.data();
  run_.gain = gain_.data();
  run_.kept = run_.stages > 1 ? kept_.data() : nullptr;
}

template <class T>
void LaneRun<T>::fill_material(size_t lane, const Experiment& e) {
  const std::vector<double> row = numbers_of(e);
  for (size_t r = 0; r < row.size(); ++r) material_[r * width_ + lane] = static_cast<T>(row[r]);
  if (!bend_factor_.empty()) fill_bend_factor(lane, e.material);
}

template <class T>
void LaneRun<T>::fill_bend_factor(size_t lane, const Material& m) {
  size_t point = 0;
  for (const double v : sheet_.v.rule.at)
    for (const double u : sheet_.u.rule.at) {
      const double share = cloth::kernel::hem_share(rim_distance(sheet_.swatch, {u, v}), m.hem_width_m);
      bend_factor_[point++ * width_ + lane] = static_cast<T>(1 + m.hem_stiffness * share);
    }
}

template <class T>
Inertia LaneRun<T>::inertia_of(size_t lane, double step_s) const {
  const Material& m = materials_[lane];
  const double damping = step_s * m.bend_damping / m.density;
  Inertia inertia{damped_inverse(sheet_.u, damping), damped_inverse(sheet_.v, damping), {}};
  if (!mass_scale_.empty()) inertia.scale = (m.density * densities(sheet_, m).cwiseInverse()).cwiseSqrt();
  return inertia;
}

template <class T>
void LaneRun<T>::fill_air(size_t lane) {
  const VectorXd density = densities(sheet_, materials_[lane]);
  const auto share = [&](Index p) { return 1 - 1 / std::sqrt(1 + materials_[lane].added_mass / density(p)); };
  for (Index p = 0; p < density.size(); ++p)
    air_share_[static_cast<size_t>(p) * width_ + lane] = static_cast<T>(share(p));
  for (const Grip& grip : grips_)
    for (const Weight& w : grip.reads) air_share_[static_cast<size_t>(w.point) * width_ + lane] = T(0);
}

template <class T>
void LaneRun<T>::fill_inverses(const std::vector<Inertia>& lanes) {
  Index reach = 0;
  for (const Inertia& lane : lanes) reach = std::max({reach, reach_of(lane.inverse_u), reach_of(lane.inverse_v)});
  const auto fill = [&](Eigen::MatrixXd Inertia::*side, Aligned<T>& to) {
    const Index count = (lanes.front().*side).rows(), band = 2 * reach + 1;
    to.assign(static_cast<size_t>(count * band) * width_, T(0));
    for (size_t lane = 0; lane < width_; ++lane)
      for (Index i = 0; i < count; ++i)
        for (Index j = std::max<Index>(0, i - reach); j <= std::min(count - 1, i + reach); ++j)
          to[static_cast<size_t>(i * band + reach + j - i) * width_ + lane] = static_cast<T>((lanes[lane].*side)(i, j));
  };
  fill(&Inertia::inverse_u, inverse_u_);
  fill(&Inertia::inverse_v, inverse_v_);
  run_.inverse_reach = static_cast<int>(reach);
}

template <class T>
void LaneRun<T>::fill_grips(const std::vector<Inertia>& lanes) {
  reads_start_ = moves_start_ = {0};
  reads_point_.clear(), reads_weight_.clear(), moves_point_.clear(), moves_weight_.clear();
  std::vector<std::vector<std::vector<Weight>>> moves;
  for (const Inertia& lane : lanes) moves.push_back(responses(sheet_, grips_, lane));
  for (size_t k = 0; k < grips_.size(); ++k) {
    for (const Weight& w : grips_[k].reads) {
      reads_point_.push_back(w.point);
      reads_weight_.push_back(static_cast<T>(w.weight));
    }
    reads_start_.push_back(static_cast<int>(reads_point_.size()));
    std::map<int, std::vector<double>> moved;
    for (size_t i = 0; i < lanes.size(); ++i)
      for (const Weight& w : moves[i][k]) {
        std::vector<double>& of = moved[w.point];
        of.resize(lanes.size());
        of[i] = w.weight;
      }
    for (const auto& [point, of] : moved) {
      moves_point_.push_back(point);
      for (size_t i = 0; i < width_; ++i) moves_weight_.push_back(static_cast<T>(of[i]));
    }
    moves_start_.push_back(static_cast<int>(moves_point_.size()));
  }
}

template <class T>
void LaneRun<T>::plan(double step_s, const cloth::kernel::DampingStages& stages) {
  std::vector<Inertia> inertias;
  const bool damped =
      std::any_of(materials_.begin(), materials_.end(), [](const Material& m) { return m.bend_damping != 0; });
  for (size_t i = 0; i < width_; ++i) {
    // Lanes beyond those asked for repeat the last.
    inertias.push_back(i < asked_ ? inertia_of(i, step_s) : inertias.back());
    for (Index p = 0; p < inertias[i].scale.size(); ++p)
      mass_scale_[static_cast<size_t>(p) * width_ + i] = static_cast<T>(inertias[i].scale(p));
    if (!air_share_.empty()) fill_air(i);
  }
  if (damped) fill_inverses(inertias);
  fill_grips(inertias);
  run_.step_s = static_cast<T>(step_s);
  run_.stages = stages.count;
  mu_.assign(stages.mu, stages.mu + stages.count);
  nu_.assign(stages.nu, stages.nu + stages.count);
  gain_.assign(stages.gain, stages.gain + stages.count);
  if (stages.count > 1) kept_.assign(9 * u_.first.size() * v_.first.size() * width_, T(0));
  point_at_memory();
}

template <class T>
Eigen::Matrix3Xd LaneRun<T>::columns(const Aligned<T>& field, size_t lane) const {
  Eigen::Matrix3Xd out(3, sheet_.count());
  for (size_t a = 0; a < 3; ++a)
    for (size_t p = 0; p < static_cast<size_t>(sheet_.count()); ++p)
      out(static_cast<Index>(a), static_cast<Index>(p)) = static_cast<double>(field[index(a, p, lane)]);
  return out;
}

template <class T>
void LaneRun<T>::set(Aligned<T>& field, size_t lane, const Eigen::Matrix3Xd& control) {
  for (size_t a = 0; a < 3; ++a)
    for (size_t p = 0; p < static_cast<size_t>(sheet_.count()); ++p)
      field[index(a, p, lane)] = static_cast<T>(control(static_cast<Index>(a), static_cast<Index>(p)));
}

template <class T>
void LaneRun<T>::stop() {
  std::fill(v_half_.begin(), v_half_.end(), T(0));
}

template <class T>
void LaneRun<T>::set_forces(double memory_step_s) {
  run_.memory_step_s = static_cast<T>(memory_step_s);
  kernels_.forces(run_);
}

template <class T>
void LaneRun<T>::push(size_t lane, int point, const Eigen::Vector3d& force_n) {
  for (size_t a = 0; a < 3; ++a)
    force_[index(a, static_cast<size_t>(point), lane)] += static_cast<T>(force_n(static_cast<Index>(a)));
}

template <class T>
void LaneRun<T>::hold(size_t lane, const HeldPath& path, const Eigen::Matrix<double, 3, 2>& begin,
                      const Eigen::Matrix<double, 3, 2>& end) {
  for (size_t k = 0; k < grips_.size(); ++k) {
    const Eigen::Vector3d from = spline::held_position(grips_[k], path, begin),
                          to = spline::held_position(grips_[k], path, end);
    for (size_t a = 0; a < 3; ++a) {
      const size_t at = (3 * k + a) * width_ + lane;
      held_position_[at] = static_cast<T>(from(static_cast<Index>(a)));
      held_velocity_[at] = static_cast<T>((to - from)(static_cast<Index>(a)) / static_cast<double>(run_.step_s));
    }
  }
}

template class LaneRun<float>;
template class LaneRun<double>;

}  // namespace selvedge::cloth::spline
