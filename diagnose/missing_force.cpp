#include "diagnose/missing_force.h"

#include <cmath>

#include <nlohmann/json.hpp>

namespace selvedge::diagnose {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr int kAcross = 7;  // places along the width and down the height

nlohmann::json rows(const Eigen::Matrix3Xd& columns) {
  nlohmann::json out = nlohmann::json::array();
  for (Index i = 0; i < columns.cols(); ++i) out.push_back({columns(0, i), columns(1, i), columns(2, i)});
  return out;
}

}  // namespace

MissingForce missing_force(const Study& study, const Windows& windows, const Evidence& evidence, const Arm& arm,
                           size_t scale) {
  const model::ObservedTrial& first = study.simulation->trials().front();
  MissingForce out;
  for (int v = 0; v < kAcross; ++v)
    for (int u = 0; u < kAcross; ++u)
      out.uv_m.emplace_back((u + 0.5) * first.width_m / kAcross, (v + 0.5) * first.height_m / kAcross);
  model::Prediction p;
  p.experiment = first.experiment;
  for (size_t k = study.first_force; k < study.parameters.size(); ++k) study.parameters[k].apply(p, 1);
  const std::vector<cloth::SmoothForce>& forces = p.experiment.smooth_forces;
  const VectorXd left = arm.residual + arm.changes * posterior_of(study, evidence, arm, scale).mean;
  for (size_t w = 0; w < windows.windows().size(); ++w) {
    const Window& window = windows.windows()[w];
    const double s = evidence.scale_in(w, scale);
    // The model's residual is what it has too much of: the force that it lacks is the other way.
    const Evidence::Forces found = evidence.forces_in(w, -left.segment(window.first, window.count), scale);
    MissingForce::Window here{study.simulation->trials()[window.trial].name, window.from_s, window.to_s,
                              Eigen::Matrix3Xd::Zero(3, static_cast<Index>(out.uv_m.size())),
                              Eigen::Matrix3Xd::Zero(3, static_cast<Index>(out.uv_m.size()))};
    for (size_t i = 0; i < out.uv_m.size(); ++i) {
      const auto place = static_cast<Index>(i);
      Eigen::Matrix3Xd each(3, static_cast<Index>(forces.size()));
      for (size_t k = 0; k < forces.size(); ++k)
        each.col(static_cast<Index>(k)) = s * forces[k].at(out.uv_m[i], first.width_m, first.height_m);
      const auto count = static_cast<Index>(forces.size());
      here.mean_n_m2.col(place) = each * found.mean.head(count);
      here.sd_n_m2.col(place) =
          (each * found.covariance.topLeftCorner(count, count) * each.transpose()).diagonal().cwiseSqrt();
    }
    out.windows.push_back(std::move(here));
  }
  return out;
}

nlohmann::json to_json(const MissingForce& force) {
  nlohmann::json grid = nlohmann::json::array(), windows = nlohmann::json::array();
  for (const Eigen::Vector2d& uv : force.uv_m) grid.push_back({uv.x(), uv.y()});
  for (const MissingForce::Window& w : force.windows)
    windows.push_back({{"trial", w.trial},
                       {"from_s", w.from_s},
                       {"to_s", w.to_s},
                       {"mean_n_m2", rows(w.mean_n_m2)},
                       {"sd_n_m2", rows(w.sd_n_m2)}});
  return {{"format", "missing_force/1"}, {"grid_uv_m", grid}, {"windows", windows}};
}

}  // namespace selvedge::diagnose
