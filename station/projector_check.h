// Which projector pixels light the fabric about each held corner, before a trial while it hangs at rest: the
// projector's stand in both coordinates and without the stripes' ambiguity, at the cost of some twenty images.
//
// Coarse grey code (calib/pattern_step.h) of rows and columns; the camera pixels within some radius of each corner are
// decoded, and near the corner p₀
//   projector(p) = q₀ + G (p − p₀),   weight exp(−|p − p₀|² / 2 w²), Cauchy's on the residual
// q₀ is compared with what the projector's matrix gives the tracked corner (station/calibration_watch.h).
//
// TRIAL/projector-check.csv: corner,x,y,z,camera_u,camera_v,projector_u,projector_v: 0 left, 1 right, the tracked
// corner (m), and one decoded camera pixel a line. px.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <vector>

#include "calib/structured_light.h"
#include "capture/session/rig_client.h"
#include "capture/session/run_trial.h"

namespace selvedge::station {

struct CodedCorner {
  Eigen::Vector3d tracked;
  std::vector<Eigen::Vector2d> camera, projector;  // of the same light, px

  // q₀ at a camera pixel; nullopt where too few pixels could be read.
  std::optional<Eigen::Vector2d> projector_at(const Eigen::Vector2d& camera_px) const;
};

using ProjectorCheck = std::array<std::optional<CodedCorner>, 2>;  // left, right

// From the patterns' images (calib::coarse_code_sequence) of a fabric at rest.
ProjectorCheck decode_corners(const std::vector<calib::PatternImage>& sequence,
                              const std::array<std::optional<Eigen::Vector3d>, 2>& tracked,
                              const geometry::Projection& camera);

// Shows the patterns and looks. Corners that the tracker does not see or whose pixels cannot be read are none.
ProjectorCheck check_projector(session::RigClient& rig, const session::RigOptics& optics);

void write_projector_check(const ProjectorCheck& check, const std::filesystem::path& trial_folder);
// nullopt where the trial has none. Throws BadInput for a file that is no good.
std::optional<ProjectorCheck> read_projector_check(const std::filesystem::path& trial_folder);

}  // namespace selvedge::station
