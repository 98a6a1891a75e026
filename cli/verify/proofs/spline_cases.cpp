#include "cli/verify/proofs/spline_cases.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include <tbb/task_arena.h>

#include "cli/verify/thread_cpu.h"
#include "cloth/spline/chosen_grid.h"
#include "cloth/spline/kernel/tables.h"
#include "cloth/spline/settle.h"
#include "cloth/spline/simulate.h"
#include "fit/stages.h"

namespace selvedge::cli {

namespace {

using cloth::Experiment;
using cloth::Hold;
using cloth::SurfacePoint;
using Eigen::Index;
using Eigen::Matrix3Xd;

constexpr double kSide_m = 0.3, kPull_per_s = 5;
constexpr double kRestChange_m = 2e-6;
constexpr int kMarkers = 25;
constexpr int kFewest = 8;  // cells along the width that a fit begins with
// Cells along the width; where twice the chosen ones are more, the next finer grid is the reference, at the usual step.
constexpr int kMostOfReference = 40;
constexpr double kReferenceStep = 0.5;  // of the usual one
constexpr double kFailed = std::numeric_limits<double>::infinity();

Eigen::Vector2d marker(int k) { return kSide_m * Eigen::Vector2d(0.05 + 0.225 * (k % 5), 0.05 + 0.225 * (k / 5)); }

// 0: the right corner waved by 5 cm at 1.25 Hz, mostly out of the plane; 1: both at 1.1 Hz; 2: an edge, likewise.
Experiment motion_of(const cloth::Material& material, int motion, double duration_s) {
  Experiment e;
  e.material = material;
  const bool edge = motion == 2;
  const double half = edge ? kSide_m / 2 : 0.425 * kSide_m;
  const Index samples = static_cast<Index>(duration_s / 0.005) + 20;
  std::vector<double> time_s;
  Matrix3Xd left(3, samples), right(3, samples);
  for (Index i = 0; i < samples; ++i) {
    const double t = 0.005 * static_cast<double>(i), rise = std::min(1.0, t / 0.3);
    const double swing = 0.05 * std::sin(2 * M_PI * (motion == 0 ? 1.25 : 1.1) * t) * rise * rise * (3 - 2 * rise);
    time_s.push_back(t);
    const Eigen::Vector3d away = motion == 0 ? Eigen::Vector3d(-0.2 * std::abs(swing), 0.9 * swing, 0.3 * swing)
                                             : swing * Eigen::Vector3d(0.6, 0.8, 0);
    left.col(i) = Eigen::Vector3d(-half, 0, 0);
    if (motion != 0) left.col(i) += away;
    right.col(i) = Eigen::Vector3d(half, 0, 0) + away;
  }
  e.path = cloth::make_path(edge ? Hold::top_edge : Hold::corners, time_s, left, right);
  for (double t = 0; t <= duration_s + 1e-9; t += 0.005) e.sample_s.push_back(t);
  return e;
}

// Of all markers at all samples, marker by marker: what a guide reads.
template <class SheetOf>
Matrix3Xd track_of(const SheetOf& sheet, const cloth::Trajectory& t) {
  const auto samples = static_cast<Index>(t.samples.size());
  Matrix3Xd out(3, kMarkers * samples);
  for (int k = 0; k < kMarkers; ++k) {
    const SurfacePoint point = surface_point(sheet, marker(k));
    for (Index s = 0; s < samples; ++s)
      out.col(k * samples + s) = position_of(point, t.samples[static_cast<size_t>(s)]);
  }
  return out;
}

double rms_mm(const Matrix3Xd& a, const Matrix3Xd& b) {
  return 1e3 * std::sqrt((a - b).squaredNorm() / static_cast<double>(a.cols()));
}

std::shared_ptr<cloth::Guide> guide_to(const Matrix3Xd& track, const std::vector<double>& time_s,
                                       std::vector<SurfacePoint> points) {
  auto seen = std::make_shared<cloth::GuideTrack>();
  seen->points = std::move(points);
  seen->time_s = time_s;
  seen->position = track;
  auto guide = std::make_shared<cloth::Guide>();
  guide->track = seen;
  guide->nudging_per_s = kPull_per_s;
  return guide;
}

template <class SheetOf>
std::vector<SurfacePoint> markers_on(const SheetOf& sheet) {
  std::vector<SurfacePoint> points;
  for (int k = 0; k < kMarkers; ++k) points.push_back(surface_point(sheet, marker(k)));
  return points;
}

// A swatch at rest on a grid.
struct Hung {
  cloth::spline::SplineSheet sheet;
  Matrix3Xd rest;
  bool at_rest = false;
};

Hung hang(const Experiment& e, int cells, const Hung* from) {
  namespace spline = cloth::spline;
  const spline::Swatch swatch;
  Hung out{make_spline_sheet(swatch, make_grid(swatch, e.path.hold, swatch.width_m / cells)), {}};
  const Matrix3Xd start = from ? carried_over(from->sheet, from->rest, out.sheet) : hung_shape(out.sheet, e, 1);
  spline::Settled settled = settle(out.sheet, e, start, kRestChange_m);
  out.rest = std::move(settled.position);
  out.at_rest = settled.at_rest;
  return out;
}

// Tracks of the motions from rest, free or with a guide each; empty where one diverged. step_share: of the usual step.
std::vector<Matrix3Xd> tracks_on(const Hung& hung, std::vector<Experiment> motions, double step_share = 1,
                                 const std::vector<Matrix3Xd>& pulled_to = {}) {
  for (size_t i = 0; i < motions.size(); ++i) {
    motions[i].start_shape = hung.rest;
    motions[i].starts_at_rest = false;
    if (!pulled_to.empty()) motions[i].guide = guide_to(pulled_to[i], motions[i].sample_s, markers_on(hung.sheet));
  }
  cloth::spline::Options how;
  how.step_s = step_share * cloth::spline::common_step_s(hung.sheet, motions);
  std::vector<Matrix3Xd> out;
  for (const cloth::Trajectory& t : cloth::spline::simulate(hung.sheet, motions, how)) {
    if (!t.finite) return {};
    out.push_back(track_of(hung.sheet, t));
  }
  return out;
}

// Motions of one fabric held alike: the trials of a campaign.
class Campaign {
 public:
  explicit Campaign(std::vector<Experiment> motions) : motions_(std::move(motions)) {
    model::ObservedTrial trial;
    trial.experiment = motions_.front();
    trial.width_m = kSide_m;
    first_ = std::max(kFewest, model::cells_of_bending_length(trial, {}, {}));
  }

