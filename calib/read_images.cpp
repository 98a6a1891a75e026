#include "calib/read_images.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>

#include "files/bad_input.h"
#include "geometry/order_statistics.h"

namespace selvedge::calib {

namespace {

void check_size(const GreyImage& image, const ImageSize& size, const std::string& where) {
  if (image.cols() != size.width_px || image.rows() != size.height_px)
    refuse(where, "expected an image of {} x {} px as the camera's, found {} x {}", size.width_px, size.height_px,
           image.cols(), image.rows());
}

// x' ~ H x by the direct linear transform on normalised places, weighted.
Eigen::Matrix3d fit_homography(const std::vector<Eigen::Vector2d>& from, const std::vector<Eigen::Vector2d>& to,
                               const std::vector<double>& weight) {
  const auto normaliser = [&](const std::vector<Eigen::Vector2d>& places) {
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    for (const auto& p : places) mean += p / static_cast<double>(places.size());
    double distance = 1e-12;
    for (const auto& p : places) distance += (p - mean).norm() / static_cast<double>(places.size());
    Eigen::Matrix3d n = Eigen::Matrix3d::Identity();
    n.topLeftCorner<2, 2>() *= std::sqrt(2.0) / distance;
    n.topRightCorner<2, 1>() = -std::sqrt(2.0) / distance * mean;
    return n;
  };
  const Eigen::Matrix3d from_unit = normaliser(from), to_unit = normaliser(to);
  Eigen::MatrixXd a(2 * from.size(), 9);
  for (size_t i = 0; i < from.size(); ++i) {
    const Eigen::RowVector3d x = (from_unit * from[i].homogeneous()).transpose();
    const Eigen::Vector3d y = to_unit * to[i].homogeneous();
    a.row(static_cast<Eigen::Index>(2 * i)) << weight[i] * x, Eigen::RowVector3d::Zero(), -weight[i] * y.x() * x;
    a.row(static_cast<Eigen::Index>(2 * i + 1)) << Eigen::RowVector3d::Zero(), weight[i] * x, -weight[i] * y.y() * x;
  }
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(a, Eigen::ComputeThinV);
  const Eigen::VectorXd h = svd.matrixV().col(8);
  Eigen::Matrix3d unit;
  unit << h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], h[8];
  return to_unit.inverse() * unit * from_unit;
}

struct RingFit {
  std::optional<Eigen::Vector2d> projector;  // at the centre
  double residual_px = 0;                    // median over the ring
};

// Iteratively reweighted: decoding errors of a whole period must not count.
RingFit carry_centre(const std::vector<Eigen::Vector2d>& camera, const std::vector<Eigen::Vector2d>& projector,
                     const Eigen::Vector2d& centre) {
  std::vector<double> weight(camera.size(), 1.0), residual(camera.size());
  Eigen::Matrix3d homography;
  double scale = 0;
  for (int round = 0; round < 6; ++round) {
    homography = fit_homography(camera, projector, weight);
    for (size_t i = 0; i < camera.size(); ++i)
      residual[i] = ((homography * camera[i].homogeneous()).hnormalized() - projector[i]).norm();
    scale = std::max(geometry::median(residual), 0.01);
    for (size_t i = 0; i < camera.size(); ++i) weight[i] = std::sqrt(1 / (1 + std::pow(residual[i] / (2 * scale), 4)));
  }
  return {(homography * centre.homogeneous()).hnormalized(), scale};
}

// Pixels of the ring that belong to one marker. The disc's image is an ellipse; its rough circle will do.
std::vector<Eigen::Vector2i> ring_pixels(const Eigen::Vector2d& centre, double disc_radius_px,
                                         const ReadingOptions& options, const ImageSize& size) {
  std::vector<Eigen::Vector2i> pixels;
  const double inner = options.ring_inner * disc_radius_px + 1, outer = options.ring_outer * disc_radius_px;
  const int reach = static_cast<int>(std::ceil(outer));
  for (int row = static_cast<int>(centre.y()) - reach; row <= centre.y() + reach + 1; ++row)
    for (int column = static_cast<int>(centre.x()) - reach; column <= centre.x() + reach + 1; ++column) {
      const double distance = (Eigen::Vector2d(column, row) - centre).norm();
      if (distance < inner || distance > outer || row < 0 || column < 0 || row >= size.height_px ||
          column >= size.width_px)
        continue;
      pixels.emplace_back(column, row);
    }
  return pixels;
}

struct ProjectorReading {
  std::vector<double> gammas, blurs;
  DecodeLosses losses;
  int markers = 0;
};

std::string describe_loss(const DecodeLosses& losses) {
  if (losses.clipped >= losses.dark && losses.clipped >= losses.ambiguous)
    return fmt::format("projector: {:.0f} % of the ring about the marker is clipped", 100 * losses.clipped);
  if (losses.dark >= losses.ambiguous)
    return fmt::format("projector: {:.0f} % of the ring is too dark or has too little contrast", 100 * losses.dark);
  return fmt::format("projector: code and phase disagree on {:.0f} % of the ring", 100 * losses.ambiguous);
}

// Decodes the rings of one pose's markers into the rows [first, end).
void read_projector(const PoseImages& pose, const std::map<int, double>& disc_radius_px, size_t first,
                    const ReadingOptions& options, ImageReading& reading, ProjectorReading& sums) {
  std::vector<Eigen::Vector2i> all;
  std::vector<size_t> start;
  for (size_t i = first; i < reading.poses.rows.size(); ++i) {
    start.push_back(all.size());
    const Correspondence& row = reading.poses.rows[i];
    if (!row.camera) continue;
    const auto ring = ring_pixels(*row.camera, disc_radius_px.at(row.marker), options, reading.poses.camera);
    all.insert(all.end(), ring.begin(), ring.end());
  }
  start.push_back(all.size());
  const Decoded decoded = decode(pose.sequence, all, options.decode);
  sums.gammas.push_back(decoded.gamma);
  sums.blurs.push_back(decoded.blur_px);

  for (size_t i = first; i < reading.poses.rows.size(); ++i) {
    Correspondence& row = reading.poses.rows[i];
    const size_t begin = start[i - first], end = start[i - first + 1];
    if (!row.camera || begin == end) continue;
    std::vector<Eigen::Vector2d> camera, projector;
    for (size_t j = begin; j < end; ++j)
      if (decoded.column_row[j].allFinite()) {
        camera.push_back(all[j].cast<double>());
        projector.push_back(decoded.column_row[j]);
      }
    ++sums.markers;
    const Eigen::Vector2d low(-0.5, -0.5),
        high(reading.poses.projector.width_px - 0.5, reading.poses.projector.height_px - 0.5);
    std::string why;
    if (static_cast<int>(camera.size()) < options.least_ring_pixels) {
      const std::vector<Eigen::Vector2i> own(all.begin() + static_cast<std::ptrdiff_t>(begin),
                                             all.begin() + static_cast<std::ptrdiff_t>(end));
      const DecodeLosses losses = decode(pose.sequence, own, options.decode).losses;
      sums.losses.clipped += losses.clipped;
      sums.losses.dark += losses.dark;
      sums.losses.ambiguous += losses.ambiguous;
      why = describe_loss(losses);
    } else {
      const RingFit fit = carry_centre(camera, projector, *row.camera);
      if (fit.residual_px > 2) why = fmt::format("projector: decoded ring is {:.1f} px from a plane", fit.residual_px);
      else if ((fit.projector->array() < low.array()).any() || (fit.projector->array() > high.array()).any())
        why = "projector: marker lies outside its image";
      else row.projector = fit.projector;
    }
    if (!why.empty()) reading.unread.push_back({row.pose, row.marker, why});
  }
}

void add_remarks(ImageReading& reading, const ProjectorReading& sums) {
  if (sums.gammas.empty()) return;
  reading.gamma = geometry::median(sums.gammas);
  reading.projector_blur_px = geometry::median(sums.blurs);
  const double markers = std::max(sums.markers, 1);
  reading.losses = {sums.losses.clipped / markers, sums.losses.dark / markers, sums.losses.ambiguous / markers};
  if (std::abs(reading.gamma - 1) > 0.1)
    reading.remarks.push_back(
        fmt::format("The projector's gamma is {:.2f}; it was taken out before the phases.", reading.gamma));
  if (reading.projector_blur_px > 2.5)
    reading.remarks.push_back(
        fmt::format("The projector is out of focus at the grid: its pixels are blurred by {:.1f} px. "
                    "Focus it on the fabric's volume.",
                    reading.projector_blur_px));
  if (reading.losses.clipped > 0.02)
    reading.remarks.push_back(
        fmt::format("Clipped highlights cost the projector {:.0f} % of what it could read: shorten the "
                    "exposure or close the aperture.",
                    100 * reading.losses.clipped));
  if (reading.losses.dark > 0.05)
    reading.remarks.push_back(
        fmt::format("Low contrast cost the projector {:.0f} % of what it could read: lengthen the exposure, "
                    "dim the room.",
                    100 * reading.losses.dark));
}

}  // namespace

