// Calibrations and poses on disk: the first byte says what is read.
#include "calib/calibration_file.h"
#include "fuzz.h"

using namespace selvedge;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size < 1) return 0;
  const auto& folder = fuzz::memory_folder();
  const bool rows = data[0] % 4 == 3;
  if (rows) {
    static const std::string header =
        R"({"format": "poses/1", "camera": {"width_px": 8, "height_px": 4}, "projector":
            {"width_px": 8, "height_px": 4},
            "tracker_noise_m": 1e-4, "fabric_volume_m": [[0, 0, 0], [1, 1, 1]]})";
    fuzz::put(folder / "poses.json", header);
  }
  const auto file = folder / (rows ? "correspondences.csv" : "poses.json");
  fuzz::put(file, fuzz::text_of(data + 1, size - 1));
  fuzz::or_refused([&] {
    switch (data[0] % 4) {
      case 0: calib::read_calibration(file); break;
      case 1: calib::read_inputs(file); break;
      case 2: calib::read_poses_header(file); break;
      default: calib::read_poses(folder);
    }
  });
  return 0;
}
