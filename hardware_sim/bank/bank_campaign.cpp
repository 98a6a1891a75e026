#include "hardware_sim/bank/bank_campaign.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>
#include <tuple>

#include <Eigen/Geometry>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "capture/trial/trial_writer.h"
#include "hardware_sim/bank/fabric_extras.h"
#include "hardware_sim/hidden_effects/hidden_effect.h"

namespace selvedge::hardware_sim {

namespace {

using Eigen::Vector3d;

constexpr double kRate_hz = 120, kDuration_s = 1.667, kNoise_m = 3e-4;
constexpr int kCells = 28;
constexpr double kSide_m = 0.3;
const Vector3d kTiltAxis(0.8, 0.6, 0), kDraught(0.35, 0.93, 0);

// Smallest and largest size drawn of each effect.
const std::map<std::string, std::pair<double, double>>& sizes() {
  static const std::map<std::string, std::pair<double, double>> all = {
      {"camera_delay", {0.005, 0.014}},   // s
      {"dropped_frames", {0.3, 0.7}},     // s from one loss to the next
      {"rig_tilt", {0.02, 0.06}},         // rad
      {"marker_offset", {0.002, 0.006}},  // m
      {"grip_slip", {0.01, 0.03}},        // m per m of the grip's path
      {"anisotropy", {0.5, 1.2}},
      {"coupling", {0.3, 0.6}},
      {"stretch_stiffening", {8, 20}},
      {"bend_nonlinearity", {5e-6, 3e-5}},  // N·m
      {"hem", {1, 3}},
      {"rest_curvature", {6e-5, 2e-4}},   // N
      {"bend_friction", {6e-5, 1.6e-4}},  // N
      {"stretch_friction", {0.2, 0.8}},   // N/m
      {"creep", {0.5, 1.5}},
      {"draught", {0.12, 0.3}},      // m/s
      {"added_mass", {0.03, 0.1}},   // kg/m²
      {"local_mass", {3e-4, 1e-3}},  // kg
  };
  return all;
}

double uniform(std::mt19937_64& g, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(g);
}
double log_uniform(std::mt19937_64& g, double low, double high) {
  return std::exp(uniform(g, std::log(low), std::log(high)));
}

FabricTruth draw_fabric(std::mt19937_64& g) {
  FabricTruth t;
  t.width_m = t.height_m = kSide_m;
  t.density = log_uniform(g, 0.12, 0.24);
  t.stretch = log_uniform(g, 70, 260);
  t.shear = t.stretch * log_uniform(g, 0.35, 0.75);
  t.bend = log_uniform(g, 4e-5, 1e-4);
  t.bend_damping = log_uniform(g, 3e-7, 9e-7);
  t.drag_normal = log_uniform(g, 0.7, 1.3);
  return t;
}

// Where the held corners are: the tracked point plus what the rig does to it unseen.
struct Motion {
  double separation = 0.255;
  Vector3d amplitude = Vector3d::Zero();
  double frequency_hz = 1.2, phase = 0;
  Vector3d left(double) const { return {-separation / 2, 0, 0}; }
  Vector3d right(double t) const {
    const double ramp = std::clamp(t / 0.25, 0.0, 1.0), rise = ramp * ramp * (3 - 2 * ramp);
    const double w = 2 * M_PI * frequency_hz * t;
    return Vector3d(separation / 2, 0, 0) + rise * Vector3d(amplitude.x() * std::sin(w), amplitude.y() * std::sin(w),
                                                            amplitude.z() * std::sin(1.6 * w + phase));
  }
};

// Zero where the key has not this effect.
double size_of(const BankKey& key, const std::string& effect) {
  return key.cause == effect ? key.size : key.second == effect ? key.second_size : 0;
}

struct Rig {
  Vector3d left_offset = Vector3d::Zero(), right_offset = Vector3d::Zero();
  double slip = 0;
};

trial::Trial record(const BankKey& key, const Rig& rig, const std::string& name, trial::Experiment kind,
                    const Motion& motion, std::mt19937_64& g) {
  LatticeOptions options;
  options.cells_across = options.cells_down = kCells;
  Vector3d gravity(0, 0, -9.81);
  gravity = Eigen::AngleAxisd(size_of(key, "rig_tilt"), kTiltAxis) * gravity;
  options.gravity_m_s2 = gravity;
  options.air_m_s = size_of(key, "draught") * kDraught;
  LatticeSheet sheet(key.truth, options);
  if (key.cause == "unknown") {
    for (const HiddenEffect& effect : hidden_effects())
      if (effect.name == key.hidden) sheet.add_extra(effect.make(key.size), effect.step_share);
  } else {
    static const std::vector<std::string> of_the_rig = {"",         "none",          "camera_delay", "dropped_frames",
                                                        "rig_tilt", "marker_offset", "grip_slip",    "draught"};
    for (const std::string& effect : {key.cause, key.second})
      if (std::find(of_the_rig.begin(), of_the_rig.end(), effect) == of_the_rig.end()) {
        const Extra extra = fabric_extra(effect, size_of(key, effect));
        sheet.add_extra(extra.extra, extra.step_share);
      }
  }

  // What a slipping grip has lost so far, along the pull.
  double slipped = 0;
  Vector3d before = motion.right(0);
  const auto held_right = [&](double t) -> Vector3d {
    const Vector3d tracked = motion.right(t);
    slipped += rig.slip * (tracked - before).norm();
    before = tracked;
    const Vector3d pull = (Vector3d(0, 0, -1) + (motion.left(t) - tracked).normalized()).normalized();
    return tracked + rig.right_offset + slipped * pull;
  };
  const Vector3d left = motion.left(0) + rig.left_offset;
  sheet.hang(left, motion.right(0) + rig.right_offset, {0, 1, 0});
  for (double brake : {20.0, 6.0, 3.0}) sheet.advance(0.8, left, motion.right(0) + rig.right_offset, brake);
  sheet.set_velocity(Eigen::Matrix3Xd::Zero(3, sheet.count()));

  trial::Trial t;
  t.name = name;
  t.experiment = kind;
  t.fabric = {"", kSide_m, kSide_m, key.truth.density * kSide_m * kSide_m, true};
  t.starts_at_rest = true;
  t.mocap_rate_hz = kRate_hz;
  t.mocap_noise_m = kNoise_m;
  std::normal_distribution<double> normal(0, kNoise_m);
  const auto noisy = [&](const Vector3d& p) -> Vector3d { return p + Vector3d(normal(g), normal(g), normal(g)); };
  const bool still = kind == trial::Experiment::static_hang;
  const int samples = still ? 20 : static_cast<int>(kDuration_s * kRate_hz);
  t.corners.left.resize(3, samples);
  t.corners.right.resize(3, samples);
  // Positions at every sample and some beyond, so that late stamps have something to show.
  constexpr int kBefore = 4;
  std::vector<Eigen::Matrix3Xd> shapes(kBefore, sheet.position());
  const int beyond = still ? 0 : 8;
  for (int i = 0; i < samples + beyond; ++i) {
    const double time = i / kRate_hz;
    if (i > 0 && !still) sheet.advance(1 / kRate_hz, left, held_right(time));
    shapes.push_back(sheet.position());
    if (!shapes.back().allFinite())
      throw std::runtime_error(
          fmt::format("the simulated world blew up: {} of size {}, {} at {:.3f} s", key.cause, key.size, name, time));
    if (i >= samples) continue;
    t.corners.time_s.push_back(time);
    t.corners.left.col(i) = noisy(motion.left(time));
    t.corners.right.col(i) = noisy(motion.right(time));
  }
  // A stamp of t shows the fabric at t − delay.
  const auto shape_at = [&](double time) -> Eigen::Matrix3Xd {
    const double at = std::clamp(time * kRate_hz + kBefore, 0.0, static_cast<double>(shapes.size()) - 1.001);
    const auto k = static_cast<size_t>(at);
    return (1 - (at - static_cast<double>(k))) * shapes[k] + (at - static_cast<double>(k)) * shapes[k + 1];
  };
  trial::Markers markers;
  std::vector<Vector3d> seen;
  for (int i = 0; i < samples; ++i) {
    const double time = i / kRate_hz;
    double delay = 0;
    if (!still) delay = size_of(key, "camera_delay");
    if (const double every_s = size_of(key, "dropped_frames"); !still && every_s > 0)
      delay -= std::floor(time / every_s + 0.5) / kRate_hz;
    const Eigen::Matrix3Xd shape = shape_at(time - delay);
    for (int k = 0; k < 25; ++k) {
      const double u = 0.1 + 0.2 * (k % 5), v = 0.1 + 0.2 * (k / 5);
      markers.time_s.push_back(time);
      markers.marker.push_back(k);
      markers.uv.emplace_back(u * kSide_m, v * kSide_m);
      seen.push_back(noisy(sheet.point(shape, {u * kSide_m, v * kSide_m})));
    }
  }
  markers.position.resize(3, static_cast<Eigen::Index>(seen.size()));
  for (size_t i = 0; i < seen.size(); ++i) markers.position.col(static_cast<Eigen::Index>(i)) = seen[i];
  t.markers = std::move(markers);
  return t;
}

Vector3d direction(std::mt19937_64& g) {
  return Vector3d(uniform(g, -1, 1), uniform(g, -1, 1), uniform(g, -1, 1)).normalized();
}

}  // namespace

const std::vector<std::string>& bank_effects() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> out;
    for (const auto& [name, size] : sizes()) out.push_back(name);
    return out;
  }();
  return names;
}

