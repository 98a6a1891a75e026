#include "diagnose/fabric_map.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "report/html.h"
#include "report/text_table.h"

namespace selvedge::diagnose {

namespace {

using nlohmann::json;

constexpr double kMapWidth = 360, kMapMargin = 24, kScaleHeight = 58;  // px

// As the files say it, and in words: alone, and beside another way.
struct HoldWords {
  cloth::Hold hold;
  const char *key, *alone, *beside;
};
constexpr std::array<HoldWords, 5> kHoldWords = {
    {{cloth::Hold::corners, "corners", "the two upper corners are held", "by the two upper corners"},
     {cloth::Hold::top_edge, "top_edge", "the top edge is held", "by the top edge"},
     {cloth::Hold::top_edge_clamped, "top_edge_clamped", "the top edge is clamped", "by a clamp along the top edge"},
     {cloth::Hold::side_edges, "side_edges", "the two side edges are held", "by the two side edges"},
     {cloth::Hold::nothing, "nothing", "nothing is held", "by nothing"}}};

const HoldWords& words_of(cloth::Hold hold) {
  return *std::find_if(kHoldWords.begin(), kHoldWords.end(), [&](const HoldWords& w) { return w.hold == hold; });
}

std::string colour_at(double share) {
  const int shade = static_cast<int>(std::lround(230 - 190 * std::clamp(share, 0.0, 1.0)));
  return fmt::format("rgb({},{},{})", 255 - (230 - shade) / 4, shade, shade);
}

// What is held, in black.
std::string held_marks(const ResidualMap& map, double height) {
  const double left = kMapMargin, right = kMapMargin + kMapWidth, top = kMapMargin;
  const auto thick = [](double x1, double y1, double x2, double y2) {
    return fmt::format(R"(<line x1="{:.1f}" y1="{:.1f}" x2="{:.1f}" y2="{:.1f}" stroke="#000" stroke-width="4"/>)", x1,
                       y1, x2, y2);
  };
  std::string svg;
  for (const cloth::Hold hold : map.held) {
    if (hold == cloth::Hold::corners)
      for (const double x : {left, right})
        svg += fmt::format(R"(<rect class="held-corner" x="{:.1f}" y="{:.1f}" width="12" height="12" fill="#000"/>)",
                           x - 6, top - 6);
    if (hold == cloth::Hold::top_edge || hold == cloth::Hold::top_edge_clamped) svg += thick(left, top, right, top);
    if (hold == cloth::Hold::side_edges)
      svg += thick(left, top, left, top + height) + thick(right, top, right, top + height);
  }
  return svg;
}

std::string scale_bar(double y, double end_mm) {
  constexpr int kSteps = 24;
  std::string svg;
  for (int i = 0; i < kSteps; ++i)
    svg += fmt::format(R"(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="12" fill="{}"/>)",
                       kMapMargin + i * kMapWidth / kSteps, y, kMapWidth / kSteps + 0.5, colour_at((i + 0.5) / kSteps));
  for (const double share : {0.0, 0.5, 1.0})
    svg += fmt::format(R"(<text x="{:.1f}" y="{:.1f}" text-anchor="{}" fill="#111">{} mm</text>)",
                       kMapMargin + share * kMapWidth, y + 26,
                       share == 0   ? "start"
                       : share == 1 ? "end"
                                    : "middle",
                       report::short_number(share * end_mm, 3));
  return svg;
}

}  // namespace

double scale_end_mm(const std::vector<const std::vector<double>*>& errors_mm) {
  double most = 0;
  for (const auto* errors : errors_mm)
    for (const double mm : *errors)
      if (std::isfinite(mm)) most = std::max(most, mm);
  if (!(most > 0)) return 1;
  const double power = std::pow(10, std::floor(std::log10(most)));
  for (const double factor : {1.0, 2.0, 5.0})
    if (factor * power >= most) return factor * power;
  return 10 * power;
}

std::string fabric_map(const ResidualMap& map, const std::vector<double>& at_mm, double scale_end,
                       const std::string& name) {
  const double scale = kMapWidth / map.width_m, height = scale * map.height_m;
  std::string svg = fmt::format(
      R"(<svg xmlns="http://www.w3.org/2000/svg" width="{0:.0f}" height="{1:.0f}" viewBox="0 0 {0:.0f} {1:.0f}" )"
      R"(font-family="sans-serif" font-size="11" role="img" aria-label="{2}"><title>{2}</title>)"
      R"(<rect width="{0:.0f}" height="{1:.0f}" fill="#fff"/>)"
      R"(<rect x="{3:.0f}" y="{3:.0f}" width="{4:.1f}" height="{5:.1f}" fill="#fff" stroke="#444"/>)",
      kMapWidth + 2 * kMapMargin, height + 2 * kMapMargin + kScaleHeight - kMapMargin, report::escape_html(name),
      kMapMargin, kMapWidth, height);
  const double largest = 0.42 * kMapWidth / std::max(2.0, std::sqrt(static_cast<double>(map.uv.size())));
  for (size_t i = 0; i < map.uv.size() && i < at_mm.size(); ++i) {
    if (!std::isfinite(at_mm[i])) continue;
    const double share = std::clamp(at_mm[i] / scale_end, 0.0, 1.0), x = kMapMargin + scale * map.uv[i].x(),
                 y = kMapMargin + scale * map.uv[i].y();
    svg += fmt::format(
        R"(<circle cx="{:.1f}" cy="{:.1f}" r="{:.1f}" fill="{}"/><text x="{:.1f}" y="{:.1f}" text-anchor="middle" )"
        R"(fill="{}">{:.2f}</text>)",
        x, y, std::max(1.5, largest * std::sqrt(share)), colour_at(share), x, y + 4, share > 0.85 ? "#fff" : "#000",
        at_mm[i]);
  }
  return svg + held_marks(map, height) + scale_bar(height + kMapMargin + 14, scale_end) + "</svg>";
}

std::string held_in_words(const ResidualMap& map) {
  if (map.held.empty()) return "how it is held is not known";
  if (map.held.size() == 1) return words_of(map.held.front()).alone;
  std::string ways;
  for (const cloth::Hold hold : map.held)
    ways += fmt::format("{}{}", ways.empty() ? "" : " or ", words_of(hold).beside);
  return "held " + ways + ", in one trial so and in another so";
}

json map_to_json(const ResidualMap& map) {
  json held = json::array(), uv = json::array();
  for (const cloth::Hold hold : map.held) held.push_back(words_of(hold).key);
  for (const Eigen::Vector2d& p : map.uv) uv.push_back({p.x(), p.y()});
  json out = {{"size_m", {map.width_m, map.height_m}}, {"held", held}, {"uv_m", uv}, {"mm", map.at_mm}};
  if (!map.after_mm.empty()) out["after_mm"] = map.after_mm;
  return out;
}

std::optional<ResidualMap> read_map(const json& value) {
  ResidualMap map;
  try {
    map.width_m = value.at("size_m").at(0).get<double>();
    map.height_m = value.at("size_m").at(1).get<double>();
    for (const json& key : value.at("held"))
      for (const HoldWords& w : kHoldWords)
        if (key == w.key) map.held.push_back(w.hold);
    for (const json& p : value.at("uv_m")) map.uv.emplace_back(p.at(0).get<double>(), p.at(1).get<double>());
    map.at_mm = value.at("mm").get<std::vector<double>>();
    if (value.contains("after_mm")) map.after_mm = value.at("after_mm").get<std::vector<double>>();
  } catch (const json::exception&) { return std::nullopt; }
  const bool fits = map.width_m > 0 && map.height_m > 0 && !map.uv.empty() && map.at_mm.size() == map.uv.size() &&
                    (map.after_mm.empty() || map.after_mm.size() == map.uv.size());
  return fits ? std::optional(map) : std::nullopt;
}

}  // namespace selvedge::diagnose
