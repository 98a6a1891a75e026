// Marker campaigns of a simulated world (worlds.h), each with a key that says what its fabric, air, rig or clock has
// beyond the base model. No world shares a mesh, an integrator or its constitutive form with the model.
//
// Trials as a lab would record them: some hang still at different separations, some are waved, the last two are the
// same robot motion after hanging the swatch afresh. How many, how long, and what is seen of them: bank_design.h.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "hardware_sim/bank/bank_design.h"
#include "hardware_sim/bank/worlds.h"

namespace selvedge::hardware_sim {

struct BankEffect {
  std::string name;  // of the exchange format
  double size = 0;   // in the unit of fabric_extras.cpp, or as bank_campaign.cpp says
};

struct BankKey {
  BankWorld world = BankWorld::lattice;
  std::vector<BankEffect> effects;  // of the library
  std::string hidden;               // the effect outside the library, empty: none
  double hidden_size = 0;
  FabricTruth truth;
  BankDesign design;
  unsigned seed = 0;  // of motion and noise

  std::string cause() const;                        // "none", "unknown", or the effects' names, joined by "+"
  double size_of(const std::string& effect) const;  // zero where it has not this one
};

// Effects of the format that these worlds can make.
const std::vector<std::string>& bank_effects();

// kind: "none", "known" (one of bank_effects(), each as likely), "outside" or "set" (two or three of bank_effects()).
// Sizes are as plain on a soft or light fabric as on a stiff or heavy one.
BankKey draw_key(const std::string& kind, BankWorld world, std::mt19937_64& generator);

nlohmann::json to_json(const BankKey& key);
BankKey bank_key(const nlohmann::json& json);

// The plainest parameter of a key's one effect under its name and in its unit in diagnosis.json's effect_size, and its
// value; nothing where the library's effect has none of the same kind (hem, stiffening, rest curvature), or the key's
// not one effect.
std::optional<std::pair<std::string, double>> true_parameter(const BankKey& key);

// Simulates and writes the campaign; its files name nothing but `name`. Throws std::runtime_error where a simulation
// diverges.
void write_bank_campaign(const BankKey& key, const std::string& name, const std::filesystem::path& folder);

// At most seven more trials of at most two seconds, other motions of the same kinds, of the same swatch on the same
// rig: no answer was fitted to them. The same motions and noise whatever effects the key has.
void write_fresh_trials(const BankKey& key, const std::string& name, const std::filesystem::path& folder);

// How a trial of the bank moves: the tracked corners.
struct BankMotion {
  double separation_m = 0.285;
  Eigen::Vector3d amplitude_m = Eigen::Vector3d::Zero();
  double frequency_hz = 1.2, phase = 0;
  double left_share = 0;  // of the right corner's way that the left one goes
  Eigen::Vector3d left(double time_s) const;
  Eigen::Vector3d right(double time_s) const;
};
BankMotion draw_waving(SwatchHold hold, std::mt19937_64& generator);

}  // namespace selvedge::hardware_sim
