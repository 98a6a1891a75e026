#include "cli/verify/figures.h"

namespace selvedge::cli {

std::vector<Figure> bench_bus(const FigureOptions& options);
std::vector<Figure> bench_capture(const FigureOptions& options);
std::vector<Figure> bench_capture_usb3(const FigureOptions& options);
std::vector<Figure> bench_capture_v4l2(const FigureOptions& options);
std::vector<Figure> bench_recorder(const FigureOptions& options);
std::vector<Figure> bench_cloth(const FigureOptions& options);
std::vector<Figure> bench_contact(const FigureOptions& options);
std::vector<Figure> bench_diagnose(const FigureOptions& options);
std::vector<Figure> bench_fit(const FigureOptions& options);
std::vector<Figure> bench_format(const FigureOptions& options);
std::vector<Figure> bench_metric(const FigureOptions& options);
std::vector<Figure> bench_simulator(const FigureOptions& options);

const std::vector<FigureSet>& benches() {
  static const std::vector<FigureSet> list = {
      {"bus", "a message of the bus signed, sent, received and checked, beside LCM alone", bench_bus},
      {"capture", "the camera daemon beside arv-camera-test and v4l2-ctl, each on one simulated camera", bench_capture},
      {"capture-usb3", "of these, the USB3 Vision camera alone", bench_capture_usb3},
      {"capture-v4l2", "of these, the V4L2 camera alone", bench_capture_v4l2},
      {"cloth", "seconds of work per simulated second, batches, cost of finer meshes", bench_cloth},
      {"contact", "a waved swatch with contact off and on, and a skirt on a walking body", bench_contact},
      {"diagnose", "a marker campaign diagnosed, stage by stage", bench_diagnose},
      {"fit", "a waving trial of 50 frames, nine parameters, from the coarse grid to the end", bench_fit},
      {"format", "reading and writing trials: CSV, PNG", bench_format},
      {"metric", "angle maps and pictures of 640x480 frames", bench_metric},
      {"recorder", "ten minutes of 1280x1024 pictures at 60 Hz from the camera to this disk", bench_recorder},
      {"simulator", "a fit with our own sheet as another program beside the same fit in this one", bench_simulator},
  };
  return list;
}

}  // namespace selvedge::cli
