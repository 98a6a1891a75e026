#include "cloth/kernel/processor.h"

#include <atomic>
#include <cstring>

namespace selvedge::cloth::kernel {

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

Processor processor() { return static_cast<Processor>(chosen().load()); }

const char* processor_kind() { return kKinds[chosen()].name; }

int vector_bytes() { return kKinds[chosen()].vector_bytes; }

bool use_processor_kind(const char* name) {
  for (int k = 0; k < 3; ++k)
    if (std::strcmp(kKinds[k].name, name) == 0 && kKinds[k].is_here()) {
      chosen() = k;
      return true;
    }
  return false;
}

}  // namespace selvedge::cloth::kernel
