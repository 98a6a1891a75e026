// Which kind of processor this is. Kernels are compiled for each kind and chosen when the program runs.
#pragma once

namespace selvedge::cloth::kernel {

enum class Processor { plain = 0, avx2 = 1, avx512 = 2 };  // x86-64; with AVX2 and FMA; with AVX-512 F, VL, DQ as well

Processor processor();
const char* processor_kind();  // its name
// Bytes of its vectors.
int vector_bytes();

// From now on as if this processor were of that kind; false where it lacks something. For tests and measurements.
bool use_processor_kind(const char* kind);

}  // namespace selvedge::cloth::kernel
