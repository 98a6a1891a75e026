#include "cloth/contact/zones.h"

#include <algorithm>
#include <map>
#include <numeric>

#include <Eigen/Dense>

namespace selvedge::cloth::contact {

Zones::Zones(int vertex_count) : parent_(static_cast<size_t>(vertex_count)) {
  std::iota(parent_.begin(), parent_.end(), 0);
}

void Zones::clear() {
  for (const int v : touched_) parent_[static_cast<size_t>(v)] = v;
  touched_.clear();
}

int Zones::root(int vertex) {
  while (parent_[static_cast<size_t>(vertex)] != vertex) {
    parent_[static_cast<size_t>(vertex)] = parent_[static_cast<size_t>(parent_[static_cast<size_t>(vertex)])];
    vertex = parent_[static_cast<size_t>(vertex)];
  }
  return vertex;
}

bool Zones::join(const NearPair& pair) {
  bool joined = false;
  for (const int v : pair.vertex) {
    touched_.push_back(v);
    const int a = root(pair.vertex[0]), b = root(v);
    if (a == b) continue;
    parent_[static_cast<size_t>(std::max(a, b))] = std::min(a, b);
    joined = true;
  }
  return joined;
}

void Zones::move_one(const std::vector<int>& zone, double step_s, const double* inverse_mass,
                     const Eigen::Matrix3Xd& position, const Eigen::Matrix3Xd& given,
                     Eigen::Matrix3Xd& velocity) const {
  Eigen::Vector3d held = Eigen::Vector3d::Zero(), centre = held, mean = held, spin = held;
  int held_count = 0;
  double mass = 0;
  for (const int v : zone) {
    if (inverse_mass[v] == 0) {
      held += given.col(v);
      ++held_count;
      continue;
    }
    mass += 1 / inverse_mass[v];
    centre += position.col(v) / inverse_mass[v];
    mean += given.col(v) / inverse_mass[v];
  }
  if (mass == 0) return;
  if (held_count > 0) {
    for (const int v : zone)
      if (inverse_mass[v] > 0) velocity.col(v) = held / held_count;
    return;
  }
  centre /= mass;
  mean /= mass;
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
  for (const int v : zone) {
    const Eigen::Vector3d arm = position.col(v) - centre;
    spin += arm.cross(given.col(v)) / inverse_mass[v];
    inertia += (arm.squaredNorm() * Eigen::Matrix3d::Identity() - arm * arm.transpose()) / inverse_mass[v];
  }
  // Vertices on a line have no inertia about it: those axes do not turn.
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(inertia);
  Eigen::Vector3d rate = Eigen::Vector3d::Zero();
  for (int k = 0; k < 3; ++k)
    if (axes.eigenvalues()(k) > 1e-9 * axes.eigenvalues()(2))
      rate += axes.eigenvectors().col(k) * (axes.eigenvectors().col(k).dot(spin) / axes.eigenvalues()(k));
  const double angle = rate.norm() * step_s;
  const Eigen::Matrix3d turn =
      angle > 0 ? Eigen::AngleAxisd(angle, rate.normalized()).toRotationMatrix() : Eigen::Matrix3d::Identity();
  for (const int v : zone) {
    const Eigen::Vector3d arm = position.col(v) - centre;
    velocity.col(v) = mean + (turn * arm - arm) / step_s;
  }
}

void Zones::move_rigidly(double step_s, const double* inverse_mass, const Eigen::Matrix3Xd& position,
                         const Eigen::Matrix3Xd& given, Eigen::Matrix3Xd& velocity) {
  std::sort(touched_.begin(), touched_.end());
  touched_.erase(std::unique(touched_.begin(), touched_.end()), touched_.end());
  std::map<int, std::vector<int>> members;
  for (const int v : touched_) members[root(v)].push_back(v);
  for (const auto& [first, zone] : members) move_one(zone, step_s, inverse_mass, position, given, velocity);
}

}  // namespace selvedge::cloth::contact
