#define SELVEDGE_KIND kind_avx2
#define SELVEDGE_WIDTH 32
#define SELVEDGE_KERNELS avx2_kernels
#define SELVEDGE_BANDED avx2_banded
#include "cloth/spline/kernel/kernels_of_kind.h"
