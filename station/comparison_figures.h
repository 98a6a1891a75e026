// The figures of two results side by side: maps of the fabric drawn anew on one colour scale, plots on the same axes,
// pictures as the reports beside the results have them.
#pragma once

#include "report/html.h"
#include "station/comparison.h"

namespace selvedge::station {

void add_figures_of_both(report::HtmlReport& html, const ComparedPair& pair);

}  // namespace selvedge::station
