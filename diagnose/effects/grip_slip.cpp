#include "diagnose/effects/effect.h"

namespace selvedge::diagnose::effects {

// The fabric creeps out of a grip while it is shaken: its corner leaves the marker along the pull, halfway between
// gravity and the other corner, in proportion to the path that the grip has travelled.
namespace {

void slip(cloth::HeldPath& path, Eigen::Matrix3Xd cloth::HeldPath::*corner, Eigen::Matrix3Xd cloth::HeldPath::*slope,
          const Eigen::Matrix3Xd& other, const Eigen::Vector3d& down, double slip_per_path) {
  if (slip_per_path == 0) return;
  Eigen::Matrix3Xd& x = path.*corner;
  double travelled = 0;
  Eigen::Vector3d before = x.col(0);
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    const Eigen::Vector3d now = x.col(i);
    const double way = (now - before).norm();
    travelled += way;
    before = now;
    const Eigen::Vector3d pull = (down + (other.col(i) - now).normalized()).normalized();
    x.col(i) += slip_per_path * travelled * pull;
    if (i > 0 && path.time_s.size() > 1)
      (path.*slope).col(i) +=
          slip_per_path * way / (path.time_s[static_cast<size_t>(i)] - path.time_s[static_cast<size_t>(i) - 1]) * pull;
  }
}

}  // namespace

Effect grip_slip() {
  using Path = cloth::HeldPath;
  const auto both = [](model::Prediction& p, double v, bool left) {
    const Eigen::Vector3d down = p.experiment.gravity_m_s2.normalized();
    if (left) slip(p.experiment.path, &Path::left, &Path::left_slope, p.experiment.path.right, down, v);
    else slip(p.experiment.path, &Path::right, &Path::right_slope, p.experiment.path.left, down, v);
  };
  return {"grip_slip",
          Side::boundary,
          "the fabric slides out of the grips as they move",
          {effect_parameter("left_slip_per_path", "m/m", 0, 0, 0.2, 0.01,
                            [both](model::Prediction& p, double v) { both(p, v, true); }),
           effect_parameter("right_slip_per_path", "m/m", 0, 0, 0.2, 0.01,
                            [both](model::Prediction& p, double v) { both(p, v, false); })}};
}

}  // namespace selvedge::diagnose::effects
