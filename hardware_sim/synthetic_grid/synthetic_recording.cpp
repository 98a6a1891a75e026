#include "hardware_sim/synthetic_grid/synthetic_recording.h"

namespace selvedge::hardware_sim {

std::vector<calib::PoseImages> record_images(const SyntheticPoses& truth, const calib::MarkerGrid& grid,
                                             const BoardLook& look, size_t decoded) {
  BoardLook noisy = look;
  std::vector<calib::PoseImages> images;
  for (size_t pose = 0; pose < truth.world_from_grid.size(); ++pose) {
    calib::PoseImages& one = images.emplace_back();
    one.pose = static_cast<int>(pose);
    for (const calib::Correspondence& row : truth.poses.rows)
      if (row.pose == one.pose) one.markers.push_back({row.marker, row.position});
    const BoardView view = view_board(grid, noisy, truth.world_from_grid[pose], truth.camera, truth.projector);
    one.marker_image = shade_board(view, noisy, calib::PatternStep{}, true);
    if (pose >= decoded) continue;
    for (const calib::PatternStep& step : calib::calibration_sequence(truth.poses.projector)) {
      ++noisy.seed;
      one.sequence.push_back({step, shade_board(view, noisy, step, false)});
    }
  }
  return images;
}

}  // namespace selvedge::hardware_sim
