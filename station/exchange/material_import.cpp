#include "station/exchange/material_import.h"

#include <algorithm>
#include <cmath>

#include <opencv2/imgcodecs.hpp>

#include "capture/trial/trial_writer.h"
#include "files/bad_input.h"
#include "files/json_reader.h"
#include "files/whole_file.h"
#include "geometry/polyline.h"
#include "material_tests/strip_photo.h"
#include "station/exchange/named_columns.h"
#include "station/exchange/pulls_hdf5.h"

namespace selvedge::station {

namespace fs = std::filesystem;
using Eigen::Index;
using trial::Trial;

namespace {

std::string lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

bool is_kind(const fs::path& file, const std::vector<std::string>& endings) {
  return std::count(endings.begin(), endings.end(), lower(file.extension().string())) > 0;
}

template <class Value>
Value needed(const std::optional<Value>& value, const char* option, const char* what) {
  if (!value) refuse(option, "found nothing, expected {}", what);
  return *value;
}

Trial begun(const MaterialImport& from, trial::Experiment kind) {
  Trial t;
  t.name = from.name.empty() ? from.file.stem().string() : from.name;
  t.experiment = kind;
  t.fabric = {from.fabric, from.width_m, from.height_m, 0, from.areal_mass.has_value()};
  return t;
}

void set_mass(Trial& t, double areal_mass) { t.fabric.mass_kg = areal_mass * t.fabric.width_m * t.fabric.height_m; }

Trial strip_of(const MaterialImport& from) {
  Trial t = begun(from, trial::Experiment::cantilever);
  set_mass(t, needed(from.areal_mass, "--areal-mass", "kg/m²: a strip bends by its weight"));
  t.cantilever = trial::Cantilever{needed(from.angle_deg, "--angle-deg", "0 for a strip along the warp, 90 the weft"),
                                   from.overhang_m.value_or(0),
                                   from.bending_length_m,
                                   {}};
  return t;
}

// At most `most` of the points, evenly, with both ends.
Eigen::Matrix2Xd thinned(const Eigen::Matrix2Xd& line, Index most) {
  if (line.cols() <= most) return line;
  Eigen::Matrix2Xd out(2, most);
  for (Index i = 0; i < most; ++i) out.col(i) = line.col((line.cols() - 1) * i / (most - 1));
  return out;
}

ImportedStrips of_photo(const MaterialImport& from) {
  if (!(from.mm_per_px > 0)) refuse("--mm-per-px", "found nothing, expected it, or --scale X1,Y1,X2,Y2=MM");
  const material_tests::StripInPhoto found = material_tests::find_strip(from.file, {from.mm_per_px, from.edge_px});
  Trial t = strip_of(from);
  t.cantilever->overhang_m = from.overhang_m.value_or(found.overhang_m);
  t.cantilever->midline_m = thinned(found.midline_m, 120);
  std::vector<unsigned char> png;
  cv::imencode(".png", found.picture, png);
  return {{t}, {png.begin(), png.end()}};
}

ImportedStrips of_midline(const MaterialImport& from, const NamedColumns& columns) {
  Trial t = strip_of(from);
  const std::vector<double> along = columns.first_of({{"along_m", 1}, {"along_mm", 1e-3}}),
                            down = columns.first_of({{"down_m", 1}, {"down_mm", 1e-3}});
  t.cantilever->midline_m.resize(2, static_cast<Index>(along.size()));
  for (size_t i = 0; i < along.size(); ++i) t.cantilever->midline_m.col(static_cast<Index>(i)) << along[i], down[i];
  if (!from.overhang_m && along.size() > 1)
    t.cantilever->overhang_m = geometry::polyline_length(t.cantilever->midline_m);
  return {{t}, ""};
}

// A row a strip. Where the overhang is not there: twice the bending length, as the instrument has it.
ImportedStrips of_bending_lengths(const MaterialImport& from, const NamedColumns& columns) {
  const std::vector<double> length = columns.first_of({{"bending_length_mm", 1e-3}, {"bending_length_m", 1}});
  std::vector<double> angle, overhang, mass;
  if (columns.has("angle_deg")) angle = columns("angle_deg");
  if (columns.has("overhang_mm")) overhang = columns("overhang_mm");
  if (columns.has("areal_mass")) mass = columns("areal_mass");
  ImportedStrips out;
  for (size_t i = 0; i < length.size(); ++i) {
    MaterialImport row = from;
    if (!angle.empty()) row.angle_deg = angle[i];
    if (!mass.empty()) row.areal_mass = mass[i];
    Trial t = strip_of(row);
    if (length.size() > 1) t.name += fmt::format("-{}", i + 1);
    t.cantilever->bending_length_m = length[i];
    t.cantilever->overhang_m = overhang.empty() ? 2 * length[i] : 1e-3 * overhang[i];
    out.trials.push_back(std::move(t));
  }
  return out;
}

std::vector<double> stretch_of(const std::vector<double>& strain) {
  std::vector<double> out = strain;
  for (double& s : out) s += 1;
  return out;
}

std::vector<double> stretch_along(const MaterialImport& from, const NamedColumns& columns) {
  if (columns.has("stretch_along")) return columns("stretch_along");
  return stretch_of(
      columns.first_of({{"strain_along_percent", 1e-2}, {"strain_along", 1}, {"extension_mm", 1e-3 / from.gauge_m}}));
}

std::vector<double> stretch_across(const NamedColumns& columns, size_t rows) {
  if (columns.has("stretch_across")) return columns("stretch_across", true);
  if (columns.has("strain_across_percent")) return stretch_of(columns.first_of({{"strain_across_percent", 1e-2}}));
  if (columns.has("strain_across")) return stretch_of(columns("strain_across", true));
  return std::vector<double>(rows, std::nan(""));
}

std::vector<trial::Pull> pulls_of_csv(const MaterialImport& from) {
  const NamedColumns columns(from.file, from.columns);
  const std::vector<double> force = columns.first_of({{"force", 1}, {"force_n", 1}}),
                            along = stretch_along(from, columns), across = stretch_across(columns, force.size());
  std::vector<int> number(force.size(), 1);
  std::vector<double> time(force.size());
  for (size_t i = 0; i < time.size(); ++i) time[i] = static_cast<double>(i);
  if (columns.has("pull")) number = columns.whole_numbers("pull");
  if (columns.has("time_s")) time = columns("time_s");
  std::vector<trial::Pull> pulls;
  for (size_t i = 0; i < force.size(); ++i) {
    if (pulls.empty() || pulls.back().number != number[i]) pulls.push_back({number[i], {}, {}, {}, {}});
    pulls.back().time_s.push_back(time[i]);
    pulls.back().force.push_back(force[i]);
    pulls.back().stretch_along.push_back(along[i]);
    pulls.back().stretch_across.push_back(across[i]);
  }
  return pulls;
}

fs::path unfinished(const fs::path& folder, const Trial& t) { return folder / ("." + t.name + ".part"); }

}  // namespace

ImportedStrips import_cantilever(const MaterialImport& from) {
  if (is_kind(from.file, {".jpg", ".jpeg", ".png"})) return of_photo(from);
  const NamedColumns columns(from.file, from.columns);
  return columns.has("bending_length_mm") || columns.has("bending_length_m") ? of_bending_lengths(from, columns)
                                                                             : of_midline(from, columns);
}

Trial import_tensile(const MaterialImport& from) {
  constexpr double kUsual = 0.2;  // kg/m², where it is not known: nothing of the test depends on it
  Trial t = begun(from, trial::Experiment::tensile);
  trial::Tensile test{needed(from.angle_deg, "--angle-deg", "0 for a strip pulled along the warp, 90 the weft"),
                      from.width_m,
                      from.gauge_m,
                      from.force_unit,
                      {}};
  if (is_kind(from.file, {".h5", ".hdf5"})) {
    PullsOfFile found = read_pulls_hdf5(from.file, from.hdf5);
    test.width_m = t.fabric.width_m = found.width_m;
    test.length_m = t.fabric.height_m = found.gauge_m;
    test.pulls = std::move(found.pulls);
  } else {
    test.pulls = pulls_of_csv(from);
  }
  set_mass(t, from.areal_mass.value_or(kUsual));
  t.tensile = std::move(test);
  return t;
}

std::vector<fs::path> add_to_campaign(const std::vector<Trial>& trials, const fs::path& folder) {
  trial::Campaign campaign;
  campaign.fabric = trials.front().fabric.name;
  if (fs::exists(folder / "campaign.json")) campaign = trial::read_campaign(folder);
  if (campaign.fabric != trials.front().fabric.name)
    refuse("--fabric", "found {}, expected {} as {} has it", in_quotes(trials.front().fabric.name),
           in_quotes(campaign.fabric), (folder / "campaign.json").string());
  for (const Trial& t : trials)
    if (fs::exists(folder / t.name)) refuse("--out", "{} is there already", (folder / t.name).string());
  fs::create_directories(folder);
  // All of them, or none: what cannot be read back is refused before any has its name.
  try {
    for (const Trial& t : trials) {
      fs::remove_all(unfinished(folder, t));
      trial::write_trial(t, unfinished(folder, t));
      trial::read_trial(unfinished(folder, t));
    }
  } catch (...) {
    for (const Trial& t : trials) fs::remove_all(unfinished(folder, t));
    throw;
  }
  std::vector<fs::path> written;
  for (const Trial& t : trials) {
    fs::rename(unfinished(folder, t), written.emplace_back(folder / t.name));
    campaign.trials.push_back(t);
  }
  trial::write_campaign_json(campaign, folder);
  return written;
}

double mm_per_px_of(const std::string& scale) {
  double x1 = 0, y1 = 0, x2 = 0, y2 = 0, mm = 0;
  char rest = 0;
  if (std::sscanf(scale.c_str(), "%lf,%lf,%lf,%lf=%lf%c", &x1, &y1, &x2, &y2, &mm, &rest) != 5 || !(mm > 0) ||
      !(std::hypot(x2 - x1, y2 - y1) > 0))
    refuse("--scale", "found {}, expected X1,Y1,X2,Y2=MM: two points in px and the millimetres between them",
           in_quotes(scale));
  return mm / std::hypot(x2 - x1, y2 - y1);
}

}  // namespace selvedge::station
