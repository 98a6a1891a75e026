#include "material_tests/answer.h"

#include <cmath>
#include <stdexcept>

namespace selvedge::material_tests {

const Determined& named(const Answer& answer, const std::string& parameter) {
  for (const Determined& p : answer.parameters)
    if (p.name == parameter) return p;
  throw std::out_of_range("named: found no parameter " + parameter);
}

std::pair<double, double> interval_of(const Answer& answer, size_t parameter) {
  const auto at = static_cast<Eigen::Index>(parameter);
  const Determined& p = answer.parameters[parameter];
  const double half = 1.645 * std::sqrt(answer.covariance(at, at));
  return p.logarithmic ? std::pair{p.value * std::exp(-half), p.value * std::exp(half)}
                       : std::pair{p.value - half, p.value + half};
}

}  // namespace selvedge::material_tests
