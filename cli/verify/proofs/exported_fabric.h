// A fabric that is hung by two corners and waved by one: by another simulator over simulator/1 with what `export --as`
// writes of it, and by our sheet.
#pragma once

#include <map>
#include <string>

#include "cloth/material.h"
#include "cloth/simulate.h"
#include "cloth/spline/spline_sheet.h"
#include "model/simulator.h"
#include "station/exchange/material_export.h"

namespace selvedge::cli {

inline constexpr double kHungSide_m = 0.3;

// Of the base model alone, which is what a fit says: what else a drawn fabric has is left at its neutral value.
cloth::Material base_of(const cloth::Material& material);
station::FittedFabric fitted_as(const std::string& name, const cloth::Material& material);

// The numbers of an exported text, by the worked example's names of them.
std::map<std::string, double> blender_values(const std::string& exported);
std::map<std::string, double> bullet_values(const std::string& exported);

// The exported line that names what a format cannot say, without its beginning; empty where there is none.
std::string unsaid_in(const std::string& exported);

// By corners 0.85 of the width apart, the right one waved by 50 mm at 1.25 Hz.
cloth::Experiment hung_and_waved(const cloth::Material& material, double seconds);

// Finer than the fabric's bending length.
cloth::spline::SplineSheet hung_sheet(const cloth::Material& material);

struct HungApart {
  double rest_mm = 0, motion_mm = 0;  // root mean square over 25 points, and over times; infinite where one diverged
};

// Our equilibrium is sought from where the other one hangs: of several it is the one beside. One that begins at shapes
// is given a bulge to one side.
HungApart apart_of(const model::Simulator& other, const cloth::spline::SplineSheet& sheet, cloth::Experiment experiment,
                   std::map<std::string, double> values);

}  // namespace selvedge::cli
