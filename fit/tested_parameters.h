// Base parameters of a campaign that also holds material tests: each that a test determines begins at the test's value
// and is drawn to it.
#pragma once

#include <string>
#include <vector>

#include "capture/trial/trial.h"
#include "material_tests/fabric_library.h"
#include "material_tests/fit_tests.h"
#include "model/parameter.h"

namespace selvedge::fit {

struct TestedParameters {
  std::vector<model::Parameter> parameters;
  std::vector<material_tests::KindAnswer> tests;  // empty where the campaign holds none
  std::vector<std::string> remarks;               // what was taken from where
};

// base_parameters(drag). The base has one rigidity and one stiffness for all directions and curvatures: where the tests
// show that there are several, the deviation says so, and rigidity is that half way to the curvature of a bending
// length.
TestedParameters tested_parameters(const trial::Campaign& campaign, model::Drag drag);

// Rigidity begins at that of the library's fabric and is drawn to it, within a factor of two: another fabric, if alike.
// Nothing where a test determines it.
void begin_like(const material_tests::LibraryFabric& fabric, TestedParameters& parameters);

}  // namespace selvedge::fit
