// The section of a diagnosis's report that says where the residual lies: on the fabric, over time, frequency and image.
#pragma once

#include "diagnose/diagnosis.h"
#include "report/html.h"

namespace selvedge::diagnose {

void add_where(report::HtmlReport& html, const Diagnosis& d);

}  // namespace selvedge::diagnose
