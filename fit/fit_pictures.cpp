#include "fit/fit_pictures.h"

#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "fit/fold_metric.h"
#include "observe/stripe_observation.h"
#include "observe/stripe_residual.h"
#include "render/row_map.h"
#include "render/stripe_renderer.h"

namespace selvedge::fit {

namespace {

std::string png_of(const cv::Mat& image) {
  std::vector<unsigned char> bytes;
  cv::imencode(".png", image, bytes);
  return {bytes.begin(), bytes.end()};
}

cv::Mat grey(const render::Image& image) {
  return cv::Mat(static_cast<int>(image.rows()), static_cast<int>(image.cols()), CV_8UC1,
                 const_cast<unsigned char*>(image.data()))
      .clone();
}

// Angles as hues (they wrap), black outside the silhouette.
cv::Mat hues(const AngleMap& map) {
  cv::Mat hsv(map.height, map.width, CV_8UC3, cv::Scalar(0, 0, 0));
  for (int i = 0; i < map.width * map.height; ++i)
    if (map.inside[static_cast<size_t>(i)]) {
      const double turn = map.angle_rad[static_cast<size_t>(i)] / M_PI;
      hsv.at<cv::Vec3b>(i / map.width, i % map.width) =
          cv::Vec3b(static_cast<unsigned char>(180 * (turn - std::floor(turn))), 200, 230);
    }
  cv::Mat bgr;
  cv::cvtColor(hsv, bgr, cv::COLOR_HSV2BGR);
  return bgr;
}

// Difference of two angle maps where both see fabric: black 0, white 20° and more.
cv::Mat difference(const AngleMap& a, const AngleMap& b) {
  cv::Mat out(a.height, a.width, CV_8UC1, cv::Scalar(0));
  for (int i = 0; i < a.width * a.height; ++i) {
    const auto at = static_cast<size_t>(i);
    if (!a.inside[at] || !b.inside[at]) continue;
    double d = std::fmod(std::abs(static_cast<double>(a.angle_rad[at]) - static_cast<double>(b.angle_rad[at])), M_PI);
    d = std::min(d, M_PI - d);
    out.at<unsigned char>(i / a.width, i % a.width) =
        static_cast<unsigned char>(std::min(255.0, 255 * d / (20 * M_PI / 180)));
  }
  return out;
}

cloth::Trajectory fitted_run(const FitOutcome& out, size_t trial) {
  std::vector<model::Parameter> parameters;
  for (const FittedParameter& p : out.parameters) parameters.push_back(p.parameter);
  return out.simulation->trajectory(out.state, parameters, out.coordinates, trial);
}

void add_frames(report::HtmlReport& html, const FitOutcome& out, const trial::Trial& trial, size_t index) {
  const model::ObservedTrial& observed = out.simulation->trials()[index];
  const observe::StripeTrack& track = *observed.stripes;
  const cloth::Trajectory run = fitted_run(out, index);
  render::StripeRenderer renderer(track.camera, track.projector);
  renderer.set_pattern(track.pattern);
  render::RowMap map(track.camera, track.projector);
  FoldMetric metric;
  for (const size_t k : std::set<size_t>{0, track.frames.size() / 2, track.frames.size() - 1}) {
    if (k > 0 && observed.still) break;
    const observe::StripeFrame& frame = track.frames[k];
    const render::Image recorded = trial::read_frame(trial, frame.index);
    const Eigen::Matrix3Xd x = out.simulation->view().of(model::position_at(observed.experiment, run, frame.time_s));
    const render::Image simulated = renderer.render(x, out.simulation->view().mesh().triangles);
    std::vector<unsigned char> inside;
    map.rasterise(x, out.simulation->view().mesh().triangles);
    map.fill_silhouette(inside);
    const observe::StripeObservation seen =
        observe::observe_stripes(recorded, track.camera, track.projector, track.pattern);
    const AngleMap a = metric.angle_map(recorded, seen.inside), b = metric.angle_map(simulated, inside);
    const FoldError error = metric.compare(a, b);
    html.picture_row(
        {png_of(grey(recorded)), png_of(grey(simulated)), png_of(hues(a)), png_of(hues(b)), png_of(difference(a, b))},
        {fmt::format("{}, frame {}: recorded", trial.name, frame.number), "simulated", "angle map, recorded",
         "angle map, simulated",
         fmt::format("difference of the angles (white: 20° and more); error of the folds {:.1f}, of the outline {:.0f} "
                     "px, both "
                     "together {:.1f}",
                     error.fold, error.silhouette, error.total)});
  }
}

// Front and side view of dots (circles) and simulated sheet (lines) at one time.
cv::Mat draw_dots(const model::Simulation& objective, const Eigen::Matrix3Xd& sheet, const Eigen::Matrix3Xd& dots,
                  int radius_px, int across) {
  const int size = 360;
  cv::Mat image(size, size, CV_8UC3, cv::Scalar(255, 255, 255));
  const Eigen::Vector3d low = sheet.rowwise().minCoeff(), high = sheet.rowwise().maxCoeff(), middle = (low + high) / 2;
  const double scale = 0.85 * size / std::max({high.x() - low.x(), high.y() - low.y(), high.z() - low.z()});
  const auto at = [&](const Eigen::Vector3d& p) {
    return cv::Point(static_cast<int>(size / 2 + scale * (p(across) - middle(across))),
                     static_cast<int>(size / 2 - scale * (p.z() - middle.z())));
  };
  for (const auto& t : objective.view().mesh().triangles)
    for (size_t k = 0; k < 3; ++k)
      cv::line(image, at(sheet.col(t[k])), at(sheet.col(t[(k + 1) % 3])), cv::Scalar(200, 180, 150), 1, cv::LINE_AA);
  for (Eigen::Index i = 0; i < dots.cols(); ++i)
    if (dots.col(i).allFinite())
      cv::circle(image, at(dots.col(i)), radius_px, cv::Scalar(20, 20, 200), std::min(radius_px, 2), cv::LINE_AA);
  return image;
}

// What was seen at one time.
struct SeenThen {
  double time_s = 0;
  Eigen::Matrix3Xd position;  // m
};

SeenThen markers_then(const observe::MarkerTrack& m, double share) {
  const auto times = static_cast<Eigen::Index>(m.time_s.size());
  const auto j = static_cast<Eigen::Index>(share * static_cast<double>(times));
  SeenThen out{m.time_s[static_cast<size_t>(j)], Eigen::Matrix3Xd(3, static_cast<Eigen::Index>(m.uv.size()))};
  for (Eigen::Index k = 0; k < out.position.cols(); ++k) out.position.col(k) = m.position.col(k * times + j);
  return out;
}

SeenThen surface_then(const observe::StripeTrack& track, double share) {
  const observe::StripeFrame& f = track.frames[static_cast<size_t>(share * static_cast<double>(track.frames.size()))];
  SeenThen out{f.time_s, Eigen::Matrix3Xd(3, static_cast<Eigen::Index>(f.depth.size()))};
  for (size_t k = 0; k < f.depth.size(); ++k)
    out.position.col(static_cast<Eigen::Index>(k)) = place_of(track.camera, f.depth[k]);
  return out;
}

void add_dots(report::HtmlReport& html, const FitOutcome& out, size_t index) {
  const model::ObservedTrial& observed = out.simulation->trials()[index];
  const cloth::Trajectory run = fitted_run(out, index);
  std::vector<std::string> pictures, captions;
  for (const double share : {0.0, 0.35, 0.7}) {
    if (share > 0 && observed.still) break;
    const SeenThen seen =
        observed.markers ? markers_then(*observed.markers, share) : surface_then(*observed.stripes, share);
    const Eigen::Matrix3Xd x = out.simulation->view().of(model::position_at(observed.experiment, run, seen.time_s));
    for (const int across : {0, 1}) {
      pictures.push_back(png_of(draw_dots(*out.simulation, x, seen.position, observed.markers ? 4 : 1, across)));
      captions.push_back(fmt::format("{}, {:.2f} s, {} view", observed.name, seen.time_s, across == 0 ? "x-z" : "y-z"));
    }
  }
  html.picture_row(pictures, captions);
}

}  // namespace

void add_pictures(report::HtmlReport& html, const FitOutcome& out, const trial::Campaign& campaign) {
  html.heading("Recorded and simulated");
  bool markers = false, clouds = false;
  for (size_t i = 0; i < out.simulation->trials().size(); ++i) {
    const model::ObservedTrial& t = out.simulation->trials()[i];
    const bool is_cloud = t.stripes && t.stripes->of_cloud;
    if (t.stripes && !is_cloud) add_frames(html, out, campaign.trials[i], i);
    if (t.markers || is_cloud) add_dots(html, out, i);
    markers = markers || t.markers;
    clouds = clouds || is_cloud;
  }
  if (markers) html.paragraph("Circles: tracked markers. Lines: the simulated sheet.");
  if (clouds) html.paragraph("Dots: the scanned surface. Lines: the simulated sheet.");
}

}  // namespace selvedge::fit
