// Calibrates camera and projector of a running rig: grid poses shown by the operator, patterns, images, matrices.
//
//   for each pose: ask for it → wait until the tracker sees the grid stand still → dark image for the markers →
//   Gray code of rows and columns, each with its inverse → the grid must still stand where it stood
//   all poses → correspondences → calib::calibrate
//
// Every image is the first whose exposure began after its pattern showed.
#pragma once

#include <filesystem>

#include "calib/calibration.h"
#include "capture/session/rig_client.h"
#include "capture/session/session_plan.h"
#include "report/progress.h"

namespace selvedge::station {

// Writes FOLDER/poses.json, FOLDER/correspondences.csv (what `./selvedge calibrate FOLDER` reads),
// FOLDER/calibration.json and FOLDER/report.html. Throws DeviceFailed where the rig does not play along; a calibration
// whose verdict is "refused" is returned like any other.
calib::Calibration calibrate_rig(session::RigClient& rig, const session::SessionPlan& plan,
                                 const std::filesystem::path& folder, const report::ProgressCallback& progress);

}  // namespace selvedge::station
