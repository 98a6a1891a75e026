// The kernels of one kind of processor. variant.cpp is compiled once for each kind; all that it defines but the
// function that gives this table stays its own (cloth/CMakeLists.txt), so that no inline function of a newer processor
// serves an older one.
#pragma once

#include <memory>

#include "cloth/kernel/run.h"

namespace selvedge::cloth::kernel {

// Accelerations of one run in plain doubles (force_field.h).
class Forces {
 public:
  virtual ~Forces() = default;
  virtual void accelerations(const double* position, const double* velocity, double memory_step_s,
                             double* acceleration) = 0;
};

struct KernelTable {
  int most_lanes;
  RunOutput (*run)(const RunInput&);
  RelaxOutput (*relax)(const RunInput&, const RelaxOptions&);
  std::unique_ptr<Forces> (*forces)(const SheetData&, const Material&, const Surroundings&,
                                    const std::vector<HeldVertex>&);
};

const KernelTable& plain_triangles();
const KernelTable& avx2_triangles();
const KernelTable& avx512_triangles();

}  // namespace selvedge::cloth::kernel
