#include "capture/trial/material_test_files.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "files/bad_input.h"
#include "files/csv_table.h"
#include "files/whole_file.h"
#include "geometry/polyline.h"

namespace selvedge::trial {

namespace fs = std::filesystem;
using Eigen::Index;
using Eigen::Matrix2Xd;
using files::append_number;
using files::CsvTable;
using files::JsonReader;

namespace {

constexpr double kLongest_m = 10;  // of anything on a bench

double length(const JsonReader& json, const std::string& key) {
  const double value = json.positive(key);
  if (value > kLongest_m) refuse(json.where(key), "found {} m, expected at most {} m", value, kLongest_m);
  return value;
}

double angle_deg(const JsonReader& json) {
  const double angle = json.number("angle_deg");
  if (std::abs(angle) > 180) refuse(json.where("angle_deg"), "found {}, expected -180 to 180 degrees", angle);
  return angle;
}

// First row of each run of rows with the same number in column 0, and the end.
std::vector<size_t> runs_of(const CsvTable& table, const char* name) {
  std::vector<size_t> begins;
  std::vector<int> seen;
  for (size_t row = 0; row < table.rows(); ++row) {
    const int number = files::whole_number(table, row, 0, name);
    if (!seen.empty() && seen.back() == number) continue;
    if (std::find(seen.begin(), seen.end(), number) != seen.end())
      refuse(table.where(row), "{}: found {} again, expected all of its rows one after another", name, number);
    seen.push_back(number);
    begins.push_back(row);
  }
  begins.push_back(table.rows());
  return begins;
}

CsvTable read_rows(const fs::path& path, const std::vector<files::CsvColumn>& wanted, size_t least) {
  CsvTable table = files::read_csv(path, wanted);
  if (table.rows() < least) refuse(path.string(), "found {} rows, expected at least {}", table.rows(), least);
  return table;
}

void read_midline(const JsonReader& json, Trial& trial) {
  Cantilever& test = *trial.cantilever;
  const fs::path path = trial.folder / "midline.csv";
  std::error_code error;
  if (!fs::exists(path, error)) {
    if (test.bending_length_m) return;
    refuse(json.where("cantilever"), "found neither bending_length_m nor a file midline.csv, expected one of them");
  }
  const CsvTable table = read_rows(path, {{"along_m"}, {"down_m"}}, 4);
  test.midline_m.resize(2, static_cast<Index>(table.rows()));
  for (size_t row = 0; row < table.rows(); ++row)
    test.midline_m.col(static_cast<Index>(row)) << table(row, 0), table(row, 1);
  const double seen = geometry::polyline_length(test.midline_m);
  if (seen < 0.3 * test.overhang_m || seen > 1.1 * test.overhang_m)
    refuse(path.string(), "found a line {:.4g} m long, expected 0.3 to 1.1 times overhang_m, which is {:.4g} m", seen,
           test.overhang_m);
  const size_t last = table.rows() - 1;
  if (!(table(last, 1) > 0))
    refuse(table.where(last), "down_m: found a tip at {} m, expected it below the edge: down_m counts downwards",
           table(last, 1));
}

void read_outlines(Trial& trial) {
  Cusick& test = *trial.cusick;
  constexpr size_t kFewest = 16;
  const CsvTable table = read_rows(trial.folder / "outline.csv", {{"capture"}, {"x_m"}, {"y_m"}}, kFewest);
  const std::vector<size_t> begins = runs_of(table, "capture");
  for (size_t k = 0; k + 1 < begins.size(); ++k) {
    const size_t begin = begins[k], count = begins[k + 1] - begin;
    Outline outline{files::whole_number(table, begin, 0, "capture"), Matrix2Xd(2, static_cast<Index>(count))};
    if (count < kFewest)
      refuse(table.where(begin), "found {} points of capture {}, expected at least {}", count, outline.capture,
             kFewest);
    for (size_t i = 0; i < count; ++i) {
      const Eigen::Vector2d p(table(begin + i, 1), table(begin + i, 2));
      if (p.norm() > 0.55 * test.disc_m)
        refuse(table.where(begin + i),
               "found a point {:.4g} m from the centre, expected at most the disc's radius, {} m", p.norm(),
               test.disc_m / 2);
      outline.point_m.col(static_cast<Index>(i)) = p;
    }
    if (!(geometry::polygon_area(outline.point_m) > 0))
      refuse(table.where(begin), "found capture {} running clockwise, expected anticlockwise", outline.capture);
    test.outlines.push_back(std::move(outline));
  }
}

void read_pulls(Trial& trial) {
  constexpr size_t kFewest = 4;
  const CsvTable table =
      read_rows(trial.folder / "pull.csv",
                {{"pull"}, {"t_s"}, {"force_n"}, {"stretch_along"}, {"stretch_across", true}}, kFewest);
  const std::vector<size_t> begins = runs_of(table, "pull");
  for (size_t k = 0; k + 1 < begins.size(); ++k) {
    Pull pull;
    pull.number = files::whole_number(table, begins[k], 0, "pull");
    if (begins[k + 1] - begins[k] < kFewest)
      refuse(table.where(begins[k]), "found {} rows of pull {}, expected at least {}", begins[k + 1] - begins[k],
             pull.number, kFewest);
    for (size_t row = begins[k]; row < begins[k + 1]; ++row) {
      if (!pull.time_s.empty() && table(row, 1) < pull.time_s.back())
        refuse(table.where(row), "t_s: found {} after {}, expected times that do not go backwards", table(row, 1),
               pull.time_s.back());
      for (const size_t column : {size_t{3}, size_t{4}})
        if (table(row, column) <= 0)
          refuse(table.where(row), "{}: found {}, expected length over rest length, above 0",
                 column == 3 ? "stretch_along" : "stretch_across", table(row, column));
      pull.time_s.push_back(table(row, 1));
      pull.force.push_back(table(row, 2));
      pull.stretch_along.push_back(table(row, 3));
      pull.stretch_across.push_back(table(row, 4));
    }
    trial.tensile->pulls.push_back(std::move(pull));
  }
}

// The rest of a row: x, y.
void append_point(std::string& text, const Matrix2Xd& points, Index i) {
  append_number(text, points(0, i));
  text += ',';
  append_number(text, points(1, i));
  text += '\n';
}

std::string midline_csv(const Cantilever& test) {
  std::string text = "along_m,down_m\n";
  for (Index i = 0; i < test.midline_m.cols(); ++i) append_point(text, test.midline_m, i);
  return text;
}

std::string outline_csv(const Cusick& test) {
  std::string text = "capture,x_m,y_m\n";
  for (const Outline& outline : test.outlines)
    for (Index i = 0; i < outline.point_m.cols(); ++i) {
      text += std::to_string(outline.capture) + ',';
      append_point(text, outline.point_m, i);
    }
  return text;
}

std::string pull_csv(const Tensile& test) {
  std::string text = "pull,t_s,force_n,stretch_along,stretch_across\n";
  for (const Pull& pull : test.pulls)
    for (size_t i = 0; i < pull.time_s.size(); ++i) {
      text += std::to_string(pull.number);
      for (const auto* column : {&pull.time_s, &pull.force, &pull.stretch_along, &pull.stretch_across}) {
        text += ',';
        append_number(text, (*column)[i]);
      }
      text += '\n';
    }
  return text;
}

}  // namespace

bool is_material_test(Experiment experiment) {
  return experiment == Experiment::cantilever || experiment == Experiment::cusick || experiment == Experiment::tensile;
}

double areal_mass(const Trial& trial) {
  const double area = trial.cusick ? std::numbers::pi / 4 * trial.cusick->disc_m * trial.cusick->disc_m
                                   : trial.fabric.width_m * trial.fabric.height_m;
  return trial.fabric.mass_kg / area;
}

Campaign only_tests(const Campaign& campaign, bool tests) {
  Campaign part = campaign;
  std::erase_if(part.trials, [&](const Trial& t) { return is_material_test(t.experiment) != tests; });
  const auto is_left_out = [&](const std::string& name) {
    return std::none_of(part.trials.begin(), part.trials.end(), [&](const Trial& t) { return t.name == name; });
  };
  for (std::vector<std::string>& group : part.replicates) std::erase_if(group, is_left_out);
  std::erase_if(part.replicates, [](const std::vector<std::string>& group) { return group.size() < 2; });
  return part;
}

void read_material_test(const JsonReader& json, Trial& trial) {
  const JsonReader keys = json.child(to_text(trial.experiment));
  if (trial.experiment == Experiment::cantilever) {
    trial.cantilever = Cantilever{angle_deg(keys), length(keys, "overhang_m"), std::nullopt, {}};
    if (keys.has("bending_length_m")) trial.cantilever->bending_length_m = length(keys, "bending_length_m");
  } else if (trial.experiment == Experiment::cusick) {
    trial.cusick = Cusick{length(keys, "disc_m"), length(keys, "support_m"), {}};
    if (trial.cusick->support_m >= trial.cusick->disc_m)
      refuse(keys.where("support_m"), "found {} m, expected less than disc_m, {} m", trial.cusick->support_m,
             trial.cusick->disc_m);
  } else {
    trial.tensile = Tensile{angle_deg(keys), length(keys, "width_m"), length(keys, "length_m"), "N", {}};
    if (keys.has("force_unit")) trial.tensile->force_unit = keys.text("force_unit");
  }
}

void read_material_tables(const JsonReader& json, Trial& trial) {
  if (trial.cantilever) read_midline(json, trial);
  if (trial.cusick) read_outlines(trial);
  if (trial.tensile) read_pulls(trial);
}

void add_material_test(const Trial& trial, nlohmann::json& trial_json) {
  nlohmann::json keys;
  if (trial.cantilever) {
    keys = {{"angle_deg", trial.cantilever->angle_deg}, {"overhang_m", trial.cantilever->overhang_m}};
    if (trial.cantilever->bending_length_m) keys["bending_length_m"] = *trial.cantilever->bending_length_m;
  } else if (trial.cusick) {
    keys = {{"disc_m", trial.cusick->disc_m}, {"support_m", trial.cusick->support_m}};
  } else if (trial.tensile) {
    keys = {{"angle_deg", trial.tensile->angle_deg},
            {"width_m", trial.tensile->width_m},
            {"length_m", trial.tensile->length_m},
            {"force_unit", trial.tensile->force_unit}};
  }
  trial_json[to_text(trial.experiment)] = keys;
}

void write_material_tables(const Trial& trial, const fs::path& folder) {
  if (trial.cantilever && trial.cantilever->midline_m.cols() > 0)
    files::write_whole(folder / "midline.csv", midline_csv(*trial.cantilever));
  if (trial.cusick) files::write_whole(folder / "outline.csv", outline_csv(*trial.cusick));
  if (trial.tensile) files::write_whole(folder / "pull.csv", pull_csv(*trial.tensile));
}

}  // namespace selvedge::trial
