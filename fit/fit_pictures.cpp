#include "fit/fit_pictures.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "fit/fold_metric.h"
#include "fit/shown_motion.h"
#include "observe/stripe_observation.h"
#include "observe/stripe_residual.h"
#include "render/row_map.h"
#include "render/stripe_renderer.h"
#include "report/flipped_pictures.h"

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

void add_frames(report::HtmlReport& html, const FitOutcome& out, const trial::Trial& trial, size_t index,
                const cloth::Trajectory& run) {
  const model::ObservedTrial& observed = out.simulation->trials()[index];
  const observe::StripeTrack& track = *observed.stripes;
  render::StripeRenderer renderer(track.camera, track.projector);
  renderer.set_pattern(track.pattern);
  render::RowMap map(track.camera, track.projector);
  FoldMetric metric;
  std::vector<report::PicturePair> pairs;
  std::vector<std::pair<std::vector<std::string>, std::vector<std::string>>> maps;  // pictures, captions
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
    const std::string name = fmt::format("{}, frame {}", trial.name, frame.number);
    pairs.push_back({name, png_of(grey(recorded)), png_of(grey(simulated))});
    maps.push_back(
        {{png_of(hues(a)), png_of(hues(b)), png_of(difference(a, b))},
         {name + ": angle map, recorded", "angle map, simulated",
          fmt::format("difference of the angles (white: 20° and more); error of the folds {:.1f}, of the outline "
                      "{:.0f} px, both together {:.1f}",
                      error.fold, error.silhouette, error.total)}});
  }
  html.interactive(report::flipped_pictures(pairs), trial.name + ": recorded and simulated pictures");
  for (const auto& [pictures, captions] : maps) html.picture_row(pictures, captions);
}

report::MovingSheet motion_of(const FitOutcome& out, size_t index, const cloth::Trajectory& run) {
  const model::ObservedTrial& trial = out.simulation->trials()[index];
  const ShownSwatch swatch(*out.simulation, index);
  RecordedMotion recorded = recorded_motion(trial);
  report::SheetView fitted{"fitted", {}, expected_markers(trial, recorded, out.residuals.mm[index])};
  for (const double t : recorded.time_s) fitted.sheet.push_back(swatch.at(run, t));
  recorded.shown.views = {std::move(fitted)};
  return std::move(recorded.shown);
}

}  // namespace

void add_pictures(report::HtmlReport& html, const FitOutcome& out, const trial::Campaign& campaign) {
  std::vector<model::Parameter> parameters;
  for (const FittedParameter& p : out.parameters) parameters.push_back(p.parameter);
  std::vector<cloth::Trajectory> runs;
  std::vector<report::MovingSheet> motions;
  for (size_t i = 0; i < out.simulation->trials().size(); ++i) {
    runs.push_back(out.simulation->trajectory(out.state, parameters, out.coordinates, i));
    motions.push_back(motion_of(out, i, runs.back()));
  }
  html.heading("In motion");
  html.interactive(
      report::moving_sheets(motions, "", ""),
      "The fitted sheet, and dots where markers or the surface were recorded. Lines: from markers to where "
      "the fit has them (blue: none off, red: 4 mm and more). Drag or press the arrow keys to turn, turn "
      "the wheel or press + to come nearer.");
  bool begun = false;
  for (size_t i = 0; i < runs.size(); ++i) {
    const model::ObservedTrial& t = out.simulation->trials()[i];
    if (!t.stripes || t.stripes->of_cloud) continue;
    if (!std::exchange(begun, true)) html.heading("Recorded and simulated");
    add_frames(html, out, campaign.trials[i], i, runs[i]);
  }
}

}  // namespace selvedge::fit
