#include "material_tests/fabric_library.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <sstream>

#include <fmt/format.h>

#include "files/bad_input.h"
#include "files/json_reader.h"
#include "files/whole_file.h"
#include "material_tests/bending_length.h"

namespace selvedge::material_tests {

namespace fs = std::filesystem;
using files::JsonReader;
using nlohmann::json;

namespace {

// Percentiles 5, 25, 50, 75, 95 of the 618 fabrics of the drape tester (Feng, Huang, Xu, Wang, SIGGRAPH Asia 2022):
// bending length both ways together, mm, and areal mass, kg/m².
constexpr std::array kPercent = {5.0, 25.0, 50.0, 75.0, 95.0};
constexpr std::array kLength_mm = {11.5, 15.1, 18.6, 22.8, 27.9}, kMass = {0.031, 0.104, 0.197, 0.294, 0.488};

json to_json(const LibraryFabric& f) {
  json out = {{"name", f.name}, {"areal_mass", f.areal_mass}, {"bend_warp", f.bend_warp}, {"bend_weft", f.bend_weft}};
  if (f.second_order_warp) out["second_order_warp"] = *f.second_order_warp;
  if (f.second_order_weft) out["second_order_weft"] = *f.second_order_weft;
  return out;
}

LibraryFabric read_fabric(const JsonReader& json, const std::string& source) {
  LibraryFabric f{json.text("name"),
                  source,
                  json.positive("areal_mass"),
                  json.positive("bend_warp"),
                  json.positive("bend_weft"),
                  {},
                  {}};
  if (json.has("second_order_warp")) f.second_order_warp = json.number("second_order_warp");
  if (json.has("second_order_weft")) f.second_order_weft = json.number("second_order_weft");
  return f;
}

std::string trimmed(const std::string& text) {
  const size_t begin = text.find_first_not_of(" \t\r\"\xEF\xBB\xBF"), end = text.find_last_not_of(" \t\r\"");
  return begin == std::string::npos ? "" : text.substr(begin, end - begin + 1);
}

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream stream(line);
  for (std::string cell; std::getline(stream, cell, ',');) cells.push_back(trimmed(cell));
  return cells;
}

struct TableColumn {
  size_t at = 0;
  double scale = 1;  // of the numbers in the file
};

// Our names to columns, by what a header calls them.
std::map<std::string, TableColumn> columns_of(const std::vector<std::string>& header) {
  static const std::map<std::string, std::string> ours = {{"name", "name"},
                                                          {"areal_mass", "areal_mass"},
                                                          {"density", "areal_mass"},
                                                          {"bend_warp", "bend_warp"},
                                                          {"linear warp", "bend_warp"},
                                                          {"bend_weft", "bend_weft"},
                                                          {"linear weft", "bend_weft"},
                                                          {"second_order_warp", "second_order_warp"},
                                                          {"nonlinear warp", "second_order_warp"},
                                                          {"second_order_weft", "second_order_weft"},
                                                          {"nonlinear weft", "second_order_weft"}};
  std::map<std::string, TableColumn> out;
  for (size_t i = 0; i < header.size(); ++i) {
    const size_t bracket = header[i].find('[');
    const auto known = ours.find(trimmed(header[i].substr(0, bracket)));
    if (known == ours.end()) continue;
    TableColumn column{i, 1};
    const size_t scale = header[i].find("SI*", bracket == std::string::npos ? header[i].size() : bracket);
    if (scale != std::string::npos) column.scale = std::strtod(header[i].c_str() + scale + 3, nullptr);
    if (column.scale > 0) out[known->second] = column;
  }
  return out;
}

double number_in(const std::string& cell, const TableColumn& column, const std::string& where) {
  char* end = nullptr;
  const double value = std::strtod(cell.c_str(), &end);
  if (cell.empty() || *end != 0 || !std::isfinite(value))
    refuse(where, "column {}: found {}, expected a finite number", column.at + 1, in_quotes(cell));
  return value / column.scale;
}

double percentile_in(std::vector<double> values, double value) {
  std::sort(values.begin(), values.end());
  const auto below = std::lower_bound(values.begin(), values.end(), value) - values.begin();
  return 100.0 * static_cast<double>(below) / static_cast<double>(values.size());
}

// Between published percentiles; 0 and 100 where beyond them.
double percentile_in(const std::array<double, 5>& values, double value) {
  if (value < values.front()) return 0;
  if (value > values.back()) return 100;
  size_t i = 1;
  while (i + 1 < values.size() && value > values[i]) ++i;
  const double share = std::log(value / values[i - 1]) / std::log(values[i] / values[i - 1]);
  return kPercent[i - 1] + share * (kPercent[i] - kPercent[i - 1]);
}

std::string text_of(double percentile, bool published) {
  if (published && percentile == 0) return "below the 5th percentile";
  if (published && percentile == 100) return "above the 95th percentile";
  return fmt::format("percentile {:.0f}", percentile);
}

}  // namespace

