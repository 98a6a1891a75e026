#include "hardware_sim/synthetic_grid/synthetic_images.h"

#include <cmath>
#include <cstdint>
#include <random>

#include <Eigen/LU>

namespace selvedge::hardware_sim {

namespace {

enum class Material { none, board, ground, disc };

struct Hit {
  Material material = Material::none;
  Eigen::Vector3d point;  // world, m
};

// The board in the grid's frame, hit by a ray given there.
class Board {
 public:
  Board(const calib::MarkerGrid& grid, const Eigen::Isometry3d& world_from_grid)
      : grid_(grid), world_from_grid_(world_from_grid), grid_from_world_(world_from_grid.inverse()),
        half_width_((grid.columns - 1) / 2.0 * grid.spacing_m + grid.margin_m),
        half_height_((grid.rows - 1) / 2.0 * grid.spacing_m + grid.margin_m) {}

  Hit hit(const Eigen::Vector3d& origin_world, const Eigen::Vector3d& direction_world) const {
    const Eigen::Vector3d origin = grid_from_world_ * origin_world;
    const Eigen::Vector3d direction = grid_from_world_.linear() * direction_world;
    Hit best;
    double nearest = 1e30;
    for (const double side : {-1.0, 1.0}) {
      // Half plane spanned by along (from the fold outwards) and y.
      const double half = grid_.fold_rad / 2;
      const Eigen::Vector3d along(side * std::cos(half), 0, -std::sin(half));
      const Eigen::Vector3d normal(side * std::sin(half), 0, std::cos(half));
      const double speed = normal.dot(direction);
      if (speed >= 0) continue;  // seen from behind
      const double distance = -normal.dot(origin) / speed;
      const Eigen::Vector3d point = origin + distance * direction;
      const double s = along.dot(point);
      if (distance <= 0 || distance >= nearest || s < 0 || s > half_width_ || std::abs(point.y()) > half_height_)
        continue;
      nearest = distance;
      best = {material(side * s, point.y()), world_from_grid_ * point};
    }
    return best;
  }

 private:
  Material material(double s, double y) const {
    const double column = std::round(s / grid_.spacing_m + (grid_.columns - 1) / 2.0);
    const double row = std::round((grid_.rows - 1) / 2.0 - y / grid_.spacing_m);
    if (column < 0 || column >= grid_.columns || row < 0 || row >= grid_.rows) return Material::board;
    const Eigen::Vector2d centre =
        calib::flat_position(grid_, static_cast<int>(row) * grid_.columns + static_cast<int>(column));
    const double distance = std::hypot(s - centre.x(), y - centre.y());
    if (distance < grid_.disc_diameter_m / 2) return Material::disc;
    return distance < grid_.ground_diameter_m / 2 ? Material::ground : Material::board;
  }

