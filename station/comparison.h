// Two results side by side: which parameters differ beyond their intervals, how far each predicts what it did not see,
// and how each splits its gap.
//
// A result is the folder of a fit (fit.json), of a diagnosis (diagnosis.json), of both, or of a session (session.json,
// with a folder a fabric). Two sessions are compared fabric by fabric; a session beside a single result must have one
// fabric alone.
//   difference = B − A;  ratio = B / A;  apart: the two 90 % intervals do not overlap.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace selvedge::station {

// One fabric's result on one side. What is not there is null.
struct ComparedResult {
  std::filesystem::path fit_folder, diagnosis_folder;
  nlohmann::json fit, diagnosis, trials;  // trials: of session.json
};

struct ComparedPair {
  std::string name;
  ComparedResult a, b;
};

struct Comparison {
  std::filesystem::path a, b;
  std::vector<ComparedPair> pairs;
  std::vector<std::string> only_a, only_b;  // fabrics of one session that the other lacks
};

// Throws BadInput where a folder holds no result, a file is damaged, or the two cannot be paired.
Comparison read_comparison(const std::filesystem::path& a, const std::filesystem::path& b);

// {"format": "comparison/1", "verdict", "a", "b", "pairs": [{"name", "verdict", "better" (comparison_verdict.h),
// "verdicts": {"fit", "diagnosis"}, "held_out_mm", "rigid_plate_mm", "parameters": {NAME: {"unit", "a", "b",
// "difference", "ratio", "apart"}}, "trials": {NAME: {…}}, "gap": {…}, "effects": {…}, "where": […], "session": {…}}],
// "only_a", "only_b"}. Numbers are {"a", "b", "difference"}; null where a side has none.
nlohmann::json to_json(const Comparison& comparison);

// compare.json and report.html, each whole or not at all. Returns the former.
nlohmann::json write_comparison(const Comparison& comparison, const std::filesystem::path& folder);

// The verdict, then a line a fabric, for the terminal.
std::string comparison_text(const nlohmann::json& comparison);

}  // namespace selvedge::station
