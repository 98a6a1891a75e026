#include "hardware_sim/world/sheet_grip.h"

#include <algorithm>
#include <cmath>

namespace selvedge::hardware_sim {

namespace {

// ∫ of each node's function, and of it times x, over the first x = 0 … 1 grips of a line.
struct Moments {
  std::vector<double> zeroth, first;
};

Moments moments_at_start(const std::vector<double>& nodes, const ValueAt& value) {
  Moments m{std::vector<double>(nodes.size(), 0.0), std::vector<double>(nodes.size(), 0.0)};
  constexpr double place[3] = {-0.7745966692414834, 0, 0.7745966692414834}, share[3] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
  for (size_t cell = 0; nodes[cell] < kGrip_m - 1e-12; ++cell) {
    const double length = std::min(nodes[cell + 1], kGrip_m) - nodes[cell];
    for (int g = 0; g < 3; ++g) {
      const double at = nodes[cell] + 0.5 * length * (1 + place[g]), w = share[g] * length / kGrip_m;
      const std::vector<double> of = value(at);
      for (size_t i = 0; i < of.size(); ++i) {
        m.zeroth[i] += w * of[i];
        m.first[i] += w * of[i] * at / kGrip_m;
      }
    }
  }
  return m;
}

}  // namespace

void SheetGrip::set_responses(const double* mass_kg) {
  double sum = 0;
  response.clear();
  for (size_t i = 0; i < node.size(); ++i) {
    response.push_back(weight[i] / mass_kg[node[i]]);
    sum += weight[i] * response[i];
  }
  for (double& r : response) r /= sum;
}

// Over the unit square, 7 − 6a − 6b takes from a function the value at (0, 0) of the plane nearest to it.
SheetGrip corner_grip(const std::vector<double>& u_nodes, const ValueAt& u_value, const std::vector<double>& v_nodes,
                      const ValueAt& v_value, bool right) {
  constexpr double kNothing = 1e-14;
  const Moments u = moments_at_start(u_nodes, u_value), v = moments_at_start(v_nodes, v_value);
  const int columns = static_cast<int>(u_nodes.size()), rows = static_cast<int>(v_nodes.size());
  SheetGrip grip;
  grip.along = right ? 1 : 0;
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) {
      const auto i = static_cast<size_t>(c), k = static_cast<size_t>(r);
      const double w = 7 * u.zeroth[i] * v.zeroth[k] - 6 * u.first[i] * v.zeroth[k] - 6 * u.zeroth[i] * v.first[k];
      if (std::abs(w) < kNothing) continue;
      grip.node.push_back(r * columns + (right ? columns - 1 - c : c));
      grip.weight.push_back(w);
    }
  return grip;
}

}  // namespace selvedge::hardware_sim
