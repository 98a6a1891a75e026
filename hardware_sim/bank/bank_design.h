// What a bank draws: a fabric as real ones are, and the design of a campaign.
//
// Fabric: areal mass and bending length by the percentiles of 618 fabrics on a drape tester, stretch and shear of one
// of ten (Wang, O'Brien, Ramamoorthi, "Data-driven elastic models for cloth", 2011), both ways alike. Where a fabric
// would stretch by more than a tenth under its own weight another of the ten is taken. Losses, which nobody measured
// with these: the membrane's of FabricTruth, bending's in proportion to its rigidity.
#pragma once

#include <array>
#include <random>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "capture/trial/trial.h"
#include "hardware_sim/sheets/swatch_sheet.h"
#include "hardware_sim/world/lattice_sheet.h"

namespace selvedge::hardware_sim {

struct BankTrial {
  trial::Experiment kind = trial::Experiment::waving;
  double duration_s = 1.667;
};

struct BankDesign {
  SwatchHold hold = SwatchHold::corners;
  int dots_across = 5, dots_down = 5;
  double rate_hz = 120, noise_m = 3e-4;  // of a coordinate
  std::vector<BankTrial> trials;         // the last two that are a robot's are one motion
};

// Seven trials of 1.7 s, 25 dots, 120 Hz, 0.3 mm, held by the corners.
BankDesign usual_design();

// Dots 9 to 100, 30 to 240 Hz, 0.1 to 2 mm, three to twelve trials of 1 to 10 s, held as draw_hold says.
BankDesign draw_design(const FabricTruth& fabric, std::mt19937_64& generator);

// One in three by the whole edge; and every fabric of less than kCornersFrom_m of bending length, which by its corners
// hangs in a shape that depends on the mesh of every world (./selvedge prove worlds); and every one that half its
// weight would stretch by more than three tenths at a grip of a corner.
SwatchHold draw_hold(const FabricTruth& fabric, std::mt19937_64& generator);
constexpr double kCornersFrom_m = 0.016;

// Of ten fabrics, N/m (the same source): stiffness at small strain, both ways at a stretch of a sixth, and what one way
// does to the other.
struct MeasuredStretch {
  const char* name;
  double one_way, other_way, one_way_far, other_way_far, coupling, shear;
};
const std::array<MeasuredStretch, 10>& measured_stretch();

FabricTruth draw_fabric(std::mt19937_64& generator);

constexpr double kSwatch_m = 0.3;  // both ways
// The cube root of bending rigidity over weight per area.
double bending_length_m(const FabricTruth& truth);

nlohmann::json to_json(const BankDesign& design);
BankDesign bank_design(const nlohmann::json& json);

double uniform(std::mt19937_64& generator, double low, double high);
double log_uniform(std::mt19937_64& generator, double low, double high);

}  // namespace selvedge::hardware_sim
