#include "cloth/branches.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

#include <Eigen/Geometry>

#include "cloth/energy.h"
#include "cloth/surface_point.h"

namespace selvedge::cloth {

namespace {

double rms_m(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b) {
  return std::sqrt((a - b).colwise().squaredNorm().mean());
}

// A smooth random displacement: waves of up to three half lengths along the fabric, none at the held top edge's
// ends, each half as high as the next longer one.
Eigen::Matrix3Xd random_displacement(const Sheet& sheet, double amplitude_m, std::mt19937& random) {
  std::normal_distribution<double> normal;
  Eigen::Matrix3Xd out = Eigen::Matrix3Xd::Zero(3, sheet.data.vertex_count);
  for (int i = 1; i <= 3; ++i)
    for (int j = 0; j <= 3; ++j) {
      const Eigen::Vector3d direction =
          std::pow(0.5, i + j) * Eigen::Vector3d(normal(random), normal(random), normal(random));
      const double phase = 3 * normal(random);
      for (Eigen::Index k = 0; k < out.cols(); ++k) {
        const Eigen::Vector2d& uv = sheet.mesh.rest_uv[static_cast<size_t>(k)];
        const double u = uv.x() / sheet.mesh.width_m, v = uv.y() / sheet.mesh.height_m;
        out.col(k) += (std::sin(M_PI * i * u) + v * std::cos(M_PI * i * u + phase)) *
                      std::cos(M_PI * j * v + (j ? phase : 0)) * direction;
      }
    }
  return out * (amplitude_m / std::sqrt(out.colwise().squaredNorm().mean()));
}

std::vector<Experiment> starts_of(const Sheet& sheet, const Experiment& experiment, const BranchOptions& options) {
  std::mt19937 random(options.seed);
  std::vector<Experiment> starts;
  const Eigen::Matrix3Xd sides[2] = {hung_shape(sheet, experiment, 1), hung_shape(sheet, experiment, -1)};
  const auto add = [&](const Eigen::Matrix3Xd& shape) {
    starts.push_back(experiment);
    starts.back().start_shape = shape;
  };
  add(sides[0]);
  add(sides[1]);
  if (experiment.start_shape.cols() == sides[0].cols()) add(experiment.start_shape);
  while (static_cast<int>(starts.size()) < options.starts)
    add(sides[starts.size() % 2] + random_displacement(sheet, options.amplitude_m, random));
  return starts;
}

Eigen::Matrix3Xd mirrored(const Eigen::Matrix3Xd& x, const Eigen::Vector3d& on_plane, const Eigen::Vector3d& normal) {
  const Eigen::RowVectorXd height = normal.transpose() * (x.colwise() - on_plane);
  return x - 2 * normal * height;
}

// Positions at (width − u, v).
Eigen::Matrix3Xd turned_over(const Sheet& sheet, const Eigen::Matrix3Xd& x) {
  Eigen::Matrix3Xd out(3, x.cols());
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    const Eigen::Vector2d& uv = sheet.mesh.rest_uv[static_cast<size_t>(i)];
    out.col(i) = position_of(surface_point(sheet, {sheet.mesh.width_m - uv.x(), uv.y()}), x);
  }
  return out;
}

// Mirror images of the branches found, in the upright plane through the corners, in that between them, and in
// both: where fabric and rig are symmetric they are branches too.
std::vector<Experiment> mirror_starts(const Sheet& sheet, const Experiment& experiment,
                                      const std::vector<Branch>& branches) {
  const Eigen::Matrix<double, 3, 2> corners = experiment.path.at(experiment.start_s);
  const Eigen::Vector3d along = (corners.col(1) - corners.col(0)).normalized(), middle = corners.rowwise().mean();
  const Eigen::Vector3d out = along.cross(experiment.gravity_m_s2).normalized();
  std::vector<Experiment> starts;
  for (const Branch& b : branches) {
    const Eigen::Matrix3Xd front = mirrored(b.position, middle, out);
    for (const Eigen::Matrix3Xd& shape : {front, mirrored(turned_over(sheet, b.position), middle, along),
                                          mirrored(turned_over(sheet, front), middle, along)}) {
      starts.push_back(experiment);
      starts.back().start_shape = shape;
    }
  }
  return starts;
}

void collect(const Sheet& sheet, const std::vector<Experiment>& starts, const BranchOptions& options,
             std::vector<Branch>& branches) {
  for (const Rest& rest : relax(sheet, starts, options.relaxation)) {
    if (!rest.at_rest || !rest.position.allFinite()) continue;
    const auto known = std::find_if(branches.begin(), branches.end(), [&](const Branch& b) {
      return rms_m(b.position, rest.position) < options.alike_m;
    });
    if (known != branches.end()) {
      ++known->starts;
      continue;
    }
    const Eigen::Matrix3Xd still = Eigen::Matrix3Xd::Zero(3, rest.position.cols());
    const Energy energy = energy_of(sheet, starts[0].material, starts[0].gravity_m_s2, rest.position, still);
    branches.push_back({rest.position, energy.potential(), 1});
  }
}

}  // namespace

std::vector<Branch> find_branches(const Sheet& sheet, const Experiment& experiment, const BranchOptions& options) {
  std::vector<Branch> branches;
  collect(sheet, starts_of(sheet, experiment, options), options, branches);
  if (!branches.empty()) collect(sheet, mirror_starts(sheet, experiment, branches), options, branches);
  std::sort(branches.begin(), branches.end(),
            [](const Branch& a, const Branch& b) { return a.potential_j < b.potential_j; });
  return branches;
}

SeenBranch branch_seen(const Sheet& sheet, const std::vector<Branch>& branches, const std::vector<Eigen::Vector2d>& uv,
                       const Eigen::Matrix3Xd& seen) {
  std::vector<SurfacePoint> points;
  for (const Eigen::Vector2d& at : uv) points.push_back(surface_point(sheet, at));
  SeenBranch best{0, std::numeric_limits<double>::infinity()};
  for (size_t b = 0; b < branches.size(); ++b) {
    double sum = 0;
    int count = 0;
    for (size_t k = 0; k < uv.size(); ++k) {
      const Eigen::Vector3d at = seen.col(static_cast<Eigen::Index>(k));
      if (!at.allFinite()) continue;
      sum += (position_of(points[k], branches[b].position) - at).squaredNorm();
      ++count;
    }
    const double distance = count ? std::sqrt(sum / count) : std::numeric_limits<double>::infinity();
    if (distance < best.distance_m) best = {b, distance};
  }
  if (!std::isfinite(best.distance_m))
    throw std::invalid_argument("branch_seen: no branch, or no point of the fabric is seen");
  return best;
}

}  // namespace selvedge::cloth
