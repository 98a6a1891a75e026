// Which kernels this processor runs.
#include "cloth/kernel/processor.h"
#include "cloth/spline/kernel/tables.h"

namespace selvedge::cloth::spline::kernel {

using cloth::kernel::Processor;

Kernels<float> plain_kernels(int lanes, float);
Kernels<double> plain_kernels(int lanes, double);
Kernels<float> avx2_kernels(int lanes, float);
Kernels<double> avx2_kernels(int lanes, double);
Kernels<float> avx512_kernels(int lanes, float);
Kernels<double> avx512_kernels(int lanes, double);
BandedKernels plain_banded();
BandedKernels avx2_banded();
BandedKernels avx512_banded();

template <class T>
Kernels<T> kernels_for(int lanes) {
  switch (cloth::kernel::processor()) {
    case Processor::avx512: return avx512_kernels(lanes, T());
    case Processor::avx2: return avx2_kernels(lanes, T());
    default: return plain_kernels(lanes, T());
  }
}
template Kernels<float> kernels_for<float>(int);
template Kernels<double> kernels_for<double>(int);

template <class T>
int most_lanes() {
  return cloth::kernel::vector_bytes() / static_cast<int>(sizeof(T));
}
template int most_lanes<float>();
template int most_lanes<double>();

BandedKernels banded_kernels() {
  switch (cloth::kernel::processor()) {
    case Processor::avx512: return avx512_banded();
    case Processor::avx2: return avx2_banded();
    default: return plain_banded();
  }
}

}  // namespace selvedge::cloth::spline::kernel