  std::vector<MotionErrors> errors(const std::vector<std::string>& names) {
    double motion_s = 0;
    for (const Experiment& e : motions_) motion_s += e.sample_s.back();
    const cloth::spline::ChosenGrid grid = cloth::spline::choose_grid(
        first_, std::max(first_, fit::most_cells(motion_s)), [&](int cells) { return moved_m(cells); });
    std::vector<Matrix3Xd> free = std::move(here_tracks_);
    const bool twice = 2 * grid.cells <= kMostOfReference;
    if (twice) {
      reference_ = hang(front(), 2 * grid.cells, &*finer_);
      reference_tracks_ = tracks_on(*reference_, motions_, kReferenceStep);
      chosen_ = hang(front(), grid.cells, &*reference_);
      free = tracks_on(*chosen_, motions_);
    } else {
      reference_ = *finer_;
      reference_tracks_ = finer_tracks_;
    }
    MotionErrors failed{"", grid.cells, twice ? 2 * grid.cells : cloth::spline::next_finer(grid.cells),
                        1e3 * grid.finer_moves_m};
    failed.rest_mm = failed.other_rest_mm = failed.free_mm = failed.pulled_mm = kFailed;
    std::vector<MotionErrors> out(motions_.size(), failed);
    const Hung back = hang(front(), failed.reference_cells, &*chosen_);
    std::vector<Matrix3Xd> pulled;
    if (!reference_tracks_.empty()) pulled = tracks_on(*chosen_, motions_, 1, reference_tracks_);
    for (size_t i = 0; i < out.size(); ++i) {
      out[i].motion = names[i];
      if (!reference_->at_rest || !chosen_->at_rest || reference_tracks_.empty()) continue;
      const Matrix3Xd& seen = reference_tracks_[i];
      out[i].rest_mm = rms_mm(marked(*chosen_), marked(*reference_));
      out[i].other_rest_mm = back.at_rest ? rms_mm(marked(back), marked(*reference_)) : kFailed;
      if (!free.empty()) out[i].free_mm = rms_mm(free[i], seen);
      if (!pulled.empty()) out[i].pulled_mm = rms_mm(pulled[i], seen);
      if (twice && !finer_tracks_.empty()) out[i].finer_free_mm = rms_mm(finer_tracks_[i], seen);
    }
    return out;
  }

  const Experiment& front() const { return motions_.front(); }
  const Hung& reference() const { return *reference_; }
  const std::vector<Matrix3Xd>& reference_tracks() const { return reference_tracks_; }
  const Hung& chosen() const { return *chosen_; }

