#include "station/exchange/trial_preview.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <vector>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "capture/trial/doubts.h"
#include "capture/trial/trial_summary.h"
#include "files/whole_file.h"
#include "report/html.h"
#include "report/svg.h"
#include "report/text_table.h"
#include "station/exchange/trial_facts.h"

namespace selvedge::station {

namespace {

using Eigen::Index;
using Eigen::Vector3d;
using report::short_number;
using trial::Trial;

constexpr double kPane = 300, kPaneTop = 24, kPaneMargin = 26;  // px

// Where the fabric hangs: from the corners' middle, across along the held edge, down along gravity.
struct HangingFrame {
  Vector3d origin = Vector3d::Zero(), across = Vector3d::UnitX(), down = -Vector3d::UnitZ();
  Vector3d towards() const { return down.cross(across); }
};

struct HangingMoment {
  std::vector<Vector3d> points, corners;  // points: markers, or some of a scanned surface
};

// Both corners, each as it is seen nearest to a time.
std::vector<Vector3d> corners_near(const Trial& trial, double time_s) {
  std::vector<Vector3d> out;
  for (const Eigen::Matrix3Xd* corner : {&trial.corners.left, &trial.corners.right}) {
    const auto away = [&](Index i) { return std::abs(trial.corners.time_s[static_cast<size_t>(i)] - time_s); };
    Index nearest = -1;
    for (Index i = 0; i < corner->cols(); ++i)
      if (corner->col(i).allFinite() && (nearest < 0 || away(i) < away(nearest))) nearest = i;
    if (nearest >= 0) out.emplace_back(corner->col(nearest));
  }
  return out;
}

// Markers, or else the scanned surface.
struct SeenPoints {
  const std::vector<double>& time_s;
  const Eigen::Matrix3Xd& position;
};

SeenPoints seen_points(const Trial& trial) {
  if (trial.markers) return {trial.markers->time_s, trial.markers->position};
  return {trial.surface->time_s, trial.surface->position};
}

// Each time once, ascending.
std::vector<double> times_of(const SeenPoints& seen) {
  std::vector<double> times = seen.time_s;
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  return times;
}

HangingMoment moment_of(const Trial& trial, const std::vector<double>& times, double share) {
  constexpr size_t kMostPoints = 500;  // of a scanned surface
  const SeenPoints seen = seen_points(trial);
  const double time_s = times[static_cast<size_t>(std::lround(share * static_cast<double>(times.size() - 1)))];
  std::vector<Vector3d> points;
  for (size_t i = 0; i < seen.time_s.size(); ++i)
    if (const auto at = static_cast<Index>(i); seen.time_s[i] == time_s && seen.position.col(at).allFinite())
      points.emplace_back(seen.position.col(at));
  HangingMoment out{{}, corners_near(trial, time_s)};
  const size_t every = trial.markers ? 1 : points.size() / kMostPoints + 1;
  for (size_t i = 0; i < points.size(); i += every) out.points.push_back(points[i]);
  return out;
}

HangingFrame frame_of(const Trial& trial, const HangingMoment& moment) {
  HangingFrame out;
  if (trial.gravity_m_s2.norm() > 1e-6) out.down = trial.gravity_m_s2.normalized();
  if (moment.corners.size() == 2) {
    out.origin = (moment.corners[0] + moment.corners[1]) / 2;
    out.across = moment.corners[1] - moment.corners[0];
  }
  out.across -= out.down * out.down.dot(out.across);
  if (out.across.norm() < 1e-9) out.across = out.down.unitOrthogonal();
  out.across.normalize();
  return out;
}

// One scale for all moments: whatever lies furthest out is still seen. px/m.
double pane_scale(const Trial& trial, const std::vector<HangingMoment>& moments, const HangingFrame& frame) {
  double reach = std::max(trial.fabric.height_m, 1e-6);
  for (const HangingMoment& moment : moments)
    for (const auto* points : {&moment.points, &moment.corners})
      for (const Vector3d& p : *points) reach = std::max(reach, (p - frame.origin).norm());
  return (kPane / 2 - kPaneMargin) / reach;
}

// The front and, beside it, the side: down is down in both.
std::string views_of(const Trial& trial, const HangingMoment& moment, const HangingFrame& f, double scale) {
  const Vector3d half = trial.fabric.width_m / 2 * f.across, drop = trial.fabric.height_m * f.down;
  const std::vector<Vector3d> flat = {f.origin - half, f.origin + half, f.origin + half + drop, f.origin - half + drop};
  std::string svg;
  double middle = kPane / 2;
  for (const auto& [side, name] : {std::pair{f.across, "front"}, {f.towards(), "side"}}) {
    const auto x = [&, s = side](const Vector3d& p) { return middle + scale * (p - f.origin).dot(s); };
    const auto y = [&](const Vector3d& p) { return kPaneTop + kPane / 2 + scale * (p - f.origin).dot(f.down); };
    std::string outline;
    for (const Vector3d& p : flat) outline += fmt::format("{}{:.1f} {:.1f}", outline.empty() ? "M" : "L", x(p), y(p));
    svg += fmt::format(R"(<path d="{}z" fill="none" stroke="#8a8a8a" stroke-dasharray="5 3"/>)", outline);
    for (const Vector3d& p : moment.points)
      svg += fmt::format(R"(<circle cx="{:.1f}" cy="{:.1f}" r="{}" fill="#1f4e8c"/>)", x(p), y(p),
                         trial.markers ? "3" : "1");
    for (const Vector3d& p : moment.corners)
      svg +=
          fmt::format(R"(<rect class="corner" x="{:.1f}" y="{:.1f}" width="9" height="9"/>)", x(p) - 4.5, y(p) - 4.5);
    svg += fmt::format(R"(<text x="{:.1f}" y="16" text-anchor="middle">{}</text>)", middle, name);
    middle += kPane;
  }
  return svg;
}

// A round length of at most a third of a pane, and gravity.
std::string length_and_gravity(double scale) {
  const double most_m = kPane / 3 / scale, power = std::pow(10, std::floor(std::log10(most_m)));
  const double m = 5 * power <= most_m ? 5 * power : 2 * power <= most_m ? 2 * power : power;
  const double bottom = kPaneTop + kPane, arrow = 2 * kPane - 18, top = kPaneTop + 14;
  return fmt::format(
             R"(<path d="M10 {0:.1f}v6h{1:.1f}v-6" fill="none" stroke="#111"/><text x="10" y="{2:.1f}">{3}</text>)",
             bottom - 4, m * scale, bottom - 10, m < 1 ? short_number(1e3 * m) + " mm" : short_number(m) + " m") +
         fmt::format(R"(<path class="gravity" d="M{0:.1f} {1:.1f}v46m-5 -9l5 9l5 -9" fill="none" stroke="#b3261e" )"
                     R"(stroke-width="2"/><text x="{2:.1f}" y="{3:.1f}" text-anchor="end">gravity</text>)",
                     arrow, top, arrow - 8, top + 26);
}

constexpr std::array<const char*, 3> kMoments = {"First", "Middle", "Last"};

void add_frames_of(report::HtmlReport& html, const Trial& trial) {
  const trial::Frames& frames = *trial.frames;
  if (frames.path.empty()) return;
  std::vector<std::string> pngs, captions;
  for (const size_t i : std::set<size_t>{0, frames.path.size() / 2, frames.path.size() - 1}) {
    pngs.push_back(files::read_whole(frames.path[i]));
    captions.push_back(fmt::format("picture {} at {:.3f} s", frames.number[i], frames.time_s[i]));
  }
  html.heading("First, middle and last picture");
  html.picture_row(pngs, captions);
}

void add_clocks(report::HtmlReport& html, const Trial& trial) {
  std::vector<std::vector<std::string>> rows;
  const auto add = [&](const char* what, std::vector<double> time_s) {
    std::sort(time_s.begin(), time_s.end());
    const trial::Sampling s = trial::sampling(time_s);
    rows.push_back({what, short_number(s.first_s), short_number(s.last_s), short_number(s.rate_hz),
                    std::to_string(s.gaps), short_number(s.longest_gap_s, 3)});
  };
  add("held corners", trial.corners.time_s);
  if (trial.markers) add("markers", trial.markers->time_s);
  if (trial.surface) add("surface", trial.surface->time_s);
  if (trial.frames) add("pictures", trial.frames->time_s);
  if (trial.robot) add("arm", trial.robot->time_s);
  html.heading("Clocks and rates");
  html.table({"what", "from, s", "to, s", "rate, Hz", "gaps", "longest step, s"}, rows);
}

}  // namespace

std::vector<std::string> hanging_pictures(const Trial& trial) {
  if (!trial.markers && !trial.surface) return {};
  const std::vector<double> times = times_of(seen_points(trial));
  if (times.empty()) return {};
  std::vector<HangingMoment> moments;
  for (const double share : {0.0, 0.5, 1.0}) moments.push_back(moment_of(trial, times, share));
  const HangingFrame frame = frame_of(trial, moments.front());
  const double scale = pane_scale(trial, moments, frame);
  std::vector<std::string> out;
  for (const HangingMoment& moment : moments)
    out.push_back(report::open_svg(2 * kPane, kPaneTop + kPane + 8) + views_of(trial, moment, frame, scale) +
                  length_and_gravity(scale) + "</svg>");
  return out;
}

void write_preview(const Trial& trial, const std::filesystem::path& page) {
  report::HtmlReport html("Imported: " + trial.name);
  report::Verdict verdict;
  const std::vector<std::string> doubts = trial::doubts(trial);
  verdict.sentence = doubts.empty() ? "units, axes and clocks look as those of a hung fabric do"
                                    : "units, axes or clocks seem to be taken for others; mend the mapping file";
  for (const std::string& doubt : doubts) verdict.lower(report::Trust::none, doubt);
  html.verdict(verdict);
  const std::vector<std::string> pictures = hanging_pictures(trial);
  if (!pictures.empty()) html.heading("How it hangs");
  for (size_t k = 0; k < pictures.size(); ++k)
    html.svg(pictures[k],
             fmt::format("{} moment: {} (dots) and held corners (squares) from the front and from the side; "
                         "dashed: the flat swatch of {} by {} mm hung from the corners",
                         kMoments[k], trial.markers ? "markers" : "the scanned surface",
                         short_number(1e3 * trial.fabric.width_m), short_number(1e3 * trial.fabric.height_m)));
  if (trial.frames) add_frames_of(html, trial);
  add_clocks(html, trial);
  html.heading("What it holds");
  html.table({"what", "found"}, facts_of(trial));
  html.write(page);
}

}  // namespace selvedge::station
