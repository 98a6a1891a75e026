// A worn garment to look at: meshes for any viewer, pictures, and a report.
#pragma once

#include <filesystem>
#include <string>

#include "garment/wear.h"

namespace selvedge::garment {

// One Wavefront OBJ file a frame, frame_00001.obj and on: vertices (m, z up), flat coordinates, triangles. With
// body_00001.obj beside it: the capsules.
void write_obj_sequence(const Garment& garment, const Wearer& wearer, const Worn& worn,
                        const std::filesystem::path& folder);

// PNG bytes: garment and body, seen from the front and a little aside, the camera walking along.
std::string picture_of(const Garment& garment, const Wearer& wearer, const Eigen::Matrix3Xd& position, double time_s);

// report.html: a sheet of pictures evenly over the motion, and what the simulation did.
void write_report(const Pattern& pattern, const Garment& garment, const Wearer& wearer, const Worn& worn,
                  const std::filesystem::path& path);

}  // namespace selvedge::garment
