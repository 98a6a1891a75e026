#define SELVEDGE_KIND kind_avx512
#define SELVEDGE_WIDTH 64
#define SELVEDGE_KERNELS avx512_kernels
#define SELVEDGE_BANDED avx512_banded
#include "cloth/spline/kernel/kernels_of_kind.h"
