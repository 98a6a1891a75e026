#include "report/plot_data.h"

#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace selvedge::report {

namespace {

using nlohmann::json;

constexpr const char* kOpen = "<metadata>";
constexpr const char* kClose = "</metadata>";

json short_numbers(const std::vector<double>& values) {
  json out = json::array();
  for (const double x : values) out.push_back(std::isfinite(x) ? json::parse(fmt::format("{:.5g}", x)) : json());
  return out;
}

std::vector<double> numbers_of(const json& values) {
  std::vector<double> out;
  for (const json& x : values) out.push_back(x.is_null() ? std::numeric_limits<double>::quiet_NaN() : x.get<double>());
  return out;
}

void hold_all_of(const LinePlot& plot, PlotOptions& options) {
  for (const Series& s : plot.series)
    for (size_t i = 0; i < s.x.size(); ++i) {
      if (!std::isfinite(s.x[i]) || !std::isfinite(s.y[i])) continue;
      options.holds_x.push_back(s.x[i]);
      options.holds_y.push_back(s.y[i]);
    }
  if (plot.options.level) options.holds_y.push_back(*plot.options.level);
}

}  // namespace

std::string plot_data(const LinePlot& plot) {
  const PlotOptions& o = plot.options;
  json series = json::array(), shaded = json::array();
  for (const Series& s : plot.series)
    series.push_back(
        {{"name", s.name}, {"x", short_numbers(s.x)}, {"y", short_numbers(s.y)}, {"points", s.points_only}});
  for (const auto& [from, to] : o.shaded) shaded.push_back(short_numbers({from, to}));
  const json data = {{"series", series},
                     {"x_label", o.x_label},
                     {"y_label", o.y_label},
                     {"log_x", o.log_x},
                     {"log_y", o.log_y},
                     {"width_px", o.width_px},
                     {"height_px", o.height_px},
                     {"shaded", shaded},
                     {"shaded_name", o.shaded_name},
                     {"level", o.level ? json(*o.level) : json()},
                     {"level_name", o.level_name}};
  return kOpen + escape_html(data.dump()) + kClose + "\n";
}

std::optional<LinePlot> read_plot(const std::string& svg) {
  const size_t open = svg.find(kOpen), close = svg.find(kClose);
  if (open == std::string::npos || close == std::string::npos || close < open) return std::nullopt;
  const size_t begin = open + std::string(kOpen).size();
  try {
    const json data = json::parse(unescape_html(svg.substr(begin, close - begin)));
    LinePlot out;
    for (const json& s : data.at("series")) {
      out.series.push_back(
          {s.at("name").get<std::string>(), numbers_of(s.at("x")), numbers_of(s.at("y")), s.at("points").get<bool>()});
      if (out.series.back().x.size() != out.series.back().y.size()) return std::nullopt;
    }
    PlotOptions& o = out.options;
    o.x_label = data.at("x_label").get<std::string>();
    o.y_label = data.at("y_label").get<std::string>();
    o.log_x = data.at("log_x").get<bool>();
    o.log_y = data.at("log_y").get<bool>();
    o.width_px = data.at("width_px").get<int>();
    o.height_px = data.at("height_px").get<int>();
    for (const json& span : data.at("shaded"))
      o.shaded.emplace_back(span.at(0).get<double>(), span.at(1).get<double>());
    o.shaded_name = data.at("shaded_name").get<std::string>();
    if (!data.at("level").is_null()) o.level = data.at("level").get<double>();
    o.level_name = data.at("level_name").get<std::string>();
    return out;
  } catch (const json::exception&) { return std::nullopt; }
}

std::pair<std::string, std::string> on_same_axes(const LinePlot& a, const LinePlot& b) {
  LinePlot of_a = a, of_b = b;
  hold_all_of(b, of_a.options);
  hold_all_of(a, of_b.options);
  return {line_plot(of_a.series, of_a.options), line_plot(of_b.series, of_b.options)};
}

}  // namespace selvedge::report