BankKey draw_key(const std::string& kind, std::mt19937_64& g) {
  BankKey key;
  key.cause = "none";
  const auto draw_effect = [&] {
    const std::string name = bank_effects()[std::uniform_int_distribution<size_t>(0, bank_effects().size() - 1)(g)];
    const auto [low, high] = sizes().at(name);
    return std::pair{name, log_uniform(g, low, high)};
  };
  if (kind == "known" || kind == "pair") {
    std::tie(key.cause, key.size) = draw_effect();
    while (kind == "pair" && (key.second.empty() || key.second == key.cause))
      std::tie(key.second, key.second_size) = draw_effect();
  } else if (kind == "outside") {
    const std::vector<HiddenEffect> all = hidden_effects();
    key.cause = "unknown";
    key.hidden = all[std::uniform_int_distribution<size_t>(0, all.size() - 1)(g)].name;
    key.size = log_uniform(g, 0.6, 1.8);
  }
  key.truth = draw_fabric(g);
  key.seed = static_cast<unsigned>(g());
  return key;
}

nlohmann::json to_json(const BankKey& key) {
  nlohmann::json fabric = {{"density", key.truth.density}};
  for (const FabricParameter& p : fabric_parameters()) fabric[p.name] = key.truth.*p.member;
  nlohmann::json out = {
      {"cause", key.cause}, {"hidden", key.hidden}, {"size", key.size}, {"seed", key.seed}, {"fabric", fabric}};
  if (key.second.empty()) return out;
  out["cause"] = key.cause + "+" + key.second;
  out["second_size"] = key.second_size;
  return out;
}