 private:
  // What the next finer grid moves, at rest or in motion, in one fold.
  double moved_m(int cells) {
    here_tracks_.clear();
    finer_tracks_.clear();
    finer_ = hang(front(), cloth::spline::next_finer(cells), finer_ ? &*finer_ : nullptr);
    chosen_ = hang(front(), cells, &*finer_);
    if (!finer_->at_rest || !chosen_->at_rest) return kFailed;
    here_tracks_ = tracks_on(*chosen_, motions_);
    finer_tracks_ = tracks_on(*finer_, motions_);
    if (here_tracks_.empty() || finer_tracks_.empty()) return kFailed;
    double sum = 0;
    for (size_t i = 0; i < here_tracks_.size(); ++i) sum += std::pow(rms_mm(here_tracks_[i], finer_tracks_[i]), 2);
    const double motion_mm = std::sqrt(sum / static_cast<double>(here_tracks_.size()));
    return 1e-3 * std::max(rms_mm(marked(*chosen_), marked(*finer_)), motion_mm);
  }

  static Matrix3Xd marked(const Hung& hung) {
    Matrix3Xd out(3, kMarkers);
    for (int k = 0; k < kMarkers; ++k) out.col(k) = position_of(surface_point(hung.sheet, marker(k)), hung.rest);
    return out;
  }

  std::vector<Experiment> motions_;
  int first_ = 0;
  std::optional<Hung> finer_, chosen_, reference_;
  std::vector<Matrix3Xd> reference_tracks_, here_tracks_, finer_tracks_;
};

double batch_cost(const cloth::spline::SplineSheet& sheet, const Experiment& e) {
  std::vector<Experiment> lanes(static_cast<size_t>(cloth::spline::kernel::most_lanes<float>()), e);
  for (Experiment& lane : lanes) {
    lane.sample_s = {0.1};
    lane.starts_at_rest = false;
  }
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 2; ++k)
    tbb::task_arena(1).execute([&] {
      const double start = thread_cpu_s();
      cloth::spline::simulate(sheet, lanes);
      least = std::min(least, thread_cpu_s() - start);
    });
  return least / 0.1 / static_cast<double>(lanes.size());
}

// Triangles of 33 columns with straight sides, from the equilibrium nearest to the reference's.
void add_triangles(const Campaign& campaign, SplineCase& out) {
  const cloth::Sheet sheet = cloth::make_sheet(geometry::make_grid_mesh(kSide_m, kSide_m, 33, 33));
  out.triangle_columns = 33;
  out.triangles_mm = kFailed;
  if (campaign.reference_tracks().empty()) return;
  const Matrix3Xd& seen = campaign.reference_tracks().front();
  Experiment e = campaign.front();
  e.guide = guide_to(seen, e.sample_s, markers_on(sheet));
  e.start_shape = Matrix3Xd(3, sheet.data.vertex_count);
  for (Index i = 0; i < e.start_shape.cols(); ++i)
    e.start_shape.col(i) =
        position_of(surface_point(campaign.reference().sheet, sheet.mesh.rest_uv[static_cast<size_t>(i)]),
                    campaign.reference().rest);
  tbb::task_arena(1).execute([&] {
    e.start_shape = cloth::relax(sheet, {e})[0].position;
    e.starts_at_rest = false;
    const double start = thread_cpu_s();
    const cloth::Trajectory t = cloth::simulate(sheet, {e})[0];
    out.triangle_cost = (thread_cpu_s() - start) / e.sample_s.back();
    if (t.finite) out.triangles_mm = rms_mm(track_of(sheet, t), seen);
  });
}

}  // namespace

SplineCase run_spline_case(const DrawnFabric& fabric, bool first_alone, double duration_s, bool with_triangles) {
  const auto start = std::chrono::steady_clock::now();
  SplineCase out;
  out.fabric = fabric;
  out.bending_length_m = cloth::spline::bending_length_m(fabric.material);
  std::vector<Experiment> motions = {motion_of(fabric.material, 0, duration_s)};
  if (!first_alone) motions.push_back(motion_of(fabric.material, 1, duration_s));
  Campaign corners(std::move(motions));
  out.motions = corners.errors({"one corner", "both corners"});
  Experiment e = corners.front();
  e.start_shape = corners.chosen().rest;
  out.cost = batch_cost(corners.chosen().sheet, e);
  if (with_triangles) add_triangles(corners, out);
  if (!first_alone) {
    Campaign edge({motion_of(fabric.material, 2, duration_s)});
    out.motions.push_back(edge.errors({"edge held"}).front());
  }
  out.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return out;
}

}  // namespace selvedge::cli
