// How far a simulated fabric lies from the stripes and the outline that the camera recorded, in mm.
//
// Each labelled stripe edge is a point in space (camera ray meets projector plane). Its residual is the
// simulated surface's depth along that ray less the point's; each outline point's residual is its distance to
// the simulated rim across the outline. Both in mm; sd_mm gives each its standard deviation.
#pragma once

#include <memory>
#include <vector>

#include "capture/trial/trial.h"
#include "geometry/triangle_mesh.h"
#include "observe/marker_track.h"
#include "observe/sensor_model.h"
#include "observe/stripe_observation.h"

namespace selvedge::observe {

struct DepthPoint {
  Eigen::Vector2d pixel;
  double projector_px = 0;       // row of the stripe's border
  double depth_m = 0;            // along the optical axis
  double ray_m_per_depth_m = 1;  // length along the ray for a metre of depth
  double sd_mm = 0;              // along the ray
};

struct OutlinePoint {
  Eigen::Vector2d pixel, normal;
  double mm_per_px = 0;
  double sd_mm = 0;
};

struct StripeFrame {
  double time_s = 0;
  int number = 0;
  size_t index = 0;  // into trial.frames; of a surface its place among the clouds
  std::vector<DepthPoint> depth;
  std::vector<OutlinePoint> outline;
  Eigen::Index points() const { return static_cast<Eigen::Index>(depth.size() + outline.size()); }
};

struct StripeTrack {
  geometry::Projection camera, projector;
  render::StripePattern pattern;
  // Points of a scanned surface (cloud_track.h): there is no projector, and there are no pictures.
  bool of_cloud = false;
  std::vector<StripeFrame> frames;
};

// Where a point was seen, m.
Eigen::Vector3d place_of(const geometry::Projection& camera, const DepthPoint& p);

// A trial's pattern as it is rendered.
render::StripePattern pattern_of(const trial::StripePattern& recorded);

// Throws BadInput where a trial with frames lacks camera, projector or pattern.
void require_optics(const trial::Trial& trial);

// The labelled edges as points in space, each with its deviation along the ray.
std::vector<DepthPoint> depth_points(const StripeObservation& seen, const geometry::Projection& camera,
                                     const geometry::Projection& projector, const render::StripePattern& pattern);

// Reads the frames in the window, thinned to options.rate_hz. Throws BadInput where a trial with frames lacks
// camera, projector or pattern, or where no stripe could be labelled in any frame.
std::shared_ptr<const StripeTrack> track_stripes(const trial::Trial& trial, const ObserveOptions& options, bool still);

double last_time_s(const StripeTrack& track);

// Where the camera's ray to a depth point meets a simulated surface.
struct SurfaceHit {
  int triangle = -1;                                  // of the mesh; -1: the ray misses it
  Eigen::Vector3d weights = Eigen::Vector3d::Zero();  // barycentric
  double off_m = 0;                                   // how much further along the ray it lies than what was seen
};

// One a depth point.
std::vector<SurfaceHit> surface_hits(const StripeTrack& track, const StripeFrame& frame,
                                     const geometry::TriangleMesh& mesh, const Eigen::Matrix3Xd& shape,
                                     const SensorModel& sensor);

// Vertices on the rim of a mesh, in order around it.
std::vector<int> rim_of(const geometry::TriangleMesh& mesh);

// Residuals of one frame: depth points, then outline points. A point that the simulated fabric does not cover counts
// how far beside its rim it lies, at most kMostBesideMm: a fixed number would be a jump in what derivatives are taken
// of. rim: the mesh's.
inline constexpr double kMostBesideMm = 15;
void stripe_residuals(const StripeTrack& track, const StripeFrame& frame, const geometry::TriangleMesh& mesh,
                      const std::vector<int>& rim, const Eigen::Matrix3Xd& shape, const SensorModel& sensor,
                      double* residual_mm);

// Of the residuals of all frames, those of one depth point and of one outline point in each square of a frame, whose
// side is so long on the fabric.
std::vector<bool> one_a_square(const StripeTrack& track, double side_m);

}  // namespace selvedge::observe
