// Writes a trial or campaign as the exchange format, version 1: what read_trial reads back, bit for bit.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "capture/trial/trial.h"

namespace selvedge::trial {

// First lines of the files that the recorder also appends to.
inline constexpr const char* corners_header = "t_s,left_x,left_y,left_z,right_x,right_y,right_z\n";
inline constexpr const char* frames_header = "frame,t_s\n";
inline constexpr const char* markers_header = "t_s,marker,u_m,v_m,x,y,z\n";
inline constexpr const char* surface_header = "t_s,x,y,z\n";
inline constexpr const char* robot_header =
    "t_s,commanded_x,commanded_y,commanded_z,measured_x,measured_y,measured_z\n";

// Contents of trial.json. Its frames.count is the number of frames in `trial`.
nlohmann::json trial_to_json(const Trial& trial);

// A frame's file below a trial's folder: frames/NNNNNN.png.
std::filesystem::path frame_path(const std::filesystem::path& folder, int number);

// Makes `folder` and writes every part that `trial` has; trial.json comes last, so that a folder that has
// one is whole. Images: one for each of trial.frames, in its order; leave empty where the folder has them.
// `trial.folder`, `trial.name` and the paths in `trial.frames` are not looked at.
void write_trial(const Trial& trial, const std::filesystem::path& folder, const std::vector<GreyImage>& images = {});

// Each trial in folder/NAME, without pictures, and then campaign.json.
void write_campaign(const Campaign& campaign, const std::filesystem::path& folder);

// campaign.json alone; the trials go to folder/NAME through write_trial.
void write_campaign_json(const Campaign& campaign, const std::filesystem::path& folder);

}  // namespace selvedge::trial
