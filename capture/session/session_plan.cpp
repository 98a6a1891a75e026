#include "capture/session/session_plan.h"

#include "capture/trial/names.h"
#include "files/bad_input.h"
#include "rig/camera/camera.h"

namespace selvedge::session {

namespace {

Eigen::Vector3d vector(rig::Section& keys, const std::string& key, const Eigen::Vector3d& fallback, double most,
                       const std::string& unit) {
  const auto v = keys.numbers(key, std::vector<double>{fallback.x(), fallback.y(), fallback.z()}, 3, -most, most, unit);
  return {v[0], v[1], v[2]};
}

trial::Fabric read_fabric(rig::Section keys) {
  trial::Fabric fabric;
  fabric.name = keys.text("name", std::nullopt);
  fabric.width_m = keys.number("width_m", std::nullopt, 0.01, 5, "m");
  fabric.height_m = keys.number("height_m", std::nullopt, 0.01, 5, "m");
  fabric.mass_kg = keys.number("mass_kg", std::nullopt, 1e-5, 10, "kg");
  fabric.mass_known = keys.flag("mass_known", true);
  keys.finish();
  return fabric;
}

GridPlan read_grid(rig::Section keys) {
  GridPlan grid;
  grid.columns = static_cast<int>(keys.integer("columns", grid.columns, 2, 40));
  grid.rows = static_cast<int>(keys.integer("rows", grid.rows, 2, 40));
  grid.poses = static_cast<int>(keys.integer("poses", grid.poses, 3, 100));
  grid.tracker_noise_m = keys.number("tracker_noise_m", grid.tracker_noise_m, 1e-6, 0.01, "m");
  grid.volume_low_m = vector(keys, "volume_low_m", grid.volume_low_m, 100, "m");
  grid.volume_high_m = vector(keys, "volume_high_m", grid.volume_high_m, 100, "m");
  if ((grid.volume_low_m.array() >= grid.volume_high_m.array()).any())
    refuse(keys.where() + " volume_low_m", "each number must lie below that of volume_high_m");
  keys.finish();
  return grid;
}

TrialPlan read_trial_plan(const std::string& name, rig::Section keys) {
  TrialPlan plan;
  plan.name = name;
  plan.kind = trial::experiment_named(keys.choice("kind", std::nullopt, {"static", "waving", "robot"})).value();
  plan.duration_s = keys.number("duration_s", plan.duration_s, 0.5, 600, "s");
  plan.lead_in_s = keys.number("lead_in_s", plan.lead_in_s, 0.1, 60, "s");
  plan.tail_s = keys.number("tail_s", plan.tail_s, 0, 60, "s");
  plan.attempts = static_cast<int>(keys.integer("attempts", plan.attempts, 1, 20));
  if (plan.kind != trial::Experiment::static_hang) {
    plan.amplitude_m = keys.number("amplitude_m", plan.amplitude_m, 0.001, 1, "m");
    plan.frequency_hz = keys.number("frequency_hz", plan.frequency_hz, 0.05, 10, "Hz");
    if (plan.lead_in_s + plan.tail_s + 0.5 > plan.duration_s)
      refuse(keys.where() + " duration_s", "found {} s, expected at least half a second beyond lead_in_s and tail_s",
             plan.duration_s);
  }
  if (plan.kind == trial::Experiment::robot) {
    plan.ramp_s = keys.number("ramp_s", plan.ramp_s, 0.1, 10, "s");
    plan.direction = vector(keys, "direction", plan.direction, 1e3, "1");
    if (plan.direction.norm() < 1e-9) refuse(keys.where() + " direction", "found a vector without length");
    plan.direction.normalize();
  }
  keys.finish();
  return plan;
}

}  // namespace

SessionPlan read_session_plan(const rig::Configuration& configuration) {
  SessionPlan plan;
  plan.fabric = read_fabric(configuration.section("fabric"));
  plan.grid = read_grid(configuration.section("calibration"));
  rig::Section keys = configuration.section("session");
  plan.stripes.kind = projector::PatternKind::stripes;
  plan.stripes.period_px = keys.number("stripe_period_px", 16, 2, 1000, "px");
  plan.stripes.duty = keys.number("stripe_duty", 0.5, 0.05, 0.95, "1");
  plan.stripes.first_bright_row_px = keys.number("stripe_first_bright_row_px", 0, 0, 1000, "px");
  plan.gravity_m_s2 = vector(keys, "gravity_m_s2", plan.gravity_m_s2, 100, "m/s^2");
  const camera::CameraConfiguration camera = camera::read_configuration(configuration.section("camera"));
  plan.frame_rate_hz = camera.rate_hz;
  plan.exposure_s = camera.exposure_s;
  plan.rest_timeout_s = keys.number("rest_timeout_s", plan.rest_timeout_s, 1, 3600, "s");
  plan.grey_noise_levels = keys.number("grey_noise_levels", plan.grey_noise_levels, 0, 50, "grey levels");
  plan.answer_timeout_s = keys.number("answer_timeout_s", plan.answer_timeout_s, 1, 3600, "s");
  for (const std::string& name : keys.texts("trials", std::nullopt)) {
    if (!trial::is_plain_name(name))
      refuse(keys.where() + " trials", "found \"{}\", expected names of small letters, digits, - and _", name);
    if (!keys.has(name)) refuse(keys.where(), "no section for trial \"{}\"", name);
    plan.trials.push_back(read_trial_plan(name, keys.section(name)));
    if (plan.trials.back().kind == trial::Experiment::robot && !configuration.has("arm"))
      refuse(keys.where() + " trials", "trial \"{}\" needs a section [arm]", name);
  }
  keys.finish();
  return plan;
}

}  // namespace selvedge::session
