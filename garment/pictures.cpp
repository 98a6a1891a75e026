#include "garment/pictures.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>
#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>

#include "files/whole_file.h"
#include "garment/capsule_mesh.h"
#include "geometry/projection.h"
#include "render/row_map.h"
#include "report/html.h"
#include "report/text_table.h"

namespace selvedge::garment {

namespace {

constexpr int kWidth_px = 300, kHeight_px = 420;

void append_mesh(const Eigen::Matrix3Xd& position, std::string& text) {
  for (Eigen::Index v = 0; v < position.cols(); ++v)
    text += fmt::format("v {:.6f} {:.6f} {:.6f}\n", position(0, v), position(1, v), position(2, v));
}

std::string number(double value, const char* unit) { return report::short_number(value) + " " + unit; }

}  // namespace

void write_obj_sequence(const Garment& garment, const Wearer& wearer, const Worn& worn,
                        const std::filesystem::path& folder) {
  const cloth::contact::Body body = body_of(wearer, "limbs");
  std::string flat, faces;
  for (size_t t = 0; t < garment.surface.triangles.size(); ++t) {
    for (const Eigen::Vector2d& uv : garment.surface.flat[t]) flat += fmt::format("vt {:.5f} {:.5f}\n", uv.x(), uv.y());
    faces += "f";
    for (size_t k = 0; k < 3; ++k) faces += fmt::format(" {}/{}", garment.surface.triangles[t][k] + 1, 3 * t + k + 1);
    faces += "\n";
  }
  for (size_t f = 0; f < worn.frames.size(); ++f) {
    std::string text = fmt::format("# garment at {:.4f} s of the motion; m, z up\n", worn.time_s[f]);
    append_mesh(worn.frames[f], text);
    files::write_whole(folder / fmt::format("frame_{:05}.obj", f + 1), text + flat + faces);
    const DrawnMesh limbs = mesh_of(body.capsules_at(worn.time_s[f]));
    text = fmt::format("# body at {:.4f} s of the motion; m, z up\n", worn.time_s[f]);
    append_mesh(limbs.position, text);
    for (const auto& t : limbs.triangles) text += fmt::format("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
    files::write_whole(folder / fmt::format("body_{:05}.obj", f + 1), text);
  }
}

std::string picture_of(const Garment& garment, const Wearer& wearer, const Eigen::Matrix3Xd& position, double time_s) {
  const DrawnMesh limbs = mesh_of(body_of(wearer, "limbs").capsules_at(time_s));
  Eigen::Matrix3Xd all(3, position.cols() + limbs.position.cols());
  all << position, limbs.position;
  std::vector<std::array<int, 3>> triangles = garment.surface.triangles;
  const auto offset = static_cast<int>(position.cols());
  for (const auto& t : limbs.triangles) triangles.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
  const Eigen::Vector3d root = pose_at(*wearer.motion, time_s, wearer.dressing_s)[0].translation();
  const Eigen::Vector3d middle = root - Eigen::Vector3d(0, 0, 0.25);
  const geometry::Projection camera =
      geometry::looking_at(middle + Eigen::Vector3d(1.1, -2.4, 0.5), middle, 640, kWidth_px, kHeight_px);
  render::RowMap map(camera, camera);
  map.rasterise(all, triangles);
  const Eigen::Vector3d light = Eigen::Vector3d(0.5, -0.6, 0.6).normalized();
  cv::Mat image(kHeight_px, kWidth_px, CV_8UC3, cv::Scalar(255, 255, 255));
  for (int i = 0; i < kWidth_px * kHeight_px; ++i) {
    const int id = map.triangle_ids()[static_cast<size_t>(i)];
    if (id < 0) continue;
    const auto& t = triangles[static_cast<size_t>(id)];
    const Eigen::Vector3d normal = (all.col(t[1]) - all.col(t[0])).cross(all.col(t[2]) - all.col(t[0])).normalized();
    const double lit = 0.3 + 0.7 * std::abs(normal.dot(light));
    const bool cloth = static_cast<size_t>(id) < garment.surface.triangles.size();
    const cv::Vec3d colour = cloth ? cv::Vec3d(200, 120, 60) : cv::Vec3d(170, 185, 205);  // blue, green, red
    for (int c = 0; c < 3; ++c)
      image.at<cv::Vec3b>(i)[c] = static_cast<unsigned char>(std::min(255.0, 1.15 * lit * colour[c]));
  }
  std::vector<unsigned char> bytes;
  cv::imencode(".png", image, bytes);
  return {bytes.begin(), bytes.end()};
}

void write_report(const Pattern& pattern, const Garment& garment, const Wearer& wearer, const Worn& worn,
                  const std::filesystem::path& path) {
  report::HtmlReport html("A worn garment");
  html.paragraph("Pattern: " + pattern.where +
                 ". The garment starts as it stands by itself, is put on while the body grows into it, and then "
                 "follows the recorded motion.");
  constexpr size_t kPictures = 12, kInRow = 4;
  std::vector<std::string> pictures, captions;
  for (size_t i = 0; i < kPictures && !worn.frames.empty(); ++i) {
    const size_t f = i * (worn.frames.size() - 1) / (kPictures - 1);
    pictures.push_back(picture_of(garment, wearer, worn.frames[f], worn.time_s[f]));
    captions.push_back(fmt::format("{:.2f} s", worn.time_s[f]));
    if (pictures.size() == kInRow) {
      html.picture_row(pictures, captions);
      pictures.clear();
      captions.clear();
    }
  }
  const auto& c = worn.contact;
  html.heading("What the simulation did");
  html.table({"", ""}, {{"triangles", std::to_string(garment.surface.triangles.size())},
                        {"vertices held by " + pattern.held_by, std::to_string(garment.held.size())},
                        {"motion", number(worn.time_s.empty() ? 0 : worn.time_s.back(), "s")},
                        {"simulated, with putting on", number(worn.simulated_s, "s")},
                        {"wall time per simulated second", number(worn.wall_s / worn.simulated_s, "s")},
                        {"steps", std::to_string(c.steps)},
                        {"kept frames", std::to_string(worn.frames.size())},
                        {"kept frames with intersecting triangles", std::to_string(worn.frames_that_intersect)},
                        {"largest strain along warp or weft", number(100 * worn.largest_strain, "%")},
                        {"deepest vertex in the body", number(1e3 * worn.deepest_in_body_m, "mm")},
                        {"contact thickness", number(1e3 * c.thickness_m, "mm")},
                        {"pairs in contact range, mean of a step",
                         number(static_cast<double>(c.near_pairs) / std::max(1L, c.steps), "")},
                        {"collisions stopped within a step", std::to_string(c.impacts)},
                        {"steps with rigid zones", std::to_string(c.zone_steps)}});
  html.write(path);
}

}  // namespace selvedge::garment