double mean_bend(const LibraryFabric& fabric) { return std::sqrt(fabric.bend_warp * fabric.bend_weft); }

double bending_length(const LibraryFabric& fabric) { return bending_length_m(mean_bend(fabric), fabric.areal_mass); }

fs::path library_folder(const fs::path& given) {
  if (!given.empty()) return given;
  const char* data = std::getenv("XDG_DATA_HOME");
  if (data != nullptr && *data != 0) return fs::path(data) / "selvedge" / "fabrics";
  const char* home = std::getenv("HOME");
  return fs::path(home != nullptr ? home : ".") / ".local" / "share" / "selvedge" / "fabrics";
}

std::vector<LibraryFabric> read_library(const fs::path& folder) {
  std::vector<LibraryFabric> out;
  std::error_code error;
  if (!fs::is_directory(folder, error)) return out;
  std::vector<fs::path> found;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    if (entry.path().extension() == ".json") found.push_back(entry.path());
  std::sort(found.begin(), found.end());
  for (const fs::path& file : found) {
    const JsonReader json(file);
    json.choice("format", {"fabrics/1"});
    const std::string source = json.text("source");
    for (const JsonReader& fabric : json.children("fabrics")) out.push_back(read_fabric(fabric, source));
  }
  return out;
}

LibraryFabric fabric_named(const std::vector<LibraryFabric>& library, const std::string& name, const fs::path& folder) {
  std::vector<LibraryFabric> found;
  for (const LibraryFabric& f : library)
    if (f.name == name) found.push_back(f);
  if (found.empty())
    refuse(folder.string(), "found no fabric {} among {}, expected one (./selvedge fabrics lists them)",
           in_quotes(name), library.size());
  if (found.size() > 1)
    refuse(folder.string(), "found {} of {} and of {}, expected one of that name", in_quotes(name),
           in_quotes(found[0].source), in_quotes(found[1].source));
  return found.front();
}

LibraryFabric fabric_of_fit(const fs::path& fit_json) {
  const JsonReader fit(fit_json);
  fit.choice("format", {"fit/1"});
  if (fit.has("simulator"))
    refuse(fit.where("simulator"),
           "found a fit of {}, expected one of Selvedge's own sheet: parameters mean the same in "
           "it alone",
           fit.child("simulator").text("name"));
  const JsonReader parameters = fit.child("parameters");
  const double bend = parameters.child("bend").positive("value");
  double anisotropy = 0;
  if (parameters.has("bend_anisotropy")) anisotropy = parameters.child("bend_anisotropy").number("value");
  const JsonReader fabric = fit.child("fabric");
  LibraryFabric out;
  out.name = fabric.text("name").empty() ? fit.text("campaign") : fabric.text("name");
  out.source = fmt::format("fit of {}", fit.text("campaign"));
  out.areal_mass = fabric.positive("areal_mass");
  out.bend_warp = bend * std::exp(anisotropy);
  out.bend_weft = bend * std::exp(-anisotropy);
  return out;
}

