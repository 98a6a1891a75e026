#include "garment/wear.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "cloth/contact/closest.h"
#include "cloth/contact/intersections.h"
#include "cloth/simulate.h"

namespace selvedge::garment {

namespace {

namespace contact = cloth::contact;
using cloth::kernel::Step;

// The held vertices in the frame of the joint that carries them.
class Waistband {
 public:
  Waistband(const Pattern& pattern, const Garment& garment, const Wearer& wearer)
      : motion_(wearer.motion), run_up_s_(wearer.dressing_s),
        joint_(static_cast<size_t>(joint_index(*wearer.motion, pattern.held_by, pattern.where + ": held_by"))),
        held_(garment.held) {
    const Eigen::Isometry3d start = joint_at(-wearer.dressing_s);
    offset_ = start.translation() + pattern.held_above_m * Eigen::Vector3d::UnitZ();
    for (const int v : held_) local_.push_back(start.inverse() * (garment.standing.col(v) + offset_));
  }

  const Eigen::Vector3d& start_offset() const { return offset_; }

  // Moves the held vertices over a step; inverse_mass: theirs become 0.
  void hold(const Step& step, std::vector<double>& inverse_mass) const {
    const Eigen::Isometry3d then = joint_at(step.start_s + step.step_s);
    for (size_t i = 0; i < held_.size(); ++i) {
      const auto at = 3 * static_cast<size_t>(held_[i]);
      const Eigen::Vector3d to = then * local_[i];
      for (size_t a = 0; a < 3; ++a) {
        step.after[at + a] = to(static_cast<Eigen::Index>(a));
        step.velocity[at + a] = (step.after[at + a] - step.before[at + a]) / step.step_s;
      }
      inverse_mass[static_cast<size_t>(held_[i])] = 0;
    }
  }

 private:
  Eigen::Isometry3d joint_at(double time_s) const { return pose_at(*motion_, time_s, run_up_s_)[joint_]; }

  std::shared_ptr<const Motion> motion_;
  double run_up_s_;
  size_t joint_;
  const std::vector<int>& held_;
  std::vector<Eigen::Vector3d> local_;
  Eigen::Vector3d offset_;
};

double largest_strain(const Garment& garment, const Eigen::Matrix3Xd& x) {
  double largest = 0;
  for (const auto& t : garment.sheet.data.triangles) {
    Eigen::Vector3d u = Eigen::Vector3d::Zero(), v = u;
    for (int a = 0; a < 3; ++a) {
      u += t.gradient_u[a] * x.col(t.vertex[a]);
      v += t.gradient_v[a] * x.col(t.vertex[a]);
    }
    largest = std::max({largest, u.norm() - 1, v.norm() - 1});
  }
  return largest;
}

double deepest_in(const std::vector<contact::Capsule>& body, const std::vector<int>& held, const Eigen::Matrix3Xd& x) {
  double deepest = 0;
  for (Eigen::Index v = 0; v < x.cols(); ++v) {
    if (std::binary_search(held.begin(), held.end(), static_cast<int>(v))) continue;
    for (const contact::Capsule& c : body) {
      const Eigen::Vector3d p = x.col(v);
      const double s = contact::closest_of_segments(p, p, c.from, c.to).second;
      deepest = std::max(deepest, c.radius_m - (p - c.from - s * (c.to - c.from)).norm());
    }
  }
  return deepest;
}

cloth::Experiment experiment_of(const Pattern& pattern, const Garment& garment, const Wearer& wearer,
                                const WearOptions& options, const Waistband& waistband, Worn& out) {
  cloth::Experiment e;
  e.material = pattern.fabric;
  e.path = cloth::make_path(cloth::Hold::nothing, {0}, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
  e.starts_at_rest = false;
  e.start_s = -wearer.dressing_s;
  e.start_shape = garment.standing.colwise() + waistband.start_offset();
  const double end_s = std::min(options.duration_s, wearer.motion->duration_s());
  for (int f = 0; f <= end_s * options.frames_per_s + 0.01; ++f) out.time_s.push_back(f / options.frames_per_s);
  e.sample_s = out.time_s;
  out.simulated_s = out.time_s.back() + wearer.dressing_s;

  contact::Options contact_options;
  contact_options.fabric.friction = pattern.friction;
  contact_options.body_friction = pattern.body_friction;
  const contact::Body body = body_of(wearer, pattern.where + ": limbs");
  e.make_step_filter = [&garment, &waistband, &options, &out, body, contact_options, start_s = e.start_s] {
    auto solver = std::make_shared<contact::Solver>(garment.surface, body, contact_options);
    return [&, solver, start_s, next = start_s, inverse_mass = std::vector<double>()](const Step& step) mutable {
      inverse_mass.assign(step.inverse_mass, step.inverse_mass + step.vertex_count);
      waistband.hold(step, inverse_mass);
      solver->apply({step.start_s, step.step_s, step.since_s, step.vertex_count, step.before, step.after, step.velocity,
                     inverse_mass.data()});
      out.contact = solver->statistics();
      if (step.start_s < next) return;
      next += 0.05;
      options.progress((step.start_s - start_s) / out.simulated_s, step.start_s < 0 ? "putting on" : "moving");
    };
  };
  return e;
}

}  // namespace

Worn wear(const Pattern& pattern, const Garment& garment, const Wearer& wearer, const WearOptions& options) {
  Worn out;
  const Waistband waistband(pattern, garment, wearer);
  const cloth::Experiment experiment = experiment_of(pattern, garment, wearer, options, waistband, out);
  const auto start = std::chrono::steady_clock::now();
  cloth::Trajectory trajectory = std::move(cloth::simulate(garment.sheet, {experiment})[0]);
  out.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  out.finite = trajectory.finite;
  out.frames = std::move(trajectory.samples);
  const contact::Body body = body_of(wearer, pattern.where + ": limbs");
  for (size_t f = 0; out.finite && f < out.frames.size(); ++f) {
    out.frames_that_intersect += !contact::intersecting_triangles(garment.surface, out.frames[f]).empty();
    out.largest_strain = std::max(out.largest_strain, largest_strain(garment, out.frames[f]));
    out.deepest_in_body_m =
        std::max(out.deepest_in_body_m, deepest_in(body.capsules_at(out.time_s[f]), garment.held, out.frames[f]));
  }
  return out;
}

}  // namespace selvedge::garment
