#include "cloth/contact/solver.h"

#include <algorithm>
#include <cmath>

#include "cloth/contact/pair_motion.h"

namespace selvedge::cloth::contact {

namespace {

constexpr double kThicknessShare = 0.3, kReachShare = 0.8;  // of the least height of a triangle
constexpr double kBodyReach_m = 0.01;
constexpr double kHaste = 1.5;  // by which impulses may exceed the fastest vertex before the lists are looked at again

double fastest(const Eigen::Matrix3Xd& velocity, const Eigen::Vector3d& drift) {
  return std::sqrt((velocity.colwise() - drift).colwise().squaredNorm().maxCoeff());
}

}  // namespace

Solver::Solver(const Surface& surface, Body body, const Options& options)
    : surface_(surface), body_(std::move(body)), options_(options), tree_(surface_), pairs_(surface_),
      body_contacts_(surface_, body_), zones_(surface.vertex_count) {
  options_.fabric.thickness_m = std::min(options.fabric.thickness_m, kThicknessShare * surface.least_height_m);
  reach_m_ = std::max(kReachShare * surface.least_height_m, 1.5 * options_.fabric.thickness_m);
  tree_.set_culling(options.culling);
  statistics_.thickness_m = options_.fabric.thickness_m;
}

// Lists that hold whatever can come within the thickness in a step that goes no farther than the bounds.
void Solver::refresh_lists(double bound_m, double body_bound_m, const BodyStep& body) {
  const double thickness = options_.fabric.thickness_m;
  if (options_.self_collision &&
      (listed_at_m_ < 0 || 2 * (travel_m_ + bound_m - listed_at_m_) > reach_m_ - thickness)) {
    listed_position_ = position_;
    tree_.update(listed_position_);
    pairs_.rebuild(tree_, listed_position_, std::max(reach_m_, thickness + 3 * bound_m), travel_m_);
    listed_at_m_ = travel_m_;
    ++statistics_.rebuilds;
  }
  if (body_contacts_.is_there() &&
      (body_listed_at_m_ < 0 || body_travel_m_ + body_bound_m - body_listed_at_m_ > kBodyReach_m)) {
    listed_position_ = position_;
    tree_.update(listed_position_);
    body_contacts_.rebuild(tree_, listed_position_, body, thickness,
                           thickness + std::max(kBodyReach_m, 2 * body_bound_m));
    body_listed_at_m_ = body_travel_m_;
    ++statistics_.body_rebuilds;
  }
}

void Solver::repel(double step_s, const double* inverse_mass) {
  const Law& law = options_.fabric;
  for (const NearPair& pair : near_) {
    const double gap = pair.at.distance;
    const PairMotion motion = motion_of(pair.vertex, pair.at.weight, inverse_mass, velocity_);
    if (gap == 0 || motion.inverse_mass == 0) continue;
    const Eigen::Vector3d normal = pair.at.separation / gap;
    const double least = least_speed(law, step_s, gap);
    if (gap >= law.thickness_m && normal.dot(motion.relative) >= least) continue;
    contact::apply(impulse_of(law, step_s, gap, normal, motion.relative, motion.inverse_mass, least), pair.vertex,
                   pair.at.weight, inverse_mass, velocity_);
  }
}

// Whether the pair comes down to a twentieth of the thickness, or half of its distance, within the step.
bool Solver::meets(const NearPair& pair, double step_s, double* when) const {
  const double least = std::min(0.05 * options_.fabric.thickness_m, 0.5 * pair.at.distance);
  Four displacement = columns(velocity_, pair.vertex);
  for (Eigen::Vector3d& each : displacement) each *= step_s;
  const auto time = time_of_approach(pair.kind, columns(position_, pair.vertex), displacement, pair.at.distance, least);
  if (time) *when = *time;
  return time.has_value();
}

bool Solver::stop_round(double step_s, const double* inverse_mass) {
  bool any = false;
  for (const NearPair& pair : near_) {
    double when = 0;
    if (pair.at.distance == 0 || !meets(pair, step_s, &when)) continue;
    any = true;
    Four then = columns(position_, pair.vertex);
    for (size_t i = 0; i < 4; ++i) then[i] += when * step_s * velocity_.col(pair.vertex[i]);
    const Closest at = closest(pair.kind, then);
    const PairMotion motion = motion_of(pair.vertex, at.weight, inverse_mass, velocity_);
    if (motion.inverse_mass == 0 || at.distance == 0) continue;
    contact::apply(
        stopping_impulse(options_.fabric.friction, at.separation / at.distance, motion.relative, motion.inverse_mass),
        pair.vertex, at.weight, inverse_mass, velocity_);
    ++statistics_.impacts;
  }
  return any;
}

bool Solver::join_zones(double step_s, const double* inverse_mass) {
  zones_.clear();
  const Eigen::Matrix3Xd before_zones = velocity_;
  bool joined = true, any = false;
  while (joined) {
    joined = false;
    for (const NearPair& pair : near_) {
      double when = 0;
      if (pair.at.distance > 0 && meets(pair, step_s, &when)) joined |= zones_.join(pair);
    }
    if (joined) zones_.move_rigidly(step_s, inverse_mass, position_, before_zones, velocity_);
    any |= joined;
  }
  return any;
}

void Solver::stop_impacts(double step_s, const double* inverse_mass) {
  for (int round = 0; round < options_.impact_rounds; ++round)
    if (!stop_round(step_s, inverse_mass)) return;
  if (!join_zones(step_s, inverse_mass)) return;
  ++statistics_.zone_steps;
  for (const NearPair& pair : near_) {
    double when = 0;
    if (pair.at.distance == 0 || !meets(pair, step_s, &when)) continue;
    ++statistics_.unresolved;
    return;
  }
}

double Solver::work(const Eigen::Matrix3Xd& given, const double* inverse_mass) const {
  double sum = 0;
  for (Eigen::Index v = 0; v < velocity_.cols(); ++v)
    if (inverse_mass[v] > 0)
      sum += (velocity_.col(v).squaredNorm() - given.col(v).squaredNorm()) / (2 * inverse_mass[v]);
  return sum;
}

void Solver::apply(const kernel::Step& step) {
  using Map = Eigen::Map<Eigen::Matrix3Xd>;
  const auto n = static_cast<Eigen::Index>(step.vertex_count);
  position_ = Eigen::Map<const Eigen::Matrix3Xd>(step.before, 3, n);
  Map after(step.after, 3, n), velocity(step.velocity, 3, n);
  given_ = (after - position_) / step.step_s;
  if (!given_.allFinite()) return;  // the run has blown up and will be taken again
  velocity_ = given_;
  const Eigen::Vector3d drift = given_.rowwise().mean();
  const BodyStep body = body_contacts_.step(step.start_s, step.step_s);
  const double body_m = BodyContacts::displacement(body, drift * step.step_s);
  double bound = 0;
  for (int attempt = 0; attempt < 4; ++attempt) {
    const double now = step.step_s * fastest(velocity_, drift);
    if (attempt > 0 && now <= bound) break;
    bound = kHaste * now;
    refresh_lists(bound, bound + body_m, body);
    if (attempt == 0)
      body_contacts_.collide({options_.fabric.thickness_m, options_.fabric.rate_1_s, options_.fabric.damping_ratio,
                              options_.body_friction},
                             body, step.step_s, step.inverse_mass, position_, body_travel_m_,
                             body_travel_m_ + bound + body_m, velocity_);
    if (!options_.self_collision) break;
    pairs_.collect(position_, options_.fabric.thickness_m, travel_m_, travel_m_ + bound, near_);
    statistics_.near_pairs += static_cast<long>(near_.size());
    if (attempt == 0) repel(step.step_s, step.inverse_mass);
    stop_impacts(step.step_s, step.inverse_mass);
  }
  const double gone = step.step_s * fastest(velocity_, drift);
  travel_m_ += gone;
  body_travel_m_ += gone + body_m;
  ++statistics_.steps;
  statistics_.work_J += work(given_, step.inverse_mass);
  statistics_.most_work_J = std::max(statistics_.most_work_J, statistics_.work_J);
  after += step.step_s * (velocity_ - given_);  // where nothing changed, the bits stay
  velocity += velocity_ - given_;
}

kernel::StepFilter make_filter(const Surface& surface, const Body& body, const Options& options,
                               std::shared_ptr<Statistics> statistics) {
  auto solver = std::make_shared<Solver>(surface, body, options);
  return [solver, statistics](const kernel::Step& step) {
    solver->apply(step);
    if (statistics) *statistics = solver->statistics();
  };
}

}  // namespace selvedge::cloth::contact
