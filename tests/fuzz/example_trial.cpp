#include "example_trial.h"

#include <cmath>

#include "capture/trial/checked_trial.h"
#include "capture/trial/trial_writer.h"
#include "files/checked_lines.h"
#include "files/whole_file.h"

namespace selvedge::fuzz {

namespace {

namespace fs = std::filesystem;
using trial::Trial;

geometry::Projection optics() {
  geometry::Projection p;
  p.matrix << 10, 0, 4, 0, 0, 10, 2, 0, 0, 0, 1, 1;
  p.width_px = 8;
  p.height_px = 4;
  return p;
}

Trial example() {
  Trial t;
  t.experiment = trial::Experiment::robot;
  t.fabric = {"linen", 0.3, 0.3, 0.02, true};
  t.camera = t.projector = optics();
  t.pattern.emplace();
  t.pattern->period_px = 4;
  t.frame_rate_hz = t.mocap_rate_hz = 10;
  t.corners.time_s = {0, 0.1};
  t.corners.left = Eigen::Matrix3Xd::Constant(3, 2, 0.25);
  t.corners.right = Eigen::Matrix3Xd::Constant(3, 2, 0.5);
  t.frames.emplace();
  t.markers.emplace();
  t.markers->position = Eigen::Matrix3Xd::Constant(3, 2, 0.25);
  for (int i = 0; i < 2; ++i) {
    t.frames->number.push_back(i);
    t.frames->time_s.push_back(0.1 * i);
    t.markers->time_s.push_back(0.1 * i);
    t.markers->marker.push_back(i);
    t.markers->uv.emplace_back(0.1 * i, 0);
  }
  t.robot.emplace();
  t.robot->time_s = {0, 0.1};
  t.robot->commanded = t.robot->measured = Eigen::Matrix3Xd::Constant(3, 2, 0.125);
  return t;
}

// A table's lines with their checksums; those of frames.csv name their image's, too.
void add_checksums(const fs::path& folder, const std::string& name) {
  const std::string text = files::read_whole(folder / name);
  std::string checked = trial::checked_header(name);
  int frame = 0;
  for (size_t at = text.find('\n') + 1, end = 0; (end = text.find('\n', at)) != std::string::npos; at = end + 1) {
    std::string line = text.substr(at, end - at);
    if (name == "frames.csv")
      line += ',' + std::to_string(files::crc32_of(files::read_whole(trial::frame_path(folder, frame++))));
    checked += files::with_checksum(line);
  }
  files::write_whole(folder / name, checked);
}

}  // namespace

void write_example_trial(const fs::path& folder, bool checked) {
  const trial::GreyImage grey = trial::GreyImage::Constant(4, 8, 128);
  trial::write_trial(example(), folder, {grey, grey});
  if (!checked) return;
  auto about = files::read_json(folder / "trial.json");
  about["rows"] = nlohmann::json::object();
  for (const char* name : trial::table_names) {
    add_checksums(folder, name);
    about["rows"][name] = 2;
  }
  trial::write_checked_json(folder, about);
}

void write_material_test(const std::filesystem::path& folder, size_t which) {
  trial::Trial t;
  t.fabric = {"denim", 0.05, 0.2, 0.002, true};
  if (which == 0) {
    t.experiment = trial::Experiment::cantilever;
    t.cantilever = trial::Cantilever{90, 0.05, 0.031, Eigen::Matrix2Xd(2, 4)};
    t.cantilever->midline_m << 0, 0.012, 0.024, 0.035, 0, 0.001, 0.0045, 0.0095;
  } else if (which == 1) {
    t.experiment = trial::Experiment::cusick;
    t.cusick = trial::Cusick{0.3, 0.18, {{1, Eigen::Matrix2Xd(2, 12)}}};
    for (Eigen::Index i = 0; i < 12; ++i) {
      const double angle = 2 * M_PI * static_cast<double>(i) / 12;
      t.cusick->outlines[0].point_m.col(i) << 0.12 * std::cos(angle), 0.12 * std::sin(angle);
    }
  } else {
    t.experiment = trial::Experiment::tensile;
    t.tensile = trial::Tensile{0, 0.05, 0.1, "gf", {{3, {0, 0.1, 0.2}, {0, 1, 2.5}, {1, 1.1, 1.2}, {1, 0.97, 0.9}}}};
  }
  trial::write_trial(t, folder);
}

}  // namespace selvedge::fuzz