std::vector<LibraryFabric> fabrics_of_table(const fs::path& table) {
  std::istringstream lines(files::read_whole(table));
  std::string line;
  std::getline(lines, line);
  const auto columns = columns_of(cells_of(line));
  for (const char* needed : {"areal_mass", "bend_warp", "bend_weft"})
    if (!columns.count(needed)) refuse(table.string() + ":1", "found no column {}, expected it", needed);
  std::vector<LibraryFabric> out;
  for (size_t number = 2; std::getline(lines, line); ++number) {
    if (trimmed(line).empty()) continue;
    const std::vector<std::string> cells = cells_of(line);
    const std::string where = fmt::format("{}:{}", table.string(), number);
    const auto value = [&](const char* name) {
      const TableColumn& column = columns.at(name);
      return number_in(column.at < cells.size() ? cells[column.at] : "", column, where);
    };
    LibraryFabric f{fmt::format("{}-{}", table.stem().string(), number),
                    table.filename().string(),
                    value("areal_mass"),
                    value("bend_warp"),
                    value("bend_weft"),
                    {},
                    {}};
    if (!(f.areal_mass > 0 && f.bend_warp > 0 && f.bend_weft > 0))
      refuse(where, "found a mass of {} and rigidities of {} and {}, expected them above 0", f.areal_mass, f.bend_warp,
             f.bend_weft);
    if (columns.count("name") && columns.at("name").at < cells.size()) f.name = cells[columns.at("name").at];
    if (columns.count("second_order_warp")) f.second_order_warp = value("second_order_warp");
    if (columns.count("second_order_weft")) f.second_order_weft = value("second_order_weft");
    out.push_back(std::move(f));
  }
  if (out.empty()) refuse(table.string(), "found a header and no rows, expected fabrics");
  return out;
}

void add_to_library(const fs::path& folder, const std::string& file, const std::vector<LibraryFabric>& fabrics) {
  const fs::path path = folder / (file + ".json");
  if (fs::exists(path)) refuse(path.string(), "found it there already, expected a name that is not taken");
  json list = json::array();
  for (const LibraryFabric& f : fabrics) list.push_back(to_json(f));
  fs::create_directories(folder);
  files::write_json(path, {{"format", "fabrics/1"}, {"source", fabrics.front().source}, {"fabrics", list}});
}

std::vector<std::string> place_among(const std::vector<LibraryFabric>& library, double bending_length_m,
                                     double areal_mass) {
  constexpr size_t kEnough = 20;
  constexpr double kNearLength = 1.25, kNearMass = 1.6;  // factors
  const bool published = library.size() < kEnough;
  double at_length = 0, at_mass = 0;
  bool near = false;
  if (published) {
    at_length = percentile_in(kLength_mm, 1e3 * bending_length_m);
    at_mass = percentile_in(kMass, areal_mass);
    near = at_length > 0 && at_length < 100 && at_mass > 0 && at_mass < 100;
  } else {
    std::vector<double> lengths, masses;
    for (const LibraryFabric& f : library) {
      lengths.push_back(bending_length(f));
      masses.push_back(f.areal_mass);
      near = near || (std::abs(std::log(bending_length(f) / bending_length_m)) < std::log(kNearLength) &&
                      std::abs(std::log(f.areal_mass / areal_mass)) < std::log(kNearMass));
    }
    at_length = percentile_in(lengths, bending_length_m);
    at_mass = percentile_in(masses, areal_mass);
  }
  const std::string among = published ? "618 fabrics of a drape tester (Feng et al. 2022)"
                                      : fmt::format("{} fabrics of the library", library.size());
  const double bend = bend_of(bending_length_m, areal_mass);
  std::vector<std::string> out = {fmt::format(
      "among {}: bending length {:.1f} mm at {} ({:.3g} µN·m, {:.2g} gf·cm²/cm), areal mass {:.0f} g/m² at {}", among,
      1e3 * bending_length_m, text_of(at_length, published), 1e6 * bend, gram_force_cm(bend), 1e3 * areal_mass,
      text_of(at_mass, published))};
  if (!near)
    out.push_back(published ? "no real fabric is known to lie there: outside nine tenths of them"
                            : fmt::format("no fabric of the library lies near: none within a factor of {} in bending "
                                          "length and {} in mass",
                                          kNearLength, kNearMass));
  return out;
}

}  // namespace selvedge::material_tests
