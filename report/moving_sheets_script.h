// report/moving_sheets.js, as it was when the program was built.
#pragma once

namespace selvedge::report {

extern const char* const moving_sheets_script;

}  // namespace selvedge::report
