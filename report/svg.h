// Pieces of a drawing as SVG text.
#pragma once

#include <string>

namespace selvedge::report {

// The opening tag of a drawing of this size, px, on a white ground; dark 12 px letters unless said otherwise.
std::string open_svg(double width_px, double height_px);

// anchor: start, middle or end, of the text at x; more: further attributes, each behind a blank.
std::string text_at(double x, double y, const std::string& anchor, const std::string& text,
                    const std::string& more = "");

}  // namespace selvedge::report
