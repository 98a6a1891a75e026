#define SELVEDGE_KIND kind_plain
#define SELVEDGE_WIDTH 16
#define SELVEDGE_KERNELS plain_kernels
#define SELVEDGE_BANDED plain_banded
#include "cloth/spline/kernel/kernels_of_kind.h"
