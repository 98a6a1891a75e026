#include "library/version.h"

namespace selvedge {

const char* version() { return SELVEDGE_VERSION; }

}  // namespace selvedge
