#include "experiments/experiment_file.h"

#include <algorithm>

#include "cloth/material_parameters.h"
#include "files/bad_input.h"
#include "files/toml_file.h"
#include "model/parameter.h"

namespace selvedge::experiments {

namespace {

using files::Section;

const std::vector<std::string> kKinds = {"static", "waving", "robot", "cross", "generalisation", "skirt"};
constexpr int kMostFrames = 100000;

template <class Enum>
Enum choice_of(Section& s, const std::string& key, std::optional<std::string> fallback,
               const std::vector<std::string>& allowed) {
  const std::string found = s.choice(key, std::move(fallback), allowed);
  return static_cast<Enum>(std::find(allowed.begin(), allowed.end(), found) - allowed.begin());
}

int whole(Section& s, const std::string& key, int fallback, int least, int most) {
  return static_cast<int>(s.integer(key, fallback, least, most));
}

Fabric read_fabric(const std::string& name, Section s, const std::filesystem::path& folder) {
  Fabric f;
  f.name = name;
  cloth::Material& m = f.material;
  if (s.has("campaign")) {
    f.campaign = folder / s.text("campaign", std::nullopt);
  } else {
    m.density = s.number("density", std::nullopt, 0.005, 5, "kg/m²");
    for (const cloth::MaterialParameter& p : cloth::material_parameters())
      if (p.at_rest) m.*p.member = s.number(p.name, std::nullopt, p.stated_lower, p.stated_upper, p.unit);
      else m.*p.member = s.number(p.name, m.*p.member, p.stated_lower, p.stated_upper, p.unit);
  }
  s.finish();
  return f;
}

std::vector<Fabric> read_fabrics(const files::TomlFile& file, Section& experiment, const std::filesystem::path& path) {
  const std::vector<std::string> names = experiment.texts("fabrics", std::nullopt);
  if (names.empty())
    refuse(experiment.where() + " fabrics", "found an empty list, expected at least one fabric's name");
  const std::string other = experiment.text("fabric_file", "");
  const std::filesystem::path other_path = path.parent_path() / other;
  const files::TomlFile described = other.empty() ? file : files::TomlFile::load(other_path, {});
  Section here = file.section("fabric");
  std::vector<Fabric> fabrics;
  for (const std::string& name : names) {
    if (std::any_of(fabrics.begin(), fabrics.end(), [&](const Fabric& f) { return f.name == name; }))
      refuse(experiment.where() + " fabrics", "found {} twice, expected each fabric once", in_quotes(name));
    if (here.has(name)) fabrics.push_back(read_fabric(name, here.section(name), path.parent_path()));
    else if (!other.empty() && described.has(name))
      fabrics.push_back(read_fabric(name, described.section(name), other_path.parent_path()));
    else
      refuse(experiment.where() + " fabrics", "found {}, expected the names of sections [fabric.NAME]{}",
             in_quotes(name), other.empty() ? "" : " or of [NAME] in " + other_path.string());
  }
  here.finish();
  return fabrics;
}

TrialPlan read_trial_plan(const std::string& name, Section s, double size_m) {
  TrialPlan t;
  t.name = name;
  if (name.empty() || name.find_first_of("/ \t\n") != std::string::npos || name[0] == '.')
    refuse(s.where(), "found the name {}, expected one that can be a folder's", in_quotes(name));
  t.kind = choice_of<trial::Experiment>(s, "kind", std::nullopt, {"static", "waving", "robot"});
  t.apart_m = s.number("apart_m", std::nullopt, 0.3 * size_m, size_m, "m");
  if (t.kind != trial::Experiment::static_hang) {
    t.amplitude_m = s.number("amplitude_m", std::nullopt, 1e-3, 0.5 * size_m, "m");
    t.frequency_hz = s.number("frequency_hz", std::nullopt, 0.05, 10, "Hz");
    t.frames = whole(s, "frames", 0, 3, kMostFrames);
  }
  s.finish();
  return t;
}

TrialProtocol read_protocol(Section s) {
  TrialProtocol p;
  p.size_m = s.number("size_m", p.size_m, 0.05, 2, "m");
  p.cells = whole(s, "cells", p.cells, 4, 64);
  p.frames = whole(s, "frames", p.frames, 3, kMostFrames);
  p.frame_rate_hz = s.number("frame_rate_hz", p.frame_rate_hz, 1, 1000, "Hz");
  p.noise_grey = s.number("noise_grey", p.noise_grey, 0, 50, "grey levels");
  p.noise_m = s.number("noise_m", p.noise_m, 1e-6, 0.05, "m");
  p.seed = static_cast<unsigned>(s.integer("seed", p.seed, 0, 1'000'000'000));
  for (const std::string& name : s.texts("names", std::vector<std::string>{})) {
    if (!s.has(name))
      refuse(s.where() + " names", "found {}, expected the names of sections [trials.NAME]", in_quotes(name));
    if (std::any_of(p.trials.begin(), p.trials.end(), [&](const TrialPlan& t) { return t.name == name; }))
      refuse(s.where() + " names", "found {} twice, expected each trial once", in_quotes(name));
    p.trials.push_back(read_trial_plan(name, s.section(name), p.size_m));
  }
  s.finish();
  return p;
}

FitPlan read_fit(Section s, const std::vector<Fabric>& fabrics) {
  FitPlan f;
  f.optimisers = s.texts("optimisers", f.optimisers);
  const std::vector<std::string> known = {"annealing", "cma", "evolution", "grid", "least_squares"};
  if (f.optimisers.empty()) refuse(s.where() + " optimisers", "found an empty list, expected at least one");
  for (const std::string& name : f.optimisers)
    if (std::find(known.begin(), known.end(), name) == known.end() ||
        std::count(f.optimisers.begin(), f.optimisers.end(), name) > 1)
      refuse(s.where() + " optimisers",
             "found {}, expected annealing, cma, evolution, grid or least_squares, each once", in_quotes(name));
  f.error = choice_of<ErrorKind>(s, "error", "folds", {"folds", "residuals"});
  f.evaluations = whole(s, "evaluations", f.evaluations, 1, 10'000'000);
  f.iterations = whole(s, "iterations", f.iterations, 1, 1000);
  f.cells = whole(s, "cells", f.cells, 4, 64);
  f.coarse_cells = whole(s, "coarse_cells", f.coarse_cells, 4, 64);
  f.frames = whole(s, "frames", f.frames, 3, kMostFrames);
  f.frame_rate_hz = s.number("frame_rate_hz", f.frame_rate_hz, 1, 1000, "Hz");
  f.from_grid = s.choice("start", "grid", {"grid", "usual"}) == "grid";
  f.repeats = whole(s, "repeats", f.repeats, 0, 1000);
  f.repeated_fabric = s.text("repeated_fabric", "");
  if (!f.repeated_fabric.empty() &&
      std::none_of(fabrics.begin(), fabrics.end(), [&](const Fabric& k) { return k.name == f.repeated_fabric; }))
    refuse(s.where() + " repeated_fabric", "found {}, expected one of the fabrics", in_quotes(f.repeated_fabric));
  f.seed = static_cast<unsigned>(s.integer("seed", f.seed, 0, 1'000'000'000));
  s.finish();
  return f;
}

SkirtPlan read_skirt(Section s, const std::filesystem::path& folder) {
  SkirtPlan k;
  k.pattern = folder / s.text("pattern", std::nullopt);
  if (s.has("motion")) k.motion = folder / s.text("motion", std::nullopt);
  k.spacing_m = s.number("spacing_m", k.spacing_m, 0.002, 0.2, "m");
  k.seconds = s.number("seconds", k.seconds, 0.1, 1e4, "s");
  k.frames_per_s = s.number("frames_per_s", k.frames_per_s, 1, 1000, "1/s");
  s.finish();
  return k;
}

// A row is a parameter's, or an error's: E1, E2, E1+E2.
void require_row(const std::string& where, const std::string& key) {
  std::string known;
  for (const model::Parameter& p : model::base_parameters()) {
    if (key == p.name) return;
    known += p.name + ", ";
  }
  if (key.find_first_not_of("E0123456789+") != std::string::npos || key.empty() || key[0] != 'E')
    refuse(where + " " + key, "unknown key, expected one of {}E1, E2, E1+E2", known);
}

PaperRows read_rows(Section s, size_t columns) {
  PaperRows rows;
  for (const std::string& key : s.keys()) {
    require_row(s.where(), key);
    rows[key] = s.texts(key, std::nullopt);
    if (rows[key].size() != columns)
      refuse(s.where() + " " + key, "found {} cells, expected {}, one a column", rows[key].size(), columns);
  }
  return rows;
}

PaperTable read_paper(Section s, const std::vector<Fabric>& fabrics) {
  PaperTable p;
  p.source = s.text("source", "");
  p.remark = s.text("remark", "");
  p.columns = s.texts("columns", std::vector<std::string>{});
  p.repeated_columns = s.texts("repeated_columns", std::vector<std::string>{});
  if (s.has("repeated")) p.repeated = read_rows(s.section("repeated"), p.repeated_columns.size());
  for (const Fabric& f : fabrics)
    if (s.has(f.name)) p.fabrics[f.name] = read_rows(s.section(f.name), p.columns.size());
  s.finish();
  return p;
}

void require_trials(const ExperimentFile& file) {
  const auto& trials = file.protocol.trials;
  const std::string where = file.path.string() + " [trials] names";
  const bool recorded =
      std::all_of(file.fabrics.begin(), file.fabrics.end(), [](const Fabric& f) { return f.recorded(); });
  if (recorded) return;
  if (std::none_of(trials.begin(), trials.end(), [&](const TrialPlan& t) { return is_fitted(file.kind, t.kind); }))
    refuse(where, "found no trial to fit, expected at least one of kind \"{}\"",
           file.kind == Kind::static_hang ? "static" : "waving");
  if (file.kind == Kind::robot &&
      std::none_of(trials.begin(), trials.end(), [](const TrialPlan& t) { return t.kind == trial::Experiment::robot; }))
    refuse(where, "found no trial of kind \"robot\", expected one to predict");
  if (file.kind == Kind::generalisation && std::none_of(trials.begin(), trials.end(), [&](const TrialPlan& t) {
        return (t.frames > 0 ? t.frames : file.protocol.frames) > file.fit.frames;
      }))
    refuse(where, "found no trial longer than the {} frames that are fitted, expected one to predict", file.fit.frames);
  for (const TrialPlan& t : trials)
    if (!is_fitted(file.kind, t.kind) && !is_predicted(file.kind, t.kind))
      refuse(where, "found {}, expected no trial that \"{}\" has no use for", in_quotes(t.name), to_text(file.kind));
}

}  // namespace

const char* to_text(Kind kind) { return kKinds[static_cast<size_t>(kind)].c_str(); }

bool is_fitted(Kind kind, trial::Experiment trial) {
  return kind != Kind::skirt &&
         trial == (kind == Kind::static_hang ? trial::Experiment::static_hang : trial::Experiment::waving);
}

bool is_predicted(Kind kind, trial::Experiment trial) {
  return kind == Kind::robot && trial == trial::Experiment::robot;
}

ExperimentFile read_experiment(const std::filesystem::path& path) {
  const files::TomlFile toml = files::TomlFile::load(path, {"experiment", "fabric", "trials", "fit", "skirt", "paper"});
  ExperimentFile file;
  file.path = path;
  Section experiment = toml.section("experiment");
  file.kind = choice_of<Kind>(experiment, "kind", std::nullopt, kKinds);
  file.title = experiment.text("title", path.stem().string());
  file.fabrics = read_fabrics(toml, experiment, path);
  experiment.finish();
  const bool skirt = file.kind == Kind::skirt;
  for (const char* name : {"trials", "fit", "skirt"})
    if (toml.has(name) && (std::string(name) == "skirt") != skirt)
      refuse(path.string(), "found a section [{}], expected none where kind is \"{}\"", name, to_text(file.kind));
  if (skirt) {
    file.skirt = read_skirt(toml.section("skirt"), path.parent_path());
    for (const Fabric& f : file.fabrics)
      if (f.recorded())
        refuse(path.string() + " [fabric." + f.name + "] campaign",
               "found recorded trials, expected the parameters that the skirt is to have");
  } else {
    file.protocol = read_protocol(toml.section("trials"));
    file.fit = read_fit(toml.section("fit"), file.fabrics);
    require_trials(file);
  }
  file.paper = read_paper(toml.section("paper"), file.fabrics);
  return file;
}

void use_campaigns(ExperimentFile& file, const std::vector<std::filesystem::path>& campaigns) {
  if (campaigns.empty()) return;
  if (file.kind == Kind::skirt)
    refuse("--campaign", "found it with an experiment of kind \"skirt\", expected one that fits trials");
  file.fabrics.clear();
  for (const std::filesystem::path& path : campaigns) {
    Fabric f;
    f.campaign = path;
    f.name = trial::read_campaign(path).fabric;
    if (f.name.empty()) f.name = std::filesystem::absolute(path).lexically_normal().filename().string();
    if (std::any_of(file.fabrics.begin(), file.fabrics.end(), [&](const Fabric& k) { return k.name == f.name; }))
      refuse("--campaign " + path.string(), "found a second campaign of {}, expected each fabric once",
             in_quotes(f.name));
    file.fabrics.push_back(std::move(f));
  }
  file.fit.repeated_fabric.clear();
}

ExperimentFile quick_version(ExperimentFile file) {
  if (file.fabrics.size() > 2) file.fabrics = {file.fabrics.front(), file.fabrics.back()};
  if (std::none_of(file.fabrics.begin(), file.fabrics.end(),
                   [&](const Fabric& f) { return f.name == file.fit.repeated_fabric; }))
    file.fit.repeated_fabric.clear();
  const double slower = 0.5;
  FitPlan& fit = file.fit;
  fit.cells = fit.coarse_cells = file.protocol.cells = 5;
  fit.evaluations = std::min(fit.evaluations, 12);
  fit.iterations = std::min(fit.iterations, 4);
  fit.repeats = std::min(fit.repeats, 2);
  fit.frame_rate_hz = file.protocol.frame_rate_hz = slower * file.protocol.frame_rate_hz;
  fit.frames = std::min(fit.frames, 9);
  const int most = file.kind == Kind::generalisation ? 15 : 9;
  file.protocol.frames = std::min(file.protocol.frames, most);
  for (TrialPlan& t : file.protocol.trials) t.frames = std::min(t.frames, most);
  file.skirt.spacing_m = std::max(file.skirt.spacing_m, 0.05);
  file.skirt.seconds = std::min(file.skirt.seconds, 0.5);
  file.skirt.frames_per_s = std::min(file.skirt.frames_per_s, 10.0);
  return file;
}

}  // namespace selvedge::experiments
