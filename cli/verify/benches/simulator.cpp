// `./selvedge bench simulator`: a fit with our own sheet behind simulator/1 beside the same fit in this process.
#include <chrono>
#include <cmath>

#include <fmt/format.h>
#include <unistd.h>

#include "cli/verify/figures.h"
#include "cli/verify/proofs/simulator_behind.h"
#include "fit/fit_campaign.h"

namespace selvedge::cli {

std::vector<Figure> bench_simulator(const FigureOptions& options) {
  const std::filesystem::path log =
      std::filesystem::temp_directory_path() / fmt::format("selvedge-bench-simulator-{}.log", ::getpid());
  const trial::Campaign campaign = campaign_behind(1, options.quick ? 0.5 : 1.5, options.seed);
  const int cells = options.quick ? 6 : 12, rounds = options.quick ? 1 : 2;
  std::vector<double> here_s, behind_s, ratio;
  const auto fit_s = [&](const std::shared_ptr<const model::Simulator>& simulator) {
    const auto begin = std::chrono::steady_clock::now();
    fit::fit_campaign(campaign, fit_behind(cells, simulator));
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  };
  for (int k = 0; k < rounds; ++k) {
    here_s.push_back(fit_s(std::make_shared<OwnSheetHere>()));
    behind_s.push_back(fit_s(own_sheet_behind(log)));
    ratio.push_back(behind_s.back() / here_s.back());
    options.progress((k + 1.0) / rounds, fmt::format("{:.1f} s and {:.1f} s", here_s.back(), behind_s.back()));
  }
  std::filesystem::remove(log);
  const std::string what = fmt::format("a fit on {} cells: ", cells);
  return {
      {what + "our sheet in this process", median(here_s), 0, "s", Relation::shown, ""},
      {what + "our sheet behind simulator/1", median(behind_s), 0, "s", Relation::shown, ""},
      {what + "the one to the other", median(ratio), 1.05, "", Relation::at_most, "asked: at most 5 % more"},
  };
}

}  // namespace selvedge::cli
