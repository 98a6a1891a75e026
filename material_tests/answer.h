// What a material test says of its fabric: a Gaussian over some of the parameters of cloth/material.h, and what it
// rests on.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

namespace selvedge::material_tests {

// A parameter by the name that it has in cloth::Material and in fit.json.
struct Determined {
  std::string name, unit;
  double value = 0;
  bool logarithmic = true;  // its deviation is one of ln(value); else of the value itself
};

// A figure that labs report of such a test and that is no parameter: bending length, drape coefficient.
struct Reported {
  std::string name, unit;
  double value = 0, sd = 0;
};

struct TestError {
  std::string trial, unit;
  double rms = 0;    // of what was measured less what the fit gives
  double noise = 0;  // of a repeated measurement, where that is known; else 0
  size_t samples = 0;
};

struct Answer {
  std::vector<Determined> parameters;
  Eigen::MatrixXd covariance;  // of ln(value) or of the value, as `logarithmic` says; in the parameters' order
  std::vector<Reported> reported;
  std::vector<TestError> errors;
  std::vector<std::string> remarks;                           // a sentence each, without its full stop
  std::vector<std::pair<std::string, std::string>> pictures;  // SVG and caption: measured beside simulated
};

// Throws std::out_of_range where the test does not determine it.
const Determined& named(const Answer& answer, const std::string& parameter);

// 90 % interval of the parameter in its own unit.
std::pair<double, double> interval_of(const Answer& answer, size_t parameter);

}  // namespace selvedge::material_tests
