#include "calib/calibration_report.h"

#include <cmath>

#include <fmt/format.h>

#include "calib/device_drawings.h"
#include "calib/next_pose.h"
#include "report/html.h"

namespace selvedge::calib {

namespace {

std::string px(double value) { return std::isfinite(value) ? fmt::format("{:.3f}", value) : "unknown"; }

void bars(report::HtmlReport& report, const std::map<int, double>& values, const std::string& what,
          const std::string& caption) {
  if (values.empty()) return;
  std::vector<std::string> labels;
  std::vector<double> heights;
  for (const auto& [name, value] : values) {
    labels.push_back(what + " " + std::to_string(name));
    heights.push_back(value);
  }
  report.svg(report::bar_plot(labels, heights, "px"), caption);
}

void add_figures(report::HtmlReport& report, const Calibration& calibration) {
  std::vector<std::vector<std::string>> rows;
  const auto add = [&](const std::string& name, const DeviceCalibration& device) {
    const DeviceSolution& d = device.solution;
    if (!d.solved) {
      rows.push_back({name, "not solved", "", "", "", "", ""});
      return;
    }
    rows.push_back({name, px(device.deviation.mean_sd_px), px(device.deviation.largest_sd_px), px(d.rms_px),
                    px(d.leave_one_pose_out_px), fmt::format("{}", d.worst_pose), fmt::format("{}", d.worst_marker)});
  };
  add("camera", calibration.camera);
  if (calibration.projector) add("projector", *calibration.projector);
  report.table({"device", "expected error at the fabric, px per axis", "at its worst point", "residual in training, px",
                "residual on an unseen pose, px", "worst pose", "worst marker"},
               rows);
  if (std::isfinite(calibration.triangulation_sd_mm))
    report.paragraph(
        fmt::format("A triangulated point is expected to be off by {:.3f} mm.", calibration.triangulation_sd_mm));
}

void add_device(report::HtmlReport& report, const std::string& name, const DeviceCalibration& device,
                const Calibration& calibration, const std::optional<NextPose>& next) {
  const DeviceSolution& d = device.solution;
  report.heading("The " + name);
  if (!d.solved) {
    report.paragraph("There is no solution to draw.");
    return;
  }
  const double magnification = residual_magnification(d);
  report.svg(
      draw_residuals(d, magnification),
      fmt::format("Residual vectors, {:.0f} times their length; crosses are rejected sightings. Vectors that point "
                  "alike in one region mean a lens that the model does not hold.",
                  magnification));
  bars(report, d.left_out_rms_px.empty() ? d.pose_rms_px : d.left_out_rms_px, "pose",
       d.left_out_rms_px.empty() ? "Residual of each pose" : "Residual of each pose under the fit without it");
  bars(report, d.marker_rms_px, "marker",
       "Residual of each marker over all poses: a long bar is a marker that the tracker sees "
       "elsewhere than the camera");
  report.svg(
      draw_deviation(d, calibration.inputs.volume_low, calibration.inputs.volume_high),
      "Expected error per axis (px) at the distance of the fabric's middle, with the outline of the fabric's volume");
  report.svg(draw_coverage(d, calibration.inputs.volume_low, calibration.inputs.volume_high,
                           next ? next->markers : std::vector<Eigen::Vector3d>{}),
             next ? "What each pose covered, with its number, over the outline of the fabric's volume; dashed, with "
                    "rings: the next pose that would help most"
                  : "What each pose covered, with its number, over the outline of the fabric's volume");
}

void add_rejected(report::HtmlReport& report, const Calibration& calibration) {
  if (calibration.rejected.empty()) return;
  report.heading("Rejected");
  std::vector<std::vector<std::string>> rows;
  for (const RejectedSighting& r : calibration.rejected)
    rows.push_back({std::to_string(r.pose), std::to_string(r.marker), r.why});
  report.table({"pose", "marker", "why"}, rows);
}

}  // namespace

void write_report(const Calibration& calibration, const std::filesystem::path& path) {
  report::HtmlReport report(fmt::format("Calibration: {}", to_text(calibration.verdict)));
  report.paragraph(calibration.advice);
  if (calibration.verdict == Verdict::refused)
    report.paragraph(
        "The figures below are what these poses claim of themselves, to show what is missing; calibration.json holds "
        "no matrices.");
  add_figures(report, calibration);
  const std::optional<NextPose> next = suggest_next_pose(calibration);
  if (next) report.paragraph(to_text(*next) + " It is drawn dashed in the pictures of coverage.");
  add_device(report, "camera", calibration.camera, calibration, next);
  if (calibration.projector) add_device(report, "projector", *calibration.projector, calibration, next);
  add_rejected(report, calibration);
  report.write(path);
}

}  // namespace selvedge::calib
