#include <cmath>
#include <map>

#include <fmt/format.h>

#include "cli/verify/proofs/real.h"
#include "material_tests/tensile.h"
#include "report/text_table.h"
#include "station/exchange/material_import.h"

namespace selvedge::cli {

namespace {

using material_tests::PullCurve;

constexpr double kClamp_m = 0.04;  // not in the files: it scales stiffness, and nothing that is judged here
constexpr int kFitted = 3;         // pulls of a direction; the others are predicted

trial::Trial pulls_of(const std::filesystem::path& file, double angle_deg) {
  station::MaterialImport from;
  from.file = file;
  from.fabric = file.stem().string();
  from.angle_deg = angle_deg;
  from.hdf5.clamp_m = kClamp_m;
  from.force_unit = "as recorded";
  return station::import_tensile(from);
}

std::vector<PullCurve> some_of(const std::vector<PullCurve>& curves, bool fitted) {
  std::vector<PullCurve> out;
  for (const PullCurve& c : curves)
    if ((c.number <= kFitted) == fitted) out.push_back(c);
  return out;
}

// What the mean of the fitted pulls says of the others: a model that knows nothing of fabric, and all of these.
std::array<double, 2> off_their_mean(const std::vector<PullCurve>& curves, int direction) {
  std::array<double, 2> sum{}, count{};
  for (const PullCurve& c : some_of(curves, false)) {
    if (c.direction != direction) continue;
    for (Eigen::Index k = 0; k < c.force.size(); ++k)
      for (const size_t channel : {size_t{0}, size_t{1}}) {
        const auto value = [&](const PullCurve& of) { return channel == 0 ? of.along(k) : of.across(k); };
        double mean = 0, n = 0;
        for (const PullCurve& f : some_of(curves, true))
          if (f.direction == direction && std::isfinite(value(f))) mean += value(f), ++n;
        if (n == 0 || !std::isfinite(value(c))) continue;
        sum[channel] += std::pow(value(c) - mean / n, 2);
        ++count[channel];
      }
  }
  return {std::sqrt(sum[0] / std::max(1.0, count[0])), std::sqrt(sum[1] / std::max(1.0, count[1]))};
}

struct Knit {
  std::filesystem::path along_warp, along_weft;
};

}  // namespace

std::vector<Figure> prove_real_tensile(const std::filesystem::path& folder, const FigureOptions& options) {
  std::map<std::string, Knit> knits;  // by name without its direction
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string stem = entry.path().stem().string();
    if (entry.path().extension() != ".h5" || stem.size() < 3) continue;
    Knit& knit = knits[stem.substr(0, stem.size() - 2)];
    (stem.back() == 'x' ? knit.along_warp : knit.along_weft) = entry.path();
  }
  std::vector<Figure> figures;
  std::vector<std::vector<std::string>> rows;
  for (const auto& [name, knit] : knits) {
    if (knit.along_warp.empty() || knit.along_weft.empty()) continue;
    options.progress(static_cast<double>(rows.size()) / (4.0 * static_cast<double>(knits.size())), name);
    const trial::Trial warp = pulls_of(knit.along_warp, 0), weft = pulls_of(knit.along_weft, 90);
    const std::vector<PullCurve> curves = material_tests::pull_curves({&warp, &weft}), fitted = some_of(curves, true),
                                 others = some_of(curves, false);
    const material_tests::Scatter scatter = material_tests::scatter_of(curves);
    const auto large = material_tests::fit_stretch_law(fitted, scatter, true),
               sheet = material_tests::fit_stretch_law(fitted, scatter, false);
    for (int d = 0; d < 2; ++d) {
      const auto error = misfit(large.law, others, d), of_sheet = misfit(sheet.law, others, d),
                 mean = off_their_mean(curves, d);
      for (const size_t channel : {size_t{0}, size_t{1}}) {
        const std::string what =
            fmt::format("{}, pulled along {}, stretch {}", name, d == 0 ? "x" : "y", channel == 0 ? "along" : "across");
        const double within = 2 * scatter[static_cast<size_t>(d)][channel];  // of it lie 95 % of the pulls
        figures.push_back({what + ", of pulls that were not fitted", error[channel], within, "", Relation::at_most,
                           "two deviations between its pulls at one force"});
        rows.push_back({what, fmt::format("{:.4f}", error[channel]), fmt::format("{:.4f}", of_sheet[channel]),
                        fmt::format("{:.4f}", mean[channel]), fmt::format("{:.4f}", within / 2)});
      }
    }
    if (options.quick) break;
  }
  fmt::print(
      "Stretch of pulls that were not fitted, root mean square off; both directions of a knit in one law\n{}\n",
      report::text_table(
          {"", "law of large strain", "the sheet's law", "mean of the fitted", "deviation between pulls"}, rows));
  return figures;
}

}  // namespace selvedge::cli
