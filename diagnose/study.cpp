#include "diagnose/study.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace selvedge::diagnose {

std::vector<model::Parameter> base_of(const Study& study) {
  return {study.parameters.begin(), study.parameters.begin() + static_cast<std::ptrdiff_t>(study.base_count)};
}

bool has_markers(const std::vector<model::ObservedTrial>& trials) {
  return std::any_of(trials.begin(), trials.end(), [](const model::ObservedTrial& t) { return t.markers.has_value(); });
}

bool is_of_clock(const model::Parameter& parameter) {
  return parameter.name == "delay" || parameter.name == "delay_per_second";
}

std::vector<size_t> found_with_base(const Study& study) {
  std::vector<size_t> out;
  for (size_t e = 0; e < study.effects.size(); ++e)
    for (size_t k = 0; k < study.effects[e].parameters.size(); ++k) {
      const model::Parameter& p = study.effects[e].parameters[k];
      const double neutral = model::to_coordinate(p, p.start);
      if (!is_of_clock(p) && study.base(static_cast<Eigen::Index>(study.first_parameter[e] + k)) == neutral) continue;
      out.push_back(e);
      break;
    }
  return out;
}

std::vector<model::Parameter> smooth_forces(const Protocol& protocol) {
  std::vector<model::Parameter> out;
  const auto waves = static_cast<int>(protocol.force_waves);
  for (int u = 0; u < waves; ++u)
    for (int v = 0; v < waves; ++v)
      for (int axis = 0; axis < 3; ++axis) {
        const double falls = std::exp(-0.5 * protocol.force_smoothness * (u * u + v * v));
        const auto apply = [=, share = protocol.force_share](model::Prediction& p, double value) {
          if (value == 0) return;
          cloth::Experiment& e = p.experiment;
          cloth::SmoothForce force{Eigen::Vector3d::Zero(), u, v};
          force.peak_n_m2(axis) = value * falls * share * e.material.density * e.gravity_m_s2.norm();
          e.smooth_forces.push_back(force);
        };
        out.push_back(effect_parameter(fmt::format("force_{}_{}_{}", "xyz"[axis], u, v), "of its usual size", 0, -1e9,
                                       1e9, 1, apply));
      }
  return out;
}

}  // namespace selvedge::diagnose