  calib::MarkerGrid grid_;
  Eigen::Isometry3d world_from_grid_, grid_from_world_;
  double half_width_, half_height_;
};

struct Box {
  int left, right, top, bottom;  // right and bottom one beyond
};

Box bounds(const calib::MarkerGrid& grid, const Eigen::Isometry3d& world_from_grid,
           const geometry::Projection& camera) {
  const double x = (grid.columns - 1) / 2.0 * grid.spacing_m + grid.margin_m;
  const double y = (grid.rows - 1) / 2.0 * grid.spacing_m + grid.margin_m;
  Eigen::Vector2d low(1e9, 1e9), high(-1e9, -1e9);
  for (const double s : {-x, 0.0, x})
    for (const double t : {-y, 0.0, y}) {
      const Eigen::Vector2d pixel = geometry::project(camera, world_from_grid * folded(grid, s, t));
      low = low.cwiseMin(pixel);
      high = high.cwiseMax(pixel);
    }
  const double margin = 8;
  const auto clamp = [](double v, int limit) { return static_cast<int>(std::min(std::max(v, 0.0), double(limit))); };
  return {clamp(low.x() - margin, camera.width_px), clamp(high.x() + margin, camera.width_px),
          clamp(low.y() - margin, camera.height_px), clamp(high.y() + margin, camera.height_px)};
}

}  // namespace

BoardView view_board(const calib::MarkerGrid& grid, const BoardLook& look, const Eigen::Isometry3d& world_from_grid,
                     const geometry::Projection& camera, const geometry::Projection& projector) {
  BoardView view{camera.width_px, camera.height_px, {}};
  const Board board(grid, world_from_grid);
  const Eigen::Vector3d origin = geometry::centre(camera);
  const Box box = bounds(grid, world_from_grid, camera);
  // Rays at pixel corners, undistorted once each; within a pixel they are interpolated.
  const int columns = box.right - box.left + 1;
  std::vector<Eigen::Vector3d> corner_rays;
  std::vector<Material> corner_material;
  for (int row = box.top; row <= box.bottom; ++row)
    for (int column = box.left; column <= box.right; ++column) {
      corner_rays.push_back(geometry::ray(camera, Eigen::Vector2d(column - 0.5, row - 0.5)));
      corner_material.push_back(board.hit(origin, corner_rays.back()).material);
    }
  for (int row = box.top; row < box.bottom; ++row)
    for (int column = box.left; column < box.right; ++column) {
      const size_t corner = static_cast<size_t>(row - box.top) * columns + (column - box.left);
      const size_t corners[4] = {corner, corner + 1, corner + columns, corner + columns + 1};
      bool uniform = true;
      for (const size_t c : corners) uniform &= corner_material[c] == corner_material[corner];
      if (uniform && corner_material[corner] == Material::none) continue;
      const int side = uniform ? 2 : 4;
      for (int i = 0; i < side; ++i)
        for (int j = 0; j < side; ++j) {
          const double y = (i + 0.5) / side, x = (j + 0.5) / side;
          const Eigen::Vector3d direction =
              (1 - y) * ((1 - x) * corner_rays[corners[0]] + x * corner_rays[corners[1]]) +
              y * ((1 - x) * corner_rays[corners[2]] + x * corner_rays[corners[3]]);
          const Hit hit = board.hit(origin, direction);
          if (hit.material == Material::none) continue;
          const Eigen::Vector2d lamp = geometry::project(projector, hit.point);
          BoardView::Sample sample;
          sample.pixel = row * view.width_px + column;
          sample.weight = 1.0F / static_cast<float>(side * side);
          sample.column_px = static_cast<float>(lamp.x());
          sample.row_px = static_cast<float>(lamp.y());
          sample.disc = hit.material == Material::disc;
          sample.albedo = static_cast<float>(hit.material == Material::board ? look.board_albedo : look.ground_albedo);
          sample.lit = lamp.x() > -0.5 && lamp.y() > -0.5 && lamp.x() < projector.width_px - 0.5 &&
                       lamp.y() < projector.height_px - 0.5;
          view.samples.push_back(sample);
        }
    }
  return view;
}

calib::GreyImage shade_board(const BoardView& view, const BoardLook& look,
                             const std::function<double(double, double)>& pattern, bool beacon) {
  std::vector<float> light(static_cast<size_t>(view.width_px) * view.height_px, 0.0F);
  for (const BoardView::Sample& s : view.samples) {
    double value = look.ambient_grey * s.albedo;
    if (s.disc && beacon) value += look.beacon_grey;
    if (s.lit) {
      const double drive = pattern(s.column_px, s.row_px);
      value += look.lamp_grey * s.albedo * (look.gamma == 1 ? drive : std::pow(drive, look.gamma));
    }
    light[s.pixel] += s.weight * static_cast<float>(value);
  }
  // Drawn from a table: a normal variate for every pixel would take longer than the board itself.
  static const std::vector<float> normal_table = [] {
    std::mt19937 generator(1);
    std::normal_distribution<float> normal(0, 1);
    std::vector<float> table(1 << 16);
    for (float& value : table) value = normal(generator);
    return table;
  }();
  std::mt19937 generator(look.seed);
  const float exposure = static_cast<float>(look.exposure), noise = static_cast<float>(look.noise_grey);
  calib::GreyImage image(view.height_px, view.width_px);
  for (size_t i = 0; i < light.size(); i += 2) {
    const auto bits = static_cast<std::uint32_t>(generator());
    for (size_t j = i; j < std::min(i + 2, light.size()); ++j) {
      const float grey = exposure * light[j] + noise * normal_table[j == i ? bits & 0xffffU : bits >> 16] + 2.5F;
      image.data()[j] = static_cast<unsigned char>(std::min(std::max(grey, 0.0F), 255.0F));
    }
  }
  return image;
}

calib::GreyImage shade_board(const BoardView& view, const BoardLook& look, const calib::PatternStep& step,
                             bool beacon) {
  if (look.projector_blur_px <= 0)
    return shade_board(
        view, look, [&](double column, double row) { return brightness(step, column, row); }, beacon);
  // Bands vary along one direction alone, and light adds up after the gamma: a table of the blurred profile.
  const int reach = static_cast<int>(std::ceil(3 * look.projector_blur_px));
  const int length = 4096;
  std::vector<double> sharp(length), blurred(length, 0.0);
  for (int i = 0; i < length; ++i) sharp[i] = std::pow(brightness(step, i, i), look.gamma);
  double total = 0;
  for (int k = -reach; k <= reach; ++k) {
    const double weight = std::exp(-0.5 * k * k / (look.projector_blur_px * look.projector_blur_px));
    total += weight;
    for (int i = reach; i < length - reach; ++i) blurred[i] += weight * sharp[i + k];
  }
  for (int i = reach; i < length - reach; ++i) blurred[i] = std::pow(blurred[i] / total, 1 / look.gamma);
  for (int i = 0; i < reach; ++i) blurred[i] = brightness(step, i, i);
  return shade_board(
      view, look,
      [&](double column, double row) {
    const double x = std::max(step.horizontal ? row : column, 0.0);
    const int below = std::min(static_cast<int>(x), length - 2);
    const double part = x - below;
    return (1 - part) * blurred[below] + part * blurred[below + 1];
      },
      beacon);
}

}  // namespace selvedge::hardware_sim
