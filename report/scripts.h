// The scripts of moving figures, report/*.js, as they were when the program was built.
#pragma once

namespace selvedge::report {

extern const char* const moving_sheets_script;
extern const char* const flipped_pictures_script;

}  // namespace selvedge::report
