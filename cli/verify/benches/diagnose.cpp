// Where the time of a diagnosis goes: a marker campaign of the simulated world, stage by stage.
#include <filesystem>
#include <random>

#include "capture/trial/trial.h"
#include "cli/verify/figures.h"
#include "diagnose/diagnosis.h"
#include "diagnose/effects/library.h"
#include "hardware_sim/bank/bank_campaign.h"

namespace selvedge::cli {

std::vector<Figure> bench_diagnose(const FigureOptions& options) {
  namespace fs = std::filesystem;
  const fs::path folder = fs::temp_directory_path() / ("selvedge_bench_diagnose_" + std::to_string(options.seed));
  fs::remove_all(folder);
  std::mt19937_64 generator(options.seed);
  hardware_sim::BankKey key = hardware_sim::draw_key("none", hardware_sim::BankWorld::lattice, generator);
  key.design = hardware_sim::usual_design();
  hardware_sim::write_bank_campaign(key, "bench", folder);
  diagnose::DiagnosisOptions o;
  o.study.progress = options.progress;
  if (options.quick) {
    o.study.protocol.cells = 6;
    o.study.protocol.rate_hz = 15;
  }
  const diagnose::Diagnosis d = diagnose::diagnose(trial::read_campaign(folder), diagnose::effect_library(), o);
  fs::remove_all(folder);
  std::vector<Figure> figures;
  for (const auto& [stage, seconds] : d.stage_s)
    figures.push_back({"seven marker trials: " + stage, seconds, 0, "s", Relation::shown, "this run"});
  figures.push_back(
      {"seven marker trials: processor time", d.cpu_s, 240, "s", Relation::at_most, "two minutes on two cores"});
  figures.push_back({"seven marker trials: wall time", d.wall_s, 120, "s", Relation::shown, "two cores to itself"});
  return figures;
}

}  // namespace selvedge::cli
