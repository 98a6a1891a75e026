// The version of the library, "MAJOR.MINOR.PATCH".
#pragma once

namespace selvedge {

const char* version();

}  // namespace selvedge
