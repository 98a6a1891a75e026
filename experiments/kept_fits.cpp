#include "experiments/kept_fits.h"

#include <cmath>
#include <memory>

#include "files/bad_input.h"
#include "files/json_reader.h"
#include "files/whole_file.h"
#include "estimate/optimisers/registry.h"
#include "estimate/optimisers/journal.h"

namespace selvedge::experiments {

namespace {

using nlohmann::json;

constexpr double kEndless = 1e300;  // stands for infinity, for which JSON has no word

json kept_fit_json(const std::string& identity, const OneFit& fit) {
  const auto finite = [](double x) { return std::isfinite(x) ? x : kEndless; };
  std::vector<double> sd;
  for (const double x : fit.sd) sd.push_back(finite(x));
  json trace = json::array();
  for (const estimate::SearchStep& s : fit.trace)
    trace.push_back({s.evaluations, finite(s.best_cost), finite(s.temperature)});
  return {{"format", "kept-fit/1"},
          {"identity", identity},
          {"set", std::vector<double>(fit.set.begin(), fit.set.end())},
          {"sd", sd},
          {"wall_s", fit.wall_s},
          {"evaluations", fit.evaluations},
          {"from_journal", fit.from_journal},
          {"trace", trace}};
}

Eigen::VectorXd vector_of(const std::vector<double>& values) {
  return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

std::vector<double> numbers_of(const files::JsonReader& in, const std::string& key) {
  return in.numbers(key, in.value(key).size());
}

OneFit read_kept_fit(const std::filesystem::path& path, const std::string& identity) {
  const files::JsonReader in(path);
  if (in.text("identity") != identity)
    refuse(path.string(), "found another fit, {}, expected {}; choose another folder or remove it",
           in_quotes(in.text("identity")), in_quotes(identity));
  OneFit fit;
  fit.set = vector_of(numbers_of(in, "set"));
  fit.sd = vector_of(numbers_of(in, "sd"));
  fit.wall_s = in.number("wall_s");
  fit.evaluations = static_cast<int>(in.number("evaluations"));
  fit.from_journal = static_cast<int>(in.number("from_journal"));
  for (const json& row : in.value("trace")) {
    const std::vector<double> step = files::finite_numbers(row, 3, in.where("trace"));
    fit.trace.push_back({static_cast<int>(step[0]), step[1], step[2] < kEndless ? step[2] : std::nan("")});
  }
  return fit;
}

}  // namespace

OneFit KeptFits::get(const std::string& name, const std::string& identity,
                     const std::function<OneFit()>& compute) const {
  if (folder_.empty()) return compute();
  const std::filesystem::path path = folder_ / (name + ".json");
  if (std::filesystem::exists(path)) return read_kept_fit(path, identity);
  const OneFit fit = compute();
  std::filesystem::create_directories(folder_);
  files::write_json(path, kept_fit_json(identity, fit));
  return fit;
}

estimate::SearchResult KeptFits::search(const std::string& name, const std::string& identity,
                                        const std::string& optimiser, estimate::SearchProblem problem,
                                        const estimate::SearchLimits& limits, int& from_journal) const {
  std::unique_ptr<estimate::Journal> journal;
  if (!folder_.empty()) {
    journal = std::make_unique<estimate::Journal>(folder_ / (name + ".evaluations.txt"), identity);
    from_journal = static_cast<int>(journal->found());
    problem.costs = journal->recorded(problem.costs);
  }
  return estimate::optimiser_named(optimiser).run(problem, limits);
}

}  // namespace selvedge::experiments
