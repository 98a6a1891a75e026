#include "capture/trial/doubts.h"

#include <gtest/gtest.h>

namespace selvedge::trial {
namespace {

// A swatch of 0.3 m, 25 markers, hung by its corners and swung a little, 1 s at 60 Hz. scale: of all lengths.
Trial hung(double scale = 1) {
  Trial trial;
  trial.name = "t";
  trial.fabric = {"cotton", 0.3, 0.3, 0.0144, true};
  const int times = 60;
  trial.corners.left.resize(3, times);
  trial.corners.right.resize(3, times);
  Markers markers;
  std::vector<Eigen::Vector3d> position;
  for (int i = 0; i < times; ++i) {
    const double t = i / 60.0, swing = 0.05 * std::sin(6 * t);
    trial.corners.time_s.push_back(t);
    trial.corners.left.col(i) = scale * Eigen::Vector3d(-0.14, swing, 1);
    trial.corners.right.col(i) = scale * Eigen::Vector3d(0.14, swing, 1);
    for (int k = 0; k < 25; ++k) {
      const Eigen::Vector2d uv(0.3 * (k % 5) / 4, 0.3 * (k / 5) / 4);
      markers.time_s.push_back(t);
      markers.marker.push_back(k);
      markers.uv.push_back(uv);
      position.push_back(scale * Eigen::Vector3d(0.28 / 0.3 * uv.x() - 0.14, swing, 1 - uv.y()));
    }
  }
  markers.position.resize(3, static_cast<Eigen::Index>(position.size()));
  for (size_t i = 0; i < position.size(); ++i) markers.position.col(static_cast<Eigen::Index>(i)) = position[i];
  trial.markers = markers;
  return trial;
}

void turn(Trial& trial, const Eigen::Matrix3d& by) {
  trial.corners.left = by * trial.corners.left;
  trial.corners.right = by * trial.corners.right;
  trial.markers->position = by * trial.markers->position;
}

std::string all_of(const Trial& trial) {
  std::string text;
  for (const std::string& doubt : doubts(trial)) text += doubt + "\n";
  return text;
}

void expect_doubt(const Trial& trial, const std::string& part) {
  EXPECT_NE(all_of(trial).find(part), std::string::npos) << "not in: " << all_of(trial);
}

TEST(Doubts, OfAHungSwatchThereAreNone) { EXPECT_EQ(all_of(hung()), ""); }

TEST(Doubts, UnitsTakenForOthers) {
  expect_doubt(hung(1000), "280 m apart, expected at most the swatch's width of 300 mm: millimetres taken");
  expect_doubt(hung(100), "centimetres taken for metres?");
  Trial small = hung(0.001);
  expect_doubt(small, "expected some share of the swatch's 300 mm");
}

TEST(Doubts, AxesChangedOver) {
  Trial level = hung();
  Eigen::Matrix3d turned;
  turned << 1, 0, 0, 0, 0, 1, 0, 1, 0;
  turn(level, turned);
  expect_doubt(level, "along gravity, expected about 150 mm: they lie along -y; are axes changed over?");
  Trial upside_down = hung();
  turn(upside_down, Eigen::Vector3d(1, 1, -1).asDiagonal());
  expect_doubt(upside_down, "they lie along +z");
}

TEST(Doubts, LeftAndRightChangedOver) {
  Trial trial = hung();
  std::swap(trial.corners.left, trial.corners.right);
  expect_doubt(trial, "is on the held left corner and lies 280 mm from it");
}

TEST(Doubts, PlacesOnTheFabricInOtherUnits) {
  Trial trial = hung();
  for (Eigen::Vector2d& uv : trial.markers->uv) uv *= 0.1;
  expect_doubt(trial, "times as far apart as u and v say");
}

TEST(Doubts, AnotherClock) {
  Trial trial = hung();
  for (double& t : trial.markers->time_s) t += 100;
  expect_doubt(trial, "0 of 1500 times lie within those of corners.csv (0.000 to 0.983 s)");
}

TEST(Doubts, MarkersThatChangeNumbers) {
  Trial trial = hung();
  for (size_t i = 30 * 25; i < trial.markers->marker.size(); ++i)
    trial.markers->marker[i] = (trial.markers->marker[i] + 12) % 25;
  expect_doubt(trial, "marker numbers kept?");
}

TEST(Doubts, ScannedSurfaces) {
  Trial trial = hung();
  trial.surface = Surface{trial.markers->time_s, trial.markers->position, {}};
  trial.markers.reset();
  EXPECT_EQ(all_of(trial), "");
  Trial large = trial;
  large.surface->position *= 1000;
  expect_doubt(large, "surface.csv: points lie");
  expect_doubt(large, "millimetres taken for metres?");
  Trial level = trial;
  for (Eigen::Index i = 0; i < level.surface->position.cols(); ++i) {
    const Eigen::Vector3d p = level.surface->position.col(i);
    level.surface->position.col(i) = Eigen::Vector3d(p.x(), p.z() - 1, 1 - p.y());
  }
  expect_doubt(level, "surface.csv: points lie 0.448 mm below the held corners");
  Trial with_wall = trial;
  for (Eigen::Index i = 0; i < with_wall.surface->position.cols(); i += 5) with_wall.surface->position(1, i) += 1.5;
  expect_doubt(with_wall, "are there points of other things than the fabric?");
  Trial late = trial;
  for (double& t : late.surface->time_s) t += 100;
  expect_doubt(late, "surface.csv: 0 of 1500 times lie within those of corners.csv");
}

TEST(Doubts, MassAndGravityOfNoFabricOnEarth) {
  Trial trial = hung();
  trial.fabric.mass_kg = 14.4;
  trial.gravity_m_s2 = {0, 0, -981};
  expect_doubt(trial, "trial.json gravity: found 981 m/s², expected about 9.81");
  expect_doubt(trial, "make 160000 g/m², expected 5 to 3000");
}

}  // namespace
}  // namespace selvedge::trial
