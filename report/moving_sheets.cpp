#include "report/moving_sheets.h"

#include <cmath>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "report/html.h"
#include "report/scripts.h"

namespace selvedge::report {

namespace {

using nlohmann::json;

constexpr const char* kStyle = R"(<style>
.moving-sheets .stage { display: flex; flex-wrap: wrap; gap: 10px; touch-action: none; cursor: grab; }
.moving-sheets .stage > div { flex: 1 1 280px; }
.moving-sheets canvas { width: 100%; height: 340px; background: #f4f6f8; border: 1px solid #bbb; }
.moving-sheets .controls { display: none; flex-wrap: wrap; gap: 10px; align-items: center; margin: .5em 0; }
.moving-sheets .time { flex: 1 1 180px; }
@media screen { .moving-sheets.runs .controls { display: flex; } }
</style>)";

constexpr const char* kControls = R"(<div class="controls">
<label>Trial <select class="trial"></select></label>
<button class="play" type="button">Play</button>
<input class="time" type="range" min="0" value="0" aria-label="time">
<output class="note"></output>
<label><input class="enlarge" type="checkbox"> errors five times as long</label>
)";

// Tenths of a millimetre: as fine as anybody sees, and short.
json in_tenths_of_mm(const std::vector<Points>& all) {
  json out = json::array();
  for (const Points& points : all) {
    json list = json::array();
    for (const float value : points)
      list.push_back(std::isfinite(value) ? json(std::lround(1e4 * static_cast<double>(value))) : json(nullptr));
    out.push_back(std::move(list));
  }
  return out;
}

json rounded(const std::vector<float>& values) {
  json out = json::array();
  for (const float value : values)
    out.push_back(std::isfinite(value) ? json(std::stod(fmt::format("{:.4g}", value))) : json(nullptr));
  return out;
}

json to_json(const MovingSheet& s) {
  json views = json::array(), arrows = json::array();
  for (const SheetView& v : s.views) {
    if (v.sheet.size() != s.time_s.size() || (!v.expected.empty() && v.expected.size() != s.time_s.size()))
      throw std::invalid_argument(fmt::format("moving_sheets: {}, {}: {} sheets and {} times", s.name, v.name,
                                              v.sheet.size(), s.time_s.size()));
    views.push_back({{"name", v.name}, {"sheet", in_tenths_of_mm(v.sheet)}, {"expected", in_tenths_of_mm(v.expected)}});
  }
  if (s.seen.size() != s.time_s.size())
    throw std::invalid_argument(
        fmt::format("moving_sheets: {}: {} lists of points and {} times", s.name, s.seen.size(), s.time_s.size()));
  for (const Arrows& a : s.arrows)
    arrows.push_back({{"from", a.from_s}, {"to", a.to_s}, {"mean", rounded(a.mean)}, {"sd", rounded(a.sd)}});
  return {{"name", s.name}, {"across", s.across},        {"t", rounded(s.time_s)}, {"seen", in_tenths_of_mm(s.seen)},
          {"views", views}, {"uv", rounded(s.arrow_uv)}, {"arrows", arrows}};
}

// Within a script element nothing may look like its end.
std::string within_script(std::string text) {
  for (size_t at = 0; (at = text.find('<', at)) != std::string::npos; ++at) text.replace(at, 1, "\\u003c");
  return text;
}

}  // namespace

std::string moving_sheets(const std::vector<MovingSheet>& sheets, const std::string& arrow_name,
                          const std::string& arrow_unit) {
  json trials = json::array();
  for (const MovingSheet& s : sheets) trials.push_back(to_json(s));
  const json data = {{"trials", trials}, {"unit", arrow_unit}};
  return std::string(kStyle) + "<div class=\"moving-sheets\">\n" + kControls +
         fmt::format("<label><input class=\"arrows\" type=\"checkbox\" checked> {}</label>\n</div>\n",
                     escape_html(arrow_name)) +
         "<div class=\"stage\"></div>\n<noscript>The sheet in motion needs scripts, which a console does not run: "
         "open the report's file in a browser.</noscript>\n" +
         "<script type=\"application/json\">" + within_script(data.dump()) + "</script>\n</div>\n<script>\n" +
         moving_sheets_script + "</script>\n";
}

}  // namespace selvedge::report
