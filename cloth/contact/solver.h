// Contact of one run, step by step: a kernel::StepFilter with its memory.
//
// Each step, on the velocities that the integrator proposes, from positions that do not intersect:
//   1. repulsion, friction and inelastic impulses of whatever is nearer than the thickness (law.h), body first;
//   2. geometric collisions: pairs that would still meet within the step are found by continuous collision
//      detection and stopped, round by round;
//   3. what some rounds do not settle moves on as rigid zones (zones.h).
// The step then ends without intersecting triangles again. The same input gives the same bits on
// any number of cores.
#pragma once

#include <memory>
#include <vector>

#include "cloth/contact/body.h"
#include "cloth/contact/hierarchy.h"
#include "cloth/contact/law.h"
#include "cloth/contact/pairs.h"
#include "cloth/contact/zones.h"
#include "cloth/kernel/step_filter.h"

namespace selvedge::cloth::contact {

struct Options {
  Law fabric;  // fabric on itself; the thickness is cut to 0.3 of the least height of a triangle
  double body_friction = 0.3;
  bool self_collision = true;
  bool culling = true;     // curvature criterion
  int impact_rounds = 10;  // of geometric impulses, before rigid zones
};

// What the contact of a run did, from its start.
struct Statistics {
  long steps = 0;
  long rebuilds = 0;  // of the list of pairs
  long body_rebuilds = 0;
  long near_pairs = 0;     // looked at, summed over steps
  long impacts = 0;        // geometric collisions stopped
  long zone_steps = 0;     // steps that needed rigid zones
  long unresolved = 0;     // steps after which a pair was left to chance: held vertices that run into each other
  double work_J = 0;       // kinetic energy that impulses gave (negative: took)
  double most_work_J = 0;  // its largest value at any time
  double thickness_m = 0;  // in use
};

class Solver {
 public:
  Solver(const Surface& surface, Body body, const Options& options);
  Solver(const Solver&) = delete;
  Solver& operator=(const Solver&) = delete;

  void apply(const kernel::Step& step);

  const Statistics& statistics() const { return statistics_; }

 private:
  void refresh_lists(double bound_m, double body_bound_m, const BodyStep& body);
  void repel(double step_s, const double* inverse_mass);
  void stop_impacts(double step_s, const double* inverse_mass);
  bool stop_round(double step_s, const double* inverse_mass);
  bool join_zones(double step_s, const double* inverse_mass);
  bool meets(const NearPair& pair, double step_s, double* when) const;
  double work(const Eigen::Matrix3Xd& given, const double* inverse_mass) const;

  Surface surface_;
  Body body_;
  Options options_;
  Hierarchy tree_;
  PairList pairs_;
  BodyContacts body_contacts_;
  Zones zones_;
  Statistics statistics_;
  double reach_m_ = 0;
  double travel_m_ = 0, listed_at_m_ = -1;            // of the fabric (pairs.h)
  double body_travel_m_ = 0, body_listed_at_m_ = -1;  // of fabric and body together
  Eigen::Matrix3Xd position_, velocity_, given_, listed_position_;
  std::vector<NearPair> near_;
};

// A filter with a fresh solver, for Experiment::make_step_filter. statistics: of the latest run where given.
kernel::StepFilter make_filter(const Surface& surface, const Body& body, const Options& options,
                               std::shared_ptr<Statistics> statistics = nullptr);

}  // namespace selvedge::cloth::contact