BankKey bank_key(const nlohmann::json& json) {
  BankKey key;
  key.cause = json.at("cause").get<std::string>();
  if (const size_t plus = key.cause.find('+'); plus != std::string::npos) {
    key.second = key.cause.substr(plus + 1);
    key.cause.resize(plus);
    key.second_size = json.at("second_size").get<double>();
  }
  key.hidden = json.at("hidden").get<std::string>();
  key.size = json.at("size").get<double>();
  key.seed = json.at("seed").get<unsigned>();
  const nlohmann::json& fabric = json.at("fabric");
  key.truth.width_m = key.truth.height_m = kSide_m;
  key.truth.density = fabric.at("density").get<double>();
  // Keys of earlier banks name those alone that were drawn.
  for (const FabricParameter& p : fabric_parameters()) key.truth.*p.member = fabric.value(p.name, key.truth.*p.member);
  return key;
}

namespace {

// Drawn whether used or not, so that every campaign spends its random numbers alike.
Rig draw_rig(const BankKey& key, std::mt19937_64& g) {
  const Vector3d left = direction(g), right = direction(g);
  const double offset_m = size_of(key, "marker_offset");
  return {offset_m * left, offset_m * right, size_of(key, "grip_slip")};
}

Motion draw_waving(std::mt19937_64& g) {
  Motion m;
  m.separation = uniform(g, 0.25, 0.265);
  m.amplitude = {uniform(g, -0.012, 0.004), uniform(g, 0.03, 0.055), uniform(g, 0.01, 0.03)};
  m.frequency_hz = uniform(g, 0.8, 1.7);
  m.phase = uniform(g, 0, 2);
  return m;
}

trial::Campaign recorded(const BankKey& key, const Rig& rig, const std::string& name, std::mt19937_64& g) {
  trial::Campaign campaign;
  campaign.fabric = name;
  const auto add = [&](const std::string& trial_name, trial::Experiment kind, const Motion& motion) {
    campaign.trials.push_back(record(key, rig, trial_name, kind, motion, g));
  };
  Motion still;
  for (const double separation : {0.262, 0.245}) {
    still.separation = separation + uniform(g, -0.004, 0.004);
    add(separation > 0.25 ? "static-1" : "static-2", trial::Experiment::static_hang, still);
  }
  for (int i = 1; i <= 3; ++i) {
    const Motion motion = draw_waving(g);
    add("waving-" + std::to_string(i), trial::Experiment::waving, motion);
  }
  Motion robot;
  robot.separation = uniform(g, 0.252, 0.262);
  robot.amplitude = {0, uniform(g, 0.035, 0.05), 0};
  robot.frequency_hz = uniform(g, 1.0, 1.4);
  for (const char* trial_name : {"robot-1", "robot-2"}) {
    robot.separation += uniform(g, -5e-4, 5e-4);  // hung afresh
    add(trial_name, trial::Experiment::robot, robot);
  }
  campaign.replicates = {{"robot-1", "robot-2"}};
  return campaign;
}

void write_campaign(trial::Campaign campaign, const std::filesystem::path& folder) {
  for (trial::Trial& t : campaign.trials) {
    t.fabric.name = campaign.fabric;
    trial::write_trial(t, folder / t.name);
  }
  trial::write_campaign_json(campaign, folder);
}

}  // namespace

