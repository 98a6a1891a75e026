// report/flipped_pictures.js, as it was when the program was built.
#pragma once

namespace selvedge::report {

extern const char* const flipped_pictures_script;

}  // namespace selvedge::report
