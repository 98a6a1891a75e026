// `./selvedge calibrate FOLDER --out DIR`: poses on disk to calibration.json and report.html.
// `./selvedge calibrate --rig FILE --out DIR`: the same with poses captured on a running rig.
// A refused calibration leaves its report and a calibration.json without matrices, and exits 2 with the reason.
#include <cmath>
#include <filesystem>
#include <memory>

#include <fmt/format.h>

#include "calib/calibration.h"
#include "calib/calibration_file.h"
#include "calib/calibration_report.h"
#include "calib/export.h"
#include "calib/image_folder.h"
#include "calib/next_pose.h"
#include "calib/poses.h"
#include "capture/session/rig_client.h"
#include "capture/session/session_plan.h"
#include "cli/command.h"
#include "cli/output_folder.h"
#include "files/bad_input.h"
#include "report/progress.h"
#include "report/text_table.h"
#include "station/calibrating.h"

namespace selvedge::cli {

namespace {

struct CalibrateArguments {
  std::string folder, rig, out;
  bool exports = false;
};

std::string px(double value) { return std::isfinite(value) ? fmt::format("{:.3f}", value) : "-"; }

std::vector<std::string> device_row(const std::string& name, const calib::DeviceCalibration& device) {
  const calib::DeviceSolution& d = device.solution;
  if (!d.solved) return {name, "-", "-", "-", "-", "-"};
  return {name,
          px(d.rms_px),
          px(d.leave_one_pose_out_px),
          px(device.deviation.mean_sd_px),
          std::to_string(d.worst_pose),
          std::to_string(d.worst_marker)};
}

void print(const calib::Calibration& calibration) {
  std::vector<std::vector<std::string>> rows{device_row("camera", calibration.camera)};
  if (calibration.projector) rows.push_back(device_row("projector", *calibration.projector));
  fmt::print("{}",
             report::text_table(
                 {"device", "residual px", "unseen pose px", "expected error px", "worst pose", "worst marker"}, rows));
  if (std::isfinite(calibration.triangulation_sd_mm))
    fmt::print("triangulated point: {:.3f} mm expected error\n", calibration.triangulation_sd_mm);
  fmt::print("rejected: {} sightings\nverdict: {}\n{}\n", calibration.rejected.size(),
             calib::to_text(calibration.verdict), calibration.advice);
  if (const auto next = calib::suggest_next_pose(calibration)) fmt::print("{}\n", calib::to_text(*next));
}

// Correspondences where there are any, images otherwise; a calibration.json is solved again from its own inputs.
calib::Calibration calibrate_folder(const std::filesystem::path& folder) {
  if (std::filesystem::is_regular_file(folder)) return calib::calibrate(calib::read_inputs(folder));
  if (std::filesystem::exists(folder / "tracker.csv") && !std::filesystem::exists(folder / "correspondences.csv")) {
    const calib::ImageFolder images = calib::read_image_folder(folder);
    return calib::calibrate_images(images.poses, images.header);
  }
  return calib::calibrate(calib::read_poses(folder));
}

void export_device(const calib::DeviceCalibration& device, const std::filesystem::path& out, const std::string& name) {
  if (!device.solution.solved) return;
  calib::export_opencv_yaml(device.projection(), out / (name + ".yaml"));
  calib::export_mrcal_model(device.projection(), out / (name + ".cameramodel"));
}

// Captures the poses on the rig's bus; the operator's prompts are printed as they come.
calib::Calibration calibrate_live(const std::filesystem::path& rig_file, const std::filesystem::path& out) {
  const auto configuration = rig::Configuration::load(rig_file);
  const session::SessionPlan plan = session::read_session_plan(configuration);
  session::RigClient rig(configuration);
  const report::ProgressCallback progress = report::terminal_progress("calibrate");
  rig.wait_until_running(plan.answer_timeout_s, [&](const std::string& missing) { progress(0, missing); });
  std::filesystem::create_directories(out);
  return station::calibrate_rig(rig, plan, out, progress);
}

void run(const CalibrateArguments& a) {
  const std::filesystem::path out = a.out;
  expect_folder("--out", out);
  const bool live = !a.rig.empty();
  const calib::Calibration calibration = live ? calibrate_live(a.rig, out) : calibrate_folder(a.folder);
  std::filesystem::create_directories(out);
  if (!live) {
    calib::write_report(calibration, out / "report.html");
    calib::write_calibration(calibration, out / "calibration.json");
  }
  if (calibration.verdict == calib::Verdict::refused)
    refuse(live ? a.rig : a.folder, "calibration refused (see {}): {}", (out / "report.html").string(),
           calibration.advice);
  if (a.exports) {
    export_device(calibration.camera, out, "camera");
    if (calibration.projector) export_device(*calibration.projector, out, "projector");
  }
  print(calibration);
  fmt::print("written: {} and report.html beside it\n", (out / "calibration.json").string());
}

}  // namespace

void add_calibrate(CLI::App& app, int&) {
  CLI::App* sub =
      app.add_subcommand("calibrate", "Solve camera and projector from grid poses, and say how far to trust them");
  auto a = std::make_shared<CalibrateArguments>();
  auto* folder = sub->add_option("FOLDER", a->folder,
                                 "Folder with poses.json and correspondences.csv, or with tracker.csv and images; or a "
                                 "calibration.json, to solve it again");
  auto* rig =
      sub->add_option("--rig", a->rig, "Capture the poses on this running rig instead (its configuration, TOML)");
  folder->excludes(rig);
  sub->add_option("--out", a->out, "Folder for calibration.json and report.html")->required();
  sub->add_flag("--export", a->exports, "Also write OpenCV's YAML and mrcal's camera model of each device");
  sub->callback([a] {
    if (a->folder.empty() && a->rig.empty())
      refuse("calibrate", "found neither FOLDER nor --rig FILE, expected one of them");
    run(*a);
  });
}

}  // namespace selvedge::cli
