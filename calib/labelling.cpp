#include "calib/labelling.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include <Eigen/Geometry>
#include <Eigen/QR>

#include "calib/refine.h"
#include "geometry/order_statistics.h"

namespace selvedge::calib {

namespace {

constexpr double kFewPartners = 0.5;     // share of a pose's markers: fewer, and the camera may have stood elsewhere
constexpr double kEnoughPartners = 0.6;  // that a shift of the image must bring
constexpr double kKnock_px = 200;

struct Pair {
  size_t pose, marker, blob;
};

struct Hypothesis {
  CameraParameters camera;
  double cost = std::numeric_limits<double>::infinity();
};

double median(std::vector<double> values) {
  return values.empty() ? std::numeric_limits<double>::infinity() : geometry::median(std::move(values));
}

// Mean of a pose's markers and of its blobs.
struct PoseMeans {
  Eigen::Vector3d point;
  Eigen::Vector2d pixel;
};

std::vector<PoseMeans> means_of(const std::vector<UnlabelledPose>& poses) {
  std::vector<PoseMeans> means;
  for (const UnlabelledPose& pose : poses) {
    if (pose.blobs.empty() || pose.markers.empty()) continue;
    PoseMeans mean{Eigen::Vector3d::Zero(), Eigen::Vector2d::Zero()};
    for (const TrackedMarker& m : pose.markers) mean.point += m.position / static_cast<double>(pose.markers.size());
    // Stray blobs lie anywhere; the median per axis bears a few.
    std::vector<double> u, v;
    for (const Blob& blob : pose.blobs) {
      u.push_back(blob.centre.x());
      v.push_back(blob.centre.y());
    }
    mean.pixel = Eigen::Vector2d(median(u), median(v));
    means.push_back(mean);
  }
  return means;
}

// With the direction of view held, the camera's place follows linearly from the means:
//   f (R_x X + t_x) − (u − c_x)(R_z X + t_z) = 0, and the same for v.
Hypothesis place_camera(const std::vector<PoseMeans>& means, const Eigen::Matrix3d& rotation, double focal,
                        const Eigen::Vector2d& middle) {
  Eigen::MatrixXd a(2 * means.size(), 3);
  Eigen::VectorXd b(2 * means.size());
  for (size_t i = 0; i < means.size(); ++i) {
    const Eigen::Vector3d turned = rotation * means[i].point;
    const Eigen::Vector2d off = means[i].pixel - middle;
    a.row(static_cast<Eigen::Index>(2 * i)) << focal, 0, -off.x();
    a.row(static_cast<Eigen::Index>(2 * i + 1)) << 0, focal, -off.y();
    b[static_cast<Eigen::Index>(2 * i)] = off.x() * turned.z() - focal * turned.x();
    b[static_cast<Eigen::Index>(2 * i + 1)] = off.y() * turned.z() - focal * turned.y();
  }
  Hypothesis hypothesis;
  const Eigen::Vector3d translation = a.colPivHouseholderQr().solve(b);
  const Eigen::AngleAxisd turn(rotation);
  hypothesis.camera << focal, focal, middle, 0, 0, 0, 0, 0, turn.angle() * turn.axis(), translation;
  std::vector<double> errors;
  for (const PoseMeans& mean : means) {
    if (depth_of(hypothesis.camera, mean.point) <= 0.05) return hypothesis;
    errors.push_back((pixel_of(hypothesis.camera, mean.point) - mean.pixel).norm());
  }
  double sum = 0;
  for (const double error : errors) sum += std::min(error, 100.0);
  hypothesis.cost = sum / static_cast<double>(errors.size());
  return hypothesis;
}

// Directions of view every 10° about the vertical, in height and about the axis, at four focal lengths.
std::vector<Hypothesis> guess_from_means(const std::vector<UnlabelledPose>& poses, const ImageSize& size) {
  const std::vector<PoseMeans> means = means_of(poses);
  std::vector<Hypothesis> guesses;
  if (means.size() < 4) return guesses;
  const Eigen::Vector2d middle((size.width_px - 1) / 2.0, (size.height_px - 1) / 2.0);
  Eigen::Matrix3d forward;  // camera x, y, z along world x, −z, y
  forward << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  const double degree = M_PI / 180;
  for (int azimuth = 0; azimuth < 360; azimuth += 10)
    for (int elevation = -60; elevation <= 60; elevation += 10)
      for (int roll = -180; roll < 180; roll += 10)
        for (const double focal : {0.8, 1.1, 1.6, 2.4}) {
          const Eigen::Matrix3d rotation = (Eigen::AngleAxisd(roll * degree, Eigen::Vector3d::UnitZ()) *
                                            Eigen::AngleAxisd(elevation * degree, Eigen::Vector3d::UnitX()) * forward *
                                            Eigen::AngleAxisd(azimuth * degree, Eigen::Vector3d::UnitZ()))
                                               .matrix();
          guesses.push_back(place_camera(means, rotation, focal * size.width_px, middle));
        }
  const size_t kept = std::min<size_t>(200, guesses.size());
  std::partial_sort(guesses.begin(), guesses.begin() + static_cast<std::ptrdiff_t>(kept), guesses.end(),
                    [](const Hypothesis& a, const Hypothesis& b) { return a.cost < b.cost; });
  guesses.resize(kept);
  return guesses;
}

// Markers and blobs that are each other's nearest within the gate.
std::vector<Pair> mutual_nearest(const std::vector<UnlabelledPose>& poses, const CameraParameters& camera,
                                 double gate_px) {
  std::vector<Pair> pairs;
  for (size_t p = 0; p < poses.size(); ++p) {
    std::vector<Eigen::Vector2d> expected;
    for (const TrackedMarker& m : poses[p].markers)
      expected.push_back(depth_of(camera, m.position) > 0 ? pixel_of(camera, m.position)
                                                          : Eigen::Vector2d::Constant(1e9));
    for (size_t b = 0; b < poses[p].blobs.size(); ++b) {
      const auto nearest_to = [](const Eigen::Vector2d& place, size_t count, auto&& at) {
        size_t best = 0;
        double least = std::numeric_limits<double>::infinity();
        for (size_t i = 0; i < count; ++i)
          if (const double squared = (at(i) - place).squaredNorm(); squared < least) {
            least = squared;
            best = i;
          }
        return std::pair(best, least);
      };
      const auto [marker, squared] =
          nearest_to(poses[p].blobs[b].centre, expected.size(), [&](size_t i) { return expected[i]; });
      if (!(squared < gate_px * gate_px)) continue;
      const auto [back, unused] =
          nearest_to(expected[marker], poses[p].blobs.size(), [&](size_t i) { return poses[p].blobs[i].centre; });
      (void)unused;
      if (back == b) pairs.push_back({p, marker, b});
    }
  }
  return pairs;
}

double marker_spacing_px(const std::vector<UnlabelledPose>& poses, const CameraParameters& camera) {
  std::vector<double> distances;
  for (const UnlabelledPose& pose : poses)
    for (size_t i = 0; i < pose.markers.size(); ++i) {
      double least = std::numeric_limits<double>::infinity();
      for (size_t j = 0; j < pose.markers.size(); ++j)
        if (i != j)
          least = std::min(
              least, (pixel_of(camera, pose.markers[i].position) - pixel_of(camera, pose.markers[j].position)).norm());
      distances.push_back(least);
    }
  return median(distances);
}

double score(const std::vector<UnlabelledPose>& poses, const CameraParameters& camera, double gate_px) {
  double sum = 0, all = 0;
  for (const UnlabelledPose& pose : poses) all += static_cast<double>(pose.markers.size());
  for (const Pair& pair : mutual_nearest(poses, camera, gate_px)) {
    const double error =
        (pixel_of(camera, poses[pair.pose].markers[pair.marker].position) - poses[pair.pose].blobs[pair.blob].centre)
            .norm();
    sum += 1 - error / gate_px;
  }
  return all > 0 ? sum / all : 0;
}

// One focal length and no distortion while the partners are rough; what is left is free at the end.
Refined refine_to_pairs(const std::vector<UnlabelledPose>& poses, const std::vector<Pair>& pairs, const Refined& start,
                        DistortionOrder order, double tracker_noise_m) {
  auto sightings = std::make_shared<std::vector<Sighting>>();
  for (const Pair& pair : pairs)
    sightings->push_back({poses[pair.pose].pose, poses[pair.pose].markers[pair.marker].marker, 0,
                          poses[pair.pose].markers[pair.marker].position, poses[pair.pose].blobs[pair.blob].centre});
  RefineInput input;
  input.sightings = sightings;
  input.used.assign(sightings->size(), 1);
  input.tracker_noise_m = tracker_noise_m;
  input.order = order;
  return refine(input, start, Loss::cauchy);
}

// Partners and refinement in turn, with a gate that closes.
CameraParameters close_in(const std::vector<UnlabelledPose>& poses, const CameraParameters& guess,
                          const LabellingOptions& options) {
  Refined refined;
  refined.camera = guess;
  const double spacing = marker_spacing_px(poses, guess);
  for (const double share : {0.9, 0.7, 0.5, 0.5, 0.35, 0.25, 0.15, 0.1, 0.1}) {
    const double gate = std::max(share * spacing, options.gate_px);
    const std::vector<Pair> pairs = mutual_nearest(poses, refined.camera, gate);
    if (pairs.size() < 12) return guess;
    refined.pixel_sd_px = gate / 3;
    const CameraParameters before = refined.camera;
    refined = refine_to_pairs(poses, pairs, refined, share > 0.15 ? DistortionOrder::none : DistortionOrder::k1_k2,
                              options.tracker_noise_m);
    if (!refined.camera.allFinite() || refined.camera[0] < 0.2 * guess[0] || refined.camera[0] > 5 * guess[0])
      return before;
  }
  return refined.camera;
}

bool lies_in_a_blob(const UnlabelledPose& pose, const Eigen::Vector2d& pixel, double gate_px) {
  return std::any_of(pose.blobs.begin(), pose.blobs.end(), [&](const Blob& blob) {
    return (blob.centre - pixel).norm() < std::sqrt(blob.area_px / M_PI) * blob.elongation + gate_px;
  });
}

// The camera as it stood in one pose, and how far off a partner may be.
struct Stand {
  CameraParameters camera;
  double gate_px;
};

// A camera that was knocked between poses agrees with the others' camera but for a shift of its image: the one that
// brings most markers to blobs is taken, where the pose has few partners without.
Stand stand_in(const UnlabelledPose& pose, const CameraParameters& camera, double gate_px) {
  const auto partners = [&](const CameraParameters& at, double gate) {
    return mutual_nearest({pose}, at, gate).size();
  };
  const Stand as_the_others{camera, gate_px};
  if (partners(camera, gate_px) >= kFewPartners * static_cast<double>(pose.markers.size())) return as_the_others;
  const double wide_gate_px = std::max(gate_px, 0.2 * marker_spacing_px({pose}, camera));
  Stand best = as_the_others;
  size_t most = static_cast<size_t>(kEnoughPartners * static_cast<double>(pose.markers.size()));
  for (const TrackedMarker& marker : pose.markers)
    for (const Blob& blob : pose.blobs) {
      const Eigen::Vector2d shift = blob.centre - pixel_of(camera, marker.position);
      if (shift.norm() > kKnock_px) continue;
      CameraParameters moved = camera;
      moved.segment<2>(kPrincipal) += shift;
      if (const size_t count = partners(moved, wide_gate_px); count > most) {
        most = count;
        best = {moved, wide_gate_px};
      }
    }
  return best;
}

void collect(Labelling& result, const std::vector<UnlabelledPose>& poses, double gate_px) {
  size_t matched = 0, all = 0;
  for (size_t p = 0; p < poses.size(); ++p) {
    std::vector<const Blob*> partner(poses[p].markers.size(), nullptr);
    const Stand stand = stand_in(poses[p], result.camera, gate_px);
    for (const Pair& pair : mutual_nearest({poses[p]}, stand.camera, stand.gate_px))
      partner[pair.marker] = &poses[p].blobs[pair.blob];
    size_t taken = 0;
    for (size_t m = 0; m < partner.size(); ++m) {
      LabelledMarker labelled{poses[p].pose, poses[p].markers[m].marker, std::nullopt, ""};
      ++all;
      if (partner[m]) ++taken;
      if (!partner[m]) {
        labelled.why = lies_in_a_blob(poses[p], pixel_of(stand.camera, poses[p].markers[m].position), gate_px)
                           ? "camera: blob is merged with another"
                           : "camera: hidden, no blob where the marker should be";
      } else if (!looks_like_one_disc(*partner[m])) {
        labelled.why = "camera: blob is merged with another or cut off";
      } else {
        labelled.pixel = partner[m]->centre;
        ++matched;
      }
      result.markers.push_back(labelled);
    }
    result.stray_blobs += static_cast<int>(poses[p].blobs.size() - taken);
  }
  result.matched_share = all > 0 ? static_cast<double>(matched) / static_cast<double>(all) : 0;
}

}  // namespace

Labelling label_markers(const std::vector<UnlabelledPose>& poses, const ImageSize& size,
                        const LabellingOptions& options) {
  std::vector<Hypothesis> guesses;
  if (options.camera) guesses.push_back({*options.camera, 0});
  else guesses = guess_from_means(poses, size);

  Labelling result;
  double best = 0;
  for (const Hypothesis& guess : guesses) {
    if (!std::isfinite(guess.cost)) continue;
    const CameraParameters camera = close_in(poses, guess.camera, options);
    const double value = score(poses, camera, options.gate_px);
    if (value <= best) continue;
    best = value;
    result.camera = camera;
    // Most markers within a pixel or so: no other direction can do better.
    if (value > 0.7) break;
  }
  // Partners by chance come to a few per cent.
  result.found = best > 0.25;
  if (result.found) collect(result, poses, options.gate_px);
  return result;
}

}  // namespace selvedge::calib
