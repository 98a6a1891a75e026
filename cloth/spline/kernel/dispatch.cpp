// Which kernels this processor runs, found out once.
#include <algorithm>
#include <atomic>
#include <cstring>

#include "cloth/spline/kernel/tables.h"

namespace selvedge::cloth::spline::kernel {

Kernels<float> plain_kernels(int lanes, float);
Kernels<double> plain_kernels(int lanes, double);
Kernels<float> avx2_kernels(int lanes, float);
Kernels<double> avx2_kernels(int lanes, double);
Kernels<float> avx512_kernels(int lanes, float);
Kernels<double> avx512_kernels(int lanes, double);
BandedKernels plain_banded();
BandedKernels avx2_banded();
BandedKernels avx512_banded();

namespace {

struct Kind {
  const char* name;
  int vector_bytes;
  bool (*is_here)();
};

constexpr Kind kKinds[] = {{"plain", 16, [] { return true; }},
                           {"avx2", 32, [] { return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"); }},
                           {"avx512", 64, [] {
                              return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
                                     __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx2") &&
                                     __builtin_cpu_supports("fma");
                            }}};

int best() {
  int kind = 0;
  for (int k = 1; k < 3; ++k)
    if (kKinds[k].is_here()) kind = k;
  return kind;
}

std::atomic<int>& chosen() {
  static std::atomic<int> kind = best();
  return kind;
}

}  // namespace

template <class T>
Kernels<T> kernels_for(int lanes) {
  const int kind = chosen();
  if (kind == 2) return avx512_kernels(lanes, T());
  return kind == 1 ? avx2_kernels(lanes, T()) : plain_kernels(lanes, T());
}
template Kernels<float> kernels_for<float>(int);
template Kernels<double> kernels_for<double>(int);

template <class T>
int most_lanes() {
  return kKinds[chosen()].vector_bytes / static_cast<int>(sizeof(T));
}
template int most_lanes<float>();
template int most_lanes<double>();

BandedKernels banded_kernels() {
  const int kind = chosen();
  if (kind == 2) return avx512_banded();
  return kind == 1 ? avx2_banded() : plain_banded();
}

const char* processor_kind() { return kKinds[chosen()].name; }

bool use_processor_kind(const char* name) {
  for (int k = 0; k < 3; ++k)
    if (std::strcmp(kKinds[k].name, name) == 0 && kKinds[k].is_here()) {
      chosen() = k;
      return true;
    }
  return false;
}

}  // namespace selvedge::cloth::spline::kernel
