// The one table of the base model's parameters. Everything that names, reads, writes, bounds or fits one reads it here:
// a parameter more is one row, its physics and its test (docs/adding-a-parameter.md).
#pragma once

#include <string>
#include <vector>

#include "cloth/material.h"

namespace selvedge::cloth {

struct MaterialParameter {
  const char* name;  // of the exchange format
  const char* unit;
  double Material::*member;           // where it lives
  double usual;                       // where a search begins that knows no better; Material's default where it has one
  double lower, upper;                // bounds of a fit
  double stated_lower, stated_upper;  // what a file may say that describes a fabric
  double prior_sd = 2.5;              // of ln(value) about where a fit begins: a factor of 12
  bool at_rest = true;                // false: it acts on motion alone, where the fabric hangs does not depend on it
  bool shows_soon = false;            // the beginning of a motion determines it
  std::vector<double> tried = {};     // by a coarse search for where to begin; empty: it stays at its usual value
};

// Membrane, bending, damping, drag; in the order in which fits report them.
const std::vector<MaterialParameter>& material_parameters();

// Throws std::out_of_range where none is called so.
const MaterialParameter& material_parameter(const std::string& name);

}  // namespace selvedge::cloth
