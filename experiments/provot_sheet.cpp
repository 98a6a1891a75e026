#include "experiments/provot_sheet.h"

#include <algorithm>
#include <stdexcept>

#include <Eigen/Geometry>

namespace selvedge::experiments {

namespace {

// Unit normals from the central differences of the grid, one-sided at the rim.
Eigen::Matrix3Xd normals_of(const ProvotScene& s, const Eigen::Matrix3Xd& p) {
  Eigen::Matrix3Xd normal(3, p.cols());
  const auto at = [&](int i, int j) -> Eigen::Vector3d {
    return p.col(std::clamp(j, 0, s.rows - 1) * s.columns + std::clamp(i, 0, s.columns - 1));
  };
  for (int j = 0; j < s.rows; ++j)
    for (int i = 0; i < s.columns; ++i) {
      const Eigen::Vector3d across = at(i + 1, j) - at(i - 1, j), down = at(i, j + 1) - at(i, j - 1);
      normal.col(j * s.columns + i) = across.cross(down).normalized();
    }
  return normal;
}

}  // namespace

ProvotFabric fabric_of(const IsotropicFabric& f) {
  const auto kind = [&](double length_m) { return SpringKind{length_m, f.stiffness_n_m, f.critical_elongation}; };
  return {kind(f.structural_m), kind(f.structural_m), kind(f.shear_m),
          kind(f.shear_m),      kind(f.flexion_m),    kind(f.flexion_m)};
}

std::vector<int> held_points(const ProvotScene& scene) {
  return scene.held.empty() ? std::vector<int>{0, scene.columns - 1} : scene.held;
}

cloth::State level_start(const ProvotScene& scene) {
  cloth::State state;
  state.position.resize(3, scene.columns * scene.rows);
  for (int j = 0; j < scene.rows; ++j)
    for (int i = 0; i < scene.columns; ++i)
      state.position.col(j * scene.columns + i) << i * scene.spacing_m, j * scene.spacing_m, 0;
  state.velocity = Eigen::Matrix3Xd::Zero(3, state.position.cols());
  return state;
}

ProvotSheet::ProvotSheet(const ProvotScene& scene) : scene_(scene) {
  if (scene.columns < 2 || scene.rows < 2) throw std::invalid_argument("ProvotSheet: fewer than 2 x 2 points");
  constexpr int kAcross[6] = {1, 0, 1, -1, 2, 0}, kDown[6] = {0, 1, 1, 1, 0, 2};
  for (int kind = 0; kind < 6; ++kind)
    for (int j = 0; j + kDown[kind] < scene.rows; ++j)
      for (int i = 0; i < scene.columns; ++i) {
        const int other = i + kAcross[kind];
        if (other >= 0 && other < scene.columns)
          springs_.push_back({j * scene.columns + i, (j + kDown[kind]) * scene.columns + other, kind});
      }
  is_held_.assign(static_cast<size_t>(scene.columns * scene.rows), 0);
  for (const int point : held_points(scene)) is_held_.at(static_cast<size_t>(point)) = 1;
}

Eigen::Matrix3Xd ProvotSheet::forces(const ProvotFabric& fabric, const cloth::State& state) const {
  Eigen::Matrix3Xd force = -scene_.damping_kg_s * state.velocity;
  force.colwise() += scene_.mass_kg * scene_.gravity_m_s2;
  for (const Spring& s : springs_) {
    const SpringKind& kind = fabric[static_cast<size_t>(s.kind)];
    const Eigen::Vector3d between = state.position.col(s.second) - state.position.col(s.first);
    const Eigen::Vector3d pull = kind.stiffness_n_m * (1 - kind.length_m / between.norm()) * between;
    force.col(s.first) += pull;
    force.col(s.second) -= pull;
  }
  if (scene_.flow_kg_s != 0) {
    const Eigen::Matrix3Xd normal = normals_of(scene_, state.position);
    for (Eigen::Index i = 0; i < force.cols(); ++i) {
      const Eigen::Vector3d n = normal.col(i);
      force.col(i) += scene_.flow_kg_s * n.dot(scene_.flow_m_s - state.velocity.col(i)) * n;
    }
  }
  return force;
}

void ProvotSheet::shorten(const ProvotFabric& fabric, Eigen::Matrix3Xd& position) const {
  for (const Spring& s : springs_) {
    const SpringKind& kind = fabric[static_cast<size_t>(s.kind)];
    const bool first_held = is_held_[static_cast<size_t>(s.first)],
               second_held = is_held_[static_cast<size_t>(s.second)];
    const double longest = kind.length_m * (1 + kind.critical_elongation);
    const Eigen::Vector3d between = position.col(s.second) - position.col(s.first);
    const double length = between.norm();
    if (length <= longest || (first_held && second_held)) continue;
    const Eigen::Vector3d excess = (1 - longest / length) * between;
    const double first_share = first_held ? 0 : second_held ? 1 : 0.5;
    position.col(s.first) += first_share * excess;
    position.col(s.second) -= (1 - first_share) * excess;
  }
}

void ProvotSheet::advance(const ProvotFabric& fabric, cloth::State& state) const {
  const double h = scene_.step_s;
  Eigen::Matrix3Xd velocity = state.velocity + h / scene_.mass_kg * forces(fabric, state);
  for (Eigen::Index i = 0; i < velocity.cols(); ++i)
    if (is_held_[static_cast<size_t>(i)]) velocity.col(i).setZero();
  Eigen::Matrix3Xd next = state.position + h * velocity;
  shorten(fabric, next);
  state.velocity = (next - state.position) / h;
  state.position = std::move(next);
  state.time_s += h;
}

std::vector<cloth::State> ProvotSheet::run(const ProvotFabric& fabric, const cloth::State& start, int steps) const {
  std::vector<cloth::State> states;
  cloth::State now = start;
  for (int k = 0; k < steps; ++k) {
    advance(fabric, now);
    states.push_back(now);
  }
  return states;
}

}  // namespace selvedge::experiments
