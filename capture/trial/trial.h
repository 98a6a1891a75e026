// A trial and a campaign as they lie on disk: the exchange format, version 1.
//
// Plain data in SI units, in the right-handed frame of the motion capture, z up. Positions are 3×N, m.
// Source of names and units: docs/formats.md.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "capture/trial/grey_png.h"
#include "capture/trial/material_test.h"
#include "geometry/projection.h"

namespace selvedge::trial {

// "static", "waving", "robot": a fabric that hangs from a rig; "cantilever", "cusick", "tensile": material tests.
enum class Experiment { static_hang, waving, robot, cantilever, cusick, tensile };
enum class Held { corners, top_edge, top_edge_clamped };
// Whether the recording ran to its end; a trial that is cut or still being recorded holds what its files
// hold up to their last whole line.
enum class State { complete, cut, recording };

// Of a disc, width and height are those of its bounding square.
struct Fabric {
  std::string name;
  double width_m = 0;  // top edge
  double height_m = 0;
  double mass_kg = 0;
  bool mass_known = true;
};

// Row r of the projector is bright where (r − first_bright_row_px) mod period_px < duty · period_px.
struct StripePattern {
  std::string orientation = "horizontal";
  double period_px = 0;
  double duty = 0.5;
  double first_bright_row_px = 0;
};

// corners.csv; a hidden sample is NaN in all three coordinates of that corner. A cut trial may have no sample at all.
struct Corners {
  std::vector<double> time_s;  // motion-capture clock
  Eigen::Matrix3Xd left, right;
};

// frames.csv; images stay on disk until asked for.
struct Frames {
  std::vector<int> number;
  std::vector<double> time_s;  // mid-exposure, camera clock mapped to the motion-capture clock
  std::vector<std::filesystem::path> path;
};

// markers.csv, one row a sample of one marker, in the file's order. uv: flat position, m.
struct Markers {
  std::vector<double> time_s;
  std::vector<int> marker;
  std::vector<Eigen::Vector2d> uv;
  Eigen::Matrix3Xd position;
};

// surface.csv: where a depth camera, a scanner or a digital image correlation met the fabric, one row a point. Which
// point of the fabric it is nobody says, and those of one time are others than those of the next. Points of one time
// share it and stand together.
struct Surface {
  std::vector<double> time_s;
  Eigen::Matrix3Xd position;
  std::optional<Eigen::Vector3d> seen_from_m;  // where the instrument stood
};

// robot.csv: tool point of the arm.
struct Robot {
  std::vector<double> time_s;
  Eigen::Matrix3Xd commanded, measured;
};

struct Trial {
  std::filesystem::path folder;
  std::string name;  // the folder's own
  Experiment experiment = Experiment::static_hang;
  State state = State::complete;
  Held held = Held::corners;
  Eigen::Vector3d clamp_direction = Eigen::Vector3d(0, 0, -1);
  Fabric fabric;
  bool starts_at_rest = false;
  Eigen::Vector3d gravity_m_s2 = Eigen::Vector3d(0, 0, -9.81);
  std::optional<geometry::Projection> camera, projector;
  std::optional<StripePattern> pattern;
  double frame_rate_hz = 0;
  double exposure_s = 0;
  double mocap_rate_hz = 0;
  std::optional<double> mocap_noise_m;
  std::optional<double> noise_grey_levels;
  Corners corners;
  std::optional<Frames> frames;
  std::optional<Markers> markers;
  std::optional<Surface> surface;
  std::optional<Robot> robot;
  // A material test has one of these, and nothing of a rig: no corners, cameras, frames, markers.
  std::optional<Cantilever> cantilever;
  std::optional<Cusick> cusick;
  std::optional<Tensile> tensile;
  // What does not read any more and was passed over, a sentence each, naming the file; of trials with checksums alone.
  std::vector<std::string> damaged;
};

struct Campaign {
  std::filesystem::path folder;
  std::string fabric;
  std::vector<Trial> trials;                         // campaign.json's order
  std::vector<std::vector<std::string>> replicates;  // names of trials meant to be the same motion
};

bool is_material_test(Experiment experiment);

// kg/m²; of a Cusick test over the disc's area.
double areal_mass(const Trial& trial);

// The campaign's material tests alone, or what hangs from a rig alone; may hold no trial.
Campaign only_tests(const Campaign& campaign, bool tests);

// Reads and checks everything but the pixels (sizes of all images are checked from their headers).
// Throws BadInput as docs/formats.md lists, naming file, line or key and what was expected. In a trial that has
// checksums a damaged line or image is passed over and named in `damaged`; only its trial.json can still refuse it.
Trial read_trial(const std::filesystem::path& folder);

// What trial.json alone says: a trial without samples. Throws BadInput as read_trial does for that file.
Trial read_header(const std::filesystem::path& trial_json);

// A folder with campaign.json, or one trial's folder (a campaign of that one trial).
Campaign read_campaign(const std::filesystem::path& folder);

// One campaign out of several of the same fabric: trials and replicates one after another, a name that an earlier one
// has followed by " of " and its folder's name. Throws BadInput where a fabric's name differs from the first one's, or
// where a folder is there twice.
Campaign joined(const std::vector<Campaign>& campaigns);

// 8-bit grey image of frame `index` into Frames, row major, height_px × width_px of trial.camera.
// Throws BadInput where the file is damaged or its size is not the camera's.
GreyImage read_frame(const Trial& trial, size_t index);

const char* to_text(Experiment experiment);
const char* to_text(Held held);
const char* to_text(State state);

}  // namespace selvedge::trial
