#include "station/projector_check.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "files/bad_input.h"
#include "files/csv_table.h"
#include "files/whole_file.h"
#include "geometry/order_statistics.h"
#include "rig/clock.h"
#include "station/pattern_images.h"

namespace selvedge::station {

namespace {

constexpr double kReach_px = 30;   // of the camera, about a corner
constexpr double kWeight_px = 12;  // w
constexpr int kStep_px = 2;        // every how many-th pixel is decoded
constexpr size_t kLeastPixels = 25;
constexpr const char* kProjectorCheckFile = "projector-check.csv";

std::vector<Eigen::Vector2i> pixels_about(const Eigen::Vector2d& at, const geometry::Projection& camera) {
  std::vector<Eigen::Vector2i> pixels;
  const auto left = static_cast<int>(std::lround(at.x() - kReach_px)),
             top = static_cast<int>(std::lround(at.y() - kReach_px));
  for (int v = std::max(top, 0); v < std::min<double>(at.y() + kReach_px, camera.height_px); v += kStep_px)
    for (int u = std::max(left, 0); u < std::min<double>(at.x() + kReach_px, camera.width_px); u += kStep_px)
      if ((Eigen::Vector2d(u, v) - at).norm() < kReach_px) pixels.emplace_back(u, v);
  return pixels;
}

std::optional<CodedCorner> read_corner(const std::vector<calib::PatternImage>& sequence, const Eigen::Vector3d& tracked,
                                       const geometry::Projection& camera) {
  const std::vector<Eigen::Vector2i> pixels = pixels_about(geometry::project(camera, tracked), camera);
  const calib::Decoded decoded = calib::decode(sequence, pixels);
  CodedCorner corner{tracked, {}, {}};
  for (size_t i = 0; i < pixels.size(); ++i)
    if (decoded.column_row[i].allFinite()) {
      corner.camera.push_back(pixels[i].cast<double>());
      corner.projector.push_back(decoded.column_row[i]);
    }
  if (corner.camera.size() < kLeastPixels) return std::nullopt;
  return corner;
}

}  // namespace

std::optional<Eigen::Vector2d> CodedCorner::projector_at(const Eigen::Vector2d& camera_px) const {
  if (camera.size() < kLeastPixels) return std::nullopt;
  Eigen::Matrix<double, 3, 2> fit;
  std::vector<double> robust(camera.size(), 1);
  for (int round = 0; round < 5; ++round) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Identity() * 1e-9;
    Eigen::Matrix<double, 3, 2> right = Eigen::Matrix<double, 3, 2>::Zero();
    for (size_t i = 0; i < camera.size(); ++i) {
      const Eigen::Vector2d d = camera[i] - camera_px;
      const double weight = robust[i] * std::exp(-0.5 * d.squaredNorm() / (kWeight_px * kWeight_px));
      const Eigen::Vector3d basis(1, d.x(), d.y());
      normal += weight * basis * basis.transpose();
      right += weight * basis * projector[i].transpose();
    }
    fit = normal.ldlt().solve(right);
    std::vector<double> residual(camera.size());
    for (size_t i = 0; i < camera.size(); ++i) {
      const Eigen::Vector2d d = camera[i] - camera_px;
      residual[i] = (projector[i] - fit.transpose() * Eigen::Vector3d(1, d.x(), d.y())).norm();
    }
    const double scale = std::max(2 * geometry::median(residual), 0.5);
    for (size_t i = 0; i < camera.size(); ++i) robust[i] = 1 / (1 + std::pow(residual[i] / scale, 2));
  }
  return fit.row(0).transpose();
}

ProjectorCheck decode_corners(const std::vector<calib::PatternImage>& sequence,
                              const std::array<std::optional<Eigen::Vector3d>, 2>& tracked,
                              const geometry::Projection& camera) {
  ProjectorCheck check;
  for (size_t side = 0; side < 2; ++side)
    if (tracked[side]) check[side] = read_corner(sequence, *tracked[side], camera);
  return check;
}

ProjectorCheck check_projector(session::RigClient& rig, const session::RigOptics& optics) {
  rig.forget_samples();
  rig.skip_to_newest_frame();
  std::vector<calib::PatternImage> sequence;
  for (const calib::PatternStep& step :
       calib::coarse_code_sequence({optics.projector.width_px, optics.projector.height_px})) {
    rig.remind();
    sequence.push_back({step, image_under(rig, to_pattern(step))});
  }
  std::array<std::optional<Eigen::Vector3d>, 2> tracked;
  const auto samples = rig.take_corners();
  for (size_t side = 0; side < 2; ++side) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    size_t seen = 0;
    for (const auto& sample : samples)
      if (const auto at = session::marker(sample, side == 0 ? "left" : "right")) sum += *at, ++seen;
    if (seen > 0) tracked[side] = sum / static_cast<double>(seen);
  }
  return decode_corners(sequence, tracked, optics.camera);
}

void write_projector_check(const ProjectorCheck& check, const std::filesystem::path& trial_folder) {
  std::string text = "corner,x,y,z,camera_u,camera_v,projector_u,projector_v\n";
  for (size_t side = 0; side < 2; ++side)
    for (size_t i = 0; check[side] && i < check[side]->camera.size(); ++i) {
      const CodedCorner& c = *check[side];
      text += fmt::format("{},{},{},{},{},{},{},{}\n", side, c.tracked.x(), c.tracked.y(), c.tracked.z(),
                          c.camera[i].x(), c.camera[i].y(), c.projector[i].x(), c.projector[i].y());
    }
  files::write_whole(trial_folder / kProjectorCheckFile, text);
}

std::optional<ProjectorCheck> read_projector_check(const std::filesystem::path& trial_folder) {
  if (!std::filesystem::exists(trial_folder / kProjectorCheckFile)) return std::nullopt;
  const files::CsvTable table =
      files::read_csv(trial_folder / kProjectorCheckFile,
                      {{"corner"}, {"x"}, {"y"}, {"z"}, {"camera_u"}, {"camera_v"}, {"projector_u"}, {"projector_v"}});
  ProjectorCheck check;
  for (size_t i = 0; i < table.rows(); ++i) {
    const int side = files::whole_number(table, i, 0, "corner");
    if (side < 0 || side > 1) refuse(table.where(i), "expected corner 0 or 1, found {}", side);
    auto& corner = check[static_cast<size_t>(side)];
    if (!corner) corner = CodedCorner{{table(i, 1), table(i, 2), table(i, 3)}, {}, {}};
    corner->camera.emplace_back(table(i, 4), table(i, 5));
    corner->projector.emplace_back(table(i, 6), table(i, 7));
  }
  return check;
}

}  // namespace selvedge::station
