// The parts of a trial's folder that hold a material test: keys of trial.json, and midline.csv, outline.csv or
// pull.csv.
#pragma once

#include <filesystem>

#include <nlohmann/json.hpp>

#include "capture/trial/trial.h"
#include "files/json_reader.h"

namespace selvedge::trial {

// What trial.json says of the test that `trial.experiment` names. Throws BadInput naming the key.
void read_material_test(const files::JsonReader& json, Trial& trial);

// The tables of the test, from trial.folder. Throws BadInput naming file and line.
void read_material_tables(const files::JsonReader& json, Trial& trial);

// What read_material_test reads back.
void add_material_test(const Trial& trial, nlohmann::json& trial_json);

void write_material_tables(const Trial& trial, const std::filesystem::path& folder);

}  // namespace selvedge::trial
