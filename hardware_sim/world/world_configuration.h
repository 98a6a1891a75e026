// What the simulated rig is like: the truth that calibration and fit are to find. It lies in a file that the
// simulated devices alone read; nothing of it travels on the bus or over a device's wire.
//
// world.toml, every key optional:
//   [fabric]     width_m height_m density stretch shear bend stretch_damping shear_damping bend_damping
//                drag_normal drag_tangent drag_fade      as in hardware_sim/world/lattice_sheet.h
//   [lattice]    cells_across cells_down sag_side (+1 away from the camera, −1 towards it)
//   [air]        velocity_m_s
//   [camera]     position_m look_at_m focal_px (two) principal_px (two) distortion (five) width_px height_px
//                noise_grey blur_px background_grey ambient_grey lit_grey
//   [projector]  position_m look_at_m focal_px principal_px distortion width_px height_px blur_px
//   [grid]       columns rows spacing_m fold_rad disc_diameter_m ground_diameter_m margin_m
//                centre_m spread_m yaw_rad pitch_rad roll_rad
//   [stand]      left_m separation_m
//   [hand]       carry_s sway_m
//   [arm]        base_position_m base_rpy_deg   as in the rig's own configuration
//   [knock]      device ("camera", "projector") turn_deg before_trial   somebody runs into it before the trial of that
//                number (1 is the first) is hung
//   [swatches]   names, in the order in which a session asks for them (OPERATOR_PROMPT "change_swatch", index); without
//                it [fabric] is the only one
//   [swatches.NAME]  as [fabric], and effect, strength: something that it has beyond (hardware_sim/bank/named_extra.h)
//   [world]      seed
//   [devices]    hardware_sim/simulated_rig.h;  [bus] as in the rig's own configuration
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include "calib/marker_grid.h"
#include "geometry/projection.h"
#include "hardware_sim/world/fabric_picture.h"
#include "hardware_sim/world/lattice_sheet.h"
#include "hardware_sim/world/operator_hand.h"
#include "rig/configuration.h"

namespace selvedge::hardware_sim {

// One of several fabrics that a person hangs in turn.
struct Swatch {
  std::string name;
  FabricTruth fabric;
  std::string effect;  // empty: none
  double strength = 0;
  std::shared_ptr<LatticeExtra> extra;  // of that effect; whoever knows the effects fills it in
  double step_share = 1;
};

// A device turned about its own axes (x right, y down, z forward).
struct Knock {
  enum class Device { none, camera, projector };
  Device device = Device::none;
  Eigen::Vector3d turn_deg = Eigen::Vector3d::Zero();
  int before_trial = 0;
};

struct WorldConfiguration {
  FabricTruth fabric;
  std::vector<Swatch> swatches;  // empty: `fabric` alone; else `fabric` is the first
  LatticeOptions lattice;
  double sag_side = 1;  // +1: the fabric bulges away from the camera
  geometry::Projection camera, projector;
  PictureOptions picture;
  double noise_grey = 1;
  calib::MarkerGrid grid{.columns = 6,
                         .rows = 5,
                         .spacing_m = 0.062,
                         .fold_rad = 0.9,
                         .disc_diameter_m = 0.012,
                         .ground_diameter_m = 0.034,
                         .margin_m = 0.03};
  BoardPoses board;
  Eigen::Vector3d left_m = Eigen::Vector3d(-0.128, 0, 0);
  double separation_m = 0.256;  // of the corners while hanging, along +x, unless a prompt says otherwise
  HandOptions hand;
  Eigen::Isometry3d world_from_arm = Eigen::Isometry3d::Identity();
  Knock knock;
  unsigned seed = 1;
};

// The world after its knock.
WorldConfiguration knocked(WorldConfiguration world);

// The sections above.
const std::vector<std::string>& world_sections();

// Throws BadInput for unknown keys and values out of range. A configuration without any section is the
// default world.
WorldConfiguration read_world(const rig::Configuration& configuration);

// The truth in the names and units of the exchange format's fit and calibration, for comparing afterwards.
nlohmann::json truth_json(const WorldConfiguration& world);

}  // namespace selvedge::hardware_sim