std::optional<std::pair<std::string, double>> true_parameter(const BankKey& key) {
  using Named = std::pair<std::string, double>;
  if (!key.second.empty()) return {};
  if (key.cause == "marker_offset") {
    std::mt19937_64 g(key.seed);
    const Rig rig = draw_rig(key, g);
    Named largest{"", 0};
    for (const auto& [corner, offset] : {std::pair{"left_", rig.left_offset}, {"right_", rig.right_offset}})
      for (int a = 0; a < 3; ++a)
        if (std::abs(offset(a)) > std::abs(largest.second)) largest = {corner + std::string(1, "xyz"[a]), offset(a)};
    return largest;
  }
  const std::map<std::string, Named> same = {
      {"camera_delay", {"delay", key.size}},
      {"dropped_frames", {"delay_per_second", -1 / (kRate_hz * key.size)}},
      {"rig_tilt", {"tilt_about_x", kTiltAxis.x() * key.size}},
      {"grip_slip", {"right_slip_per_path", key.size}},
      {"draught", {"air_y", kDraught.y() * key.size}},
      {"anisotropy", {"stretch_anisotropy", 0.5 * std::log1p(key.size)}},
      {"coupling", {"coupling", key.size}},
      {"bend_nonlinearity", {"bend_stiffening", key.size / (100 * key.truth.bend)}},
      {"bend_friction", {"bend_friction", key.size}},
      {"stretch_friction", {"stretch_friction", key.size}},
      {"creep", {"creep", key.size}},
      {"added_mass", {"added_mass", key.size}},
      {"local_mass", {"local_mass", key.size}},
  };
  const auto at = same.find(key.cause);
  return at == same.end() ? std::nullopt : std::optional(at->second);
}

void write_fresh_trials(const BankKey& key, const std::string& name, const std::filesystem::path& folder) {
  std::mt19937_64 as_before(key.seed), g(key.seed ^ 0x5bd1e995ULL);
  const Rig rig = draw_rig(key, as_before);
  write_campaign(recorded(key, rig, name, g), folder);
}

void write_bank_campaign(const BankKey& key, const std::string& name, const std::filesystem::path& folder) {
  std::mt19937_64 g(key.seed);
  const Rig rig = draw_rig(key, g);
  write_campaign(recorded(key, rig, name, g), folder);
}

}  // namespace selvedge::hardware_sim