ImageReading read_images(const std::vector<PoseImages>& poses, const Poses& header, const ReadingOptions& options) {
  ImageReading reading;
  reading.poses = header;
  reading.poses.rows.clear();
  std::vector<UnlabelledPose> unlabelled;
  for (const PoseImages& pose : poses) {
    const std::string where = fmt::format("pose {}", pose.pose);
    check_size(pose.marker_image, header.camera, where + ": marker image");
    for (const PatternImage& image : pose.sequence) check_size(image.image, header.camera, where + ": pattern image");
    unlabelled.push_back({pose.pose, pose.markers, find_blobs(pose.marker_image, options.blobs)});
  }
  LabellingOptions labelling_options = options.labelling;
  labelling_options.tracker_noise_m = std::max(header.tracker_noise_m, 1e-5);
  const Labelling labelling = label_markers(unlabelled, header.camera, labelling_options);
  if (!labelling.found)
    refuse("marker images",
           "no camera explains the {} poses' blobs as the tracked markers; expected at least 4 poses that "
           "show the grid, or a rough guess of the camera",
           poses.size());
  reading.rough_camera = labelling.camera;
  reading.matched_share = labelling.matched_share;

  ProjectorReading sums;
  size_t next_label = 0;
  for (size_t p = 0; p < poses.size(); ++p) {
    const size_t first = reading.poses.rows.size();
    std::map<int, double> disc_radius_px;
    for (const TrackedMarker& marker : poses[p].markers) {
      const LabelledMarker& label = labelling.markers[next_label++];
      Correspondence row;
      row.pose = poses[p].pose;
      row.marker = marker.marker;
      row.position = marker.position;
      row.camera = label.pixel;
      if (label.pixel) {
        for (const Blob& blob : unlabelled[p].blobs)
          if (blob.centre == *label.pixel) disc_radius_px[marker.marker] = std::sqrt(blob.area_px / M_PI);
      } else {
        reading.unread.push_back({row.pose, row.marker, label.why});
      }
      reading.poses.rows.push_back(row);
    }
    if (!poses[p].sequence.empty()) read_projector(poses[p], disc_radius_px, first, options, reading, sums);
  }
  if (labelling.stray_blobs > 0)
    reading.remarks.push_back(
        fmt::format("{} bright blobs are no marker: look for reflections.", labelling.stray_blobs));
  add_remarks(reading, sums);
  return reading;
}

Calibration calibrate_images(const std::vector<PoseImages>& poses, const Poses& header,
                             const ReadingOptions& reading_options, const Options& options) {
  const ImageReading reading = read_images(poses, header, reading_options);
  Calibration calibration = calibrate(reading.poses, options);
  calibration.rejected.insert(calibration.rejected.end(), reading.unread.begin(), reading.unread.end());
  for (const std::string& remark : reading.remarks) calibration.advice += " " + remark;
  // Out of focus or clipped, a projector may still solve well; it must not pass without a word.
  const bool troubled = reading.projector_blur_px > 2.5 || reading.losses.clipped > 0.1 || reading.losses.dark > 0.2;
  if (troubled && calibration.verdict == Verdict::good) calibration.verdict = Verdict::doubtful;
  return calibration;
}

}  // namespace selvedge::calib
