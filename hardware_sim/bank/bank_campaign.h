// Marker campaigns of the simulated world, each with a key that says what its fabric, air, rig or clock has beyond
// the base model. The world (lattice_sheet.h) shares no mesh, integrator or constitutive form with the model.
//
// Seven trials as a lab would record them: two hang still at different separations, three are waved, two are the
// same robot motion after hanging the swatch afresh. 25 dots, 120 Hz, 1.7 s, 0.3 mm of noise per axis.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <random>
#include <string>
#include <utility>

#include <nlohmann/json_fwd.hpp>

#include "hardware_sim/world/lattice_sheet.h"

namespace selvedge::hardware_sim {

struct BankKey {
  std::string cause;   // "none", a name of the exchange format, or "unknown"
  std::string hidden;  // the hidden effect behind "unknown"
  double size = 0;     // in the unit of fabric_extras.cpp, or as campaign_of says
  std::string second;  // another effect at once, empty: none
  double second_size = 0;
  FabricTruth truth;
  unsigned seed = 0;  // of motion and noise
};

// Effects of the format that this world can make, and usual sizes.
const std::vector<std::string>& bank_effects();

// kind: "none", "known" (one of bank_effects(), each as likely), "outside" or "pair" (two of bank_effects()).
BankKey draw_key(const std::string& kind, std::mt19937_64& generator);

// "cause" of a pair: both names, joined by "+".
nlohmann::json to_json(const BankKey& key);
BankKey bank_key(const nlohmann::json& json);

// The plainest parameter of a key's one effect under its name and in its unit in diagnosis.json's effect_size, and its
// value; nothing where the library's effect has none of the same kind (hem, stiffening, rest curvature), or the key's
// not one effect.
std::optional<std::pair<std::string, double>> true_parameter(const BankKey& key);

// Simulates and writes the campaign; its files name nothing but `name`.
void write_bank_campaign(const BankKey& key, const std::string& name, const std::filesystem::path& folder);

// Seven more trials, other motions of the same kinds, of the same swatch on the same rig: no answer was fitted to them.
void write_fresh_trials(const BankKey& key, const std::string& name, const std::filesystem::path& folder);

}  // namespace selvedge::hardware_sim
