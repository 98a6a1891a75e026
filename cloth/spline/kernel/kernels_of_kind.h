// Makes the kernels of one kind of processor. A file that includes this is compiled with its instructions, and sets
// SELVEDGE_KIND, SELVEDGE_WIDTH (bytes of its vectors), SELVEDGE_KERNELS and SELVEDGE_BANDED (names of functions)
// first.
#pragma once

#include "cloth/spline/kernel/advance.h"
#include "cloth/spline/kernel/banded.h"

namespace selvedge::cloth::spline::kernel {

namespace SELVEDGE_KIND {

template <class T, int L>
Kernels<T> made() {
  using V = Pack<T, L>;
  return {L, forces<V, T>, advance<V, T>};
}

// Of AVX-512 half the width takes little more time than a quarter, and the whole more than half as much again.
template <class T>
Kernels<T> for_lanes(int wanted) {
  constexpr int widest = SELVEDGE_WIDTH / sizeof(T), narrowest = 16 / sizeof(T),
                half = widest / 2 > narrowest ? widest / 2 : narrowest;
  if (wanted <= narrowest) return made<T, narrowest>();
  return wanted <= half ? made<T, half>() : made<T, widest>();
}

}  // namespace SELVEDGE_KIND

Kernels<float> SELVEDGE_KERNELS(int lanes, float) { return SELVEDGE_KIND::for_lanes<float>(lanes); }
Kernels<double> SELVEDGE_KERNELS(int lanes, double) { return SELVEDGE_KIND::for_lanes<double>(lanes); }

BandedKernels SELVEDGE_BANDED() {
  using V = SELVEDGE_KIND::Pack<double, SELVEDGE_WIDTH / sizeof(double)>;
  return {SELVEDGE_KIND::factor_banded<V>, SELVEDGE_KIND::solve_banded<V>};
}

}  // namespace selvedge::cloth::spline::kernel
