#include "hardware_sim/bank/bank_campaign.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>

#include <Eigen/Geometry>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "capture/trial/trial_writer.h"
#include "hardware_sim/hidden_effects/hidden_effect.h"

namespace selvedge::hardware_sim {

namespace {

using Eigen::Vector3d;

const Vector3d kTiltAxis(0.8, 0.6, 0), kDraught(0.35, 0.93, 0);

// What an effect's usual size goes with: so much of it is as plain on every fabric.
enum class GoesWith { nothing, weight, moment, moment_per_curvature, frames };

struct Sizes {
  double low, high;  // drawn on a fabric of 0.17 kg/m² and 6.3e-5 N·m seen at 120 Hz
  GoesWith with = GoesWith::nothing;
};

const std::map<std::string, Sizes>& sizes() {
  static const std::map<std::string, Sizes> all = {
      {"camera_delay", {0.005, 0.014}},                  // s
      {"dropped_frames", {0.3, 0.7, GoesWith::frames}},  // s from one loss to the next
      {"rig_tilt", {0.02, 0.06}},                        // rad
      {"marker_offset", {0.002, 0.006}},                 // m
      {"grip_slip", {0.01, 0.03}},                       // m per m of the grip's path
      {"anisotropy", {0.5, 1.2}},
      {"coupling", {0.3, 0.6}},
      {"stretch_stiffening", {8, 20}},
      {"bend_nonlinearity", {5e-6, 3e-5, GoesWith::moment_per_curvature}},  // N·m
      {"hem", {1, 3}},
      {"rest_curvature", {6e-5, 2e-4, GoesWith::moment}},   // N
      {"bend_friction", {6e-5, 1.6e-4, GoesWith::moment}},  // N
      {"stretch_friction", {0.2, 0.8, GoesWith::weight}},   // N/m
      {"creep", {0.5, 1.5}},
      {"draught", {0.12, 0.3}},                        // m/s
      {"added_mass", {0.03, 0.1, GoesWith::weight}},   // kg/m²
      {"local_mass", {3e-4, 1e-3, GoesWith::weight}},  // kg
  };
  return all;
}

double share_of_usual(GoesWith with, const FabricTruth& truth, const BankDesign& design) {
  FabricTruth usual;
  usual.density = 0.17;
  usual.bend = 6.3e-5;
  const double longer = bending_length_m(truth) / bending_length_m(usual), stiffer = truth.bend / usual.bend;
  switch (with) {
    case GoesWith::weight: return truth.density / usual.density;
    case GoesWith::moment: return stiffer / longer;
    case GoesWith::moment_per_curvature: return stiffer * longer * longer;
    case GoesWith::frames: return 120 / design.rate_hz;
    case GoesWith::nothing: break;
  }
  return 1;
}

// What the rig does unseen.
struct Rig {
  Vector3d left_offset = Vector3d::Zero(), right_offset = Vector3d::Zero();
  double slip = 0;
};

Vector3d direction(std::mt19937_64& g) {
  return Vector3d(uniform(g, -1, 1), uniform(g, -1, 1), uniform(g, -1, 1)).normalized();
}

// Drawn whether used or not, so that every campaign spends its random numbers alike.
Rig draw_rig(const BankKey& key, std::mt19937_64& g) {
  const Vector3d left = direction(g), right = direction(g);
  const double offset_m = key.size_of("marker_offset");
  return {offset_m * left, offset_m * right, key.size_of("grip_slip")};
}

// Those that the sheet itself has.
std::vector<std::pair<std::string, double>> of_the_sheet(const BankKey& key) {
  static const std::vector<std::string> of_the_rig = {"camera_delay",  "dropped_frames", "rig_tilt",
                                                      "marker_offset", "grip_slip",      "draught"};
  std::vector<std::pair<std::string, double>> out;
  for (const BankEffect& e : key.effects)
    if (std::find(of_the_rig.begin(), of_the_rig.end(), e.name) == of_the_rig.end()) out.emplace_back(e.name, e.size);
  if (!key.hidden.empty()) out.emplace_back(key.hidden, key.hidden_size);
  return out;
}

Vector3d gravity_of(const BankKey& key) {
  return Eigen::AngleAxisd(key.size_of("rig_tilt"), kTiltAxis) * Vector3d(0, 0, -9.81);
}

std::unique_ptr<SwatchSheet> sheet_of(const BankKey& key) {
  SwatchOptions options;
  options.hold = key.design.hold;
  options.gravity_m_s2 = gravity_of(key);
  options.air_m_s = key.size_of("draught") * kDraught;
  return make_swatch(key.world, key.truth, options, of_the_sheet(key));
}

std::vector<Eigen::Vector2d> dots_of(const BankDesign& design) {
  std::vector<Eigen::Vector2d> uv;
  for (int r = 0; r < design.dots_down; ++r)
    for (int c = 0; c < design.dots_across; ++c)
      uv.emplace_back(kSwatch_m * (c + 0.5) / design.dots_across, kSwatch_m * (r + 0.5) / design.dots_down);
  return uv;
}

// How late a stamp shows the fabric.
double delay_s(const BankKey& key, double time_s) {
  double delay = key.size_of("camera_delay");
  if (const double every_s = key.size_of("dropped_frames"); every_s > 0)
    delay -= std::floor(time_s / every_s + 0.5) / key.design.rate_hz;
  return delay;
}

// What the rig records of one motion: dots at every sample, and some samples more for late stamps.
std::vector<Eigen::Matrix3Xd> dots_over_time(const BankKey& key, const Rig& rig, const BankMotion& motion, int samples,
                                             const std::string& name) {
  const std::vector<Eigen::Vector2d> uv = dots_of(key.design);
  const std::unique_ptr<SwatchSheet> sheet = sheet_of(key);
  double slipped = 0;  // what the grip has lost so far, along the pull
  Vector3d before = motion.right(0);
  const auto held_right = [&](double t) -> Vector3d {
    const Vector3d tracked = motion.right(t);
    slipped += rig.slip * (tracked - before).norm();
    before = tracked;
    const Vector3d pull = (Vector3d(0, 0, -1) + (motion.left(t) - tracked).normalized()).normalized();
    return tracked + rig.right_offset + slipped * pull;
  };
  const Vector3d left = motion.left(0) + rig.left_offset, right = motion.right(0) + rig.right_offset;
  hang(*sheet, HungCurve(left, right, {0, 1, 0}, gravity_of(key), key.truth.width_m));
  settle(*sheet, left, right);
  std::vector<Eigen::Matrix3Xd> shapes = {sheet->points(uv)};
  for (int i = 1; i < samples; ++i) {
    const double time = i / key.design.rate_hz;
    sheet->advance(1 / key.design.rate_hz, motion.left(time) + rig.left_offset, held_right(time));
    shapes.push_back(sheet->points(uv));
    if (!shapes.back().allFinite())
      throw std::runtime_error(
          fmt::format("the simulated world blew up: {} at {:.3f} s, key {}", name, time, to_json(key).dump()));
  }
  return shapes;
}

trial::Trial record(const BankKey& key, const Rig& rig, const std::string& name, const BankTrial& wanted,
                    const BankMotion& motion, std::mt19937_64& g) {
  const BankDesign& design = key.design;
  const bool still = wanted.kind == trial::Experiment::static_hang;
  const int samples = std::max(2, static_cast<int>(std::lround(wanted.duration_s * design.rate_hz)));
  const double last_s = (samples - 1) / design.rate_hz;
  const int beyond = still ? 0 : 2 + static_cast<int>(std::ceil(std::max(0.0, -delay_s(key, last_s)) * design.rate_hz));
  const std::vector<Eigen::Matrix3Xd> shapes = dots_over_time(key, rig, motion, still ? 1 : samples + beyond, name);

  trial::Trial t;
  t.name = name;
  t.experiment = wanted.kind;
  t.held = design.hold == SwatchHold::corners ? trial::Held::corners : trial::Held::top_edge;
  t.fabric = {"", kSwatch_m, kSwatch_m, key.truth.density * kSwatch_m * kSwatch_m, true};
  t.starts_at_rest = true;
  t.mocap_rate_hz = design.rate_hz;
  t.mocap_noise_m = design.noise_m;
  std::normal_distribution<double> normal(0, design.noise_m);
  const auto noisy = [&](const Vector3d& p) -> Vector3d { return p + Vector3d(normal(g), normal(g), normal(g)); };
  t.corners.left.resize(3, samples);
  t.corners.right.resize(3, samples);
  const std::vector<Eigen::Vector2d> uv = dots_of(design);
  trial::Markers markers;
  markers.position.resize(3, static_cast<Eigen::Index>(static_cast<size_t>(samples) * uv.size()));
  for (int i = 0; i < samples; ++i) {
    const double time = i / design.rate_hz;
    t.corners.time_s.push_back(time);
    t.corners.left.col(i) = noisy(motion.left(time));
    t.corners.right.col(i) = noisy(motion.right(time));
    const double at = still ? 0
                            : std::clamp((time - delay_s(key, time)) * design.rate_hz, 0.0,
                                         static_cast<double>(shapes.size()) - 1.001);
    const auto k = static_cast<size_t>(at);
    const double share = at - static_cast<double>(k);
    const Eigen::Matrix3Xd dots = (1 - share) * shapes[k] + share * shapes[std::min(k + 1, shapes.size() - 1)];
    for (size_t m = 0; m < uv.size(); ++m) {
      markers.position.col(static_cast<Eigen::Index>(markers.time_s.size())) =
          noisy(dots.col(static_cast<Eigen::Index>(m)));
      markers.time_s.push_back(time);
      markers.marker.push_back(static_cast<int>(m));
      markers.uv.push_back(uv[m]);
    }
  }
  t.markers = std::move(markers);
  return t;
}

// Held by the corners the fabric hangs in one shape alone where they are as far apart as this (decision 25); an edge is
// as long as the fabric.
double draw_separation(SwatchHold hold, std::mt19937_64& g) {
  const double apart = uniform(g, 0.281, 0.289);
  return hold == SwatchHold::corners ? apart : kSwatch_m;
}

trial::Campaign recorded(const BankKey& key, const Rig& rig, const std::string& name, std::mt19937_64& g) {
  trial::Campaign campaign;
  campaign.fabric = name;
  std::map<trial::Experiment, int> count;
  std::optional<BankMotion> robot;
  for (const BankTrial& wanted : key.design.trials) {
    BankMotion motion;
    if (wanted.kind == trial::Experiment::static_hang) {
      motion.separation_m = draw_separation(key.design.hold, g);
    } else if (wanted.kind == trial::Experiment::waving) {
      motion = draw_waving(key.design.hold, g);
    } else {
      if (!robot) {
        robot = draw_waving(key.design.hold, g);
        robot->amplitude_m = {0, uniform(g, 0.035, 0.05), 0};
      }
      if (key.design.hold == SwatchHold::corners) robot->separation_m += uniform(g, -5e-4, 5e-4);  // hung afresh
      motion = *robot;
    }
    const std::string trial_name = fmt::format("{}-{}", to_text(wanted.kind), ++count[wanted.kind]);
    campaign.trials.push_back(record(key, rig, trial_name, wanted, motion, g));
    campaign.trials.back().fabric.name = name;
  }
  if (count[trial::Experiment::robot] > 1) campaign.replicates = {{"robot-1", "robot-2"}};
  return campaign;
}

}  // namespace

std::string BankKey::cause() const {
  if (!hidden.empty()) return "unknown";
  std::string out;
  for (const BankEffect& e : effects) out += (out.empty() ? "" : "+") + e.name;
  return out.empty() ? "none" : out;
}

double BankKey::size_of(const std::string& effect) const {
  for (const BankEffect& e : effects)
    if (e.name == effect) return e.size;
  return 0;
}

Vector3d BankMotion::right(double time_s) const {
  const double ramp = std::clamp(time_s / 0.25, 0.0, 1.0), rise = ramp * ramp * (3 - 2 * ramp);
  const double w = 2 * M_PI * frequency_hz * time_s;
  return Vector3d(separation_m / 2, 0, 0) + rise * Vector3d(amplitude_m.x() * std::sin(w),
                                                            amplitude_m.y() * std::sin(w),
                                                            amplitude_m.z() * std::sin(1.6 * w + phase));
}

Vector3d BankMotion::left(double time_s) const {
  return Vector3d(-separation_m / 2, 0, 0) + left_share * (right(time_s) - Vector3d(separation_m / 2, 0, 0));
}

BankMotion draw_waving(SwatchHold hold, std::mt19937_64& g) {
  BankMotion m;
  m.separation_m = draw_separation(hold, g);
  m.amplitude_m = {uniform(g, -0.004, 0.004), uniform(g, 0.03, 0.055), uniform(g, 0.01, 0.03)};
  m.frequency_hz = uniform(g, 0.8, 1.7);
  m.phase = uniform(g, 0, 2);
  const double share = uniform(g, 0.7, 1);
  m.left_share = hold == SwatchHold::corners ? 0 : share;
  return m;
}

const std::vector<std::string>& bank_effects() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> out;
    for (const auto& [name, size] : sizes()) out.push_back(name);
    return out;
  }();
  return names;
}

BankKey draw_key(const std::string& kind, BankWorld world, std::mt19937_64& g) {
  BankKey key;
  key.world = world;
  key.truth = draw_fabric(g);
  key.design = draw_design(key.truth, g);
  const size_t wanted = kind == "known" ? 1 : kind == "set" ? std::uniform_int_distribution<size_t>(2, 3)(g) : 0;
  while (key.effects.size() < wanted) {
    const std::string& name = bank_effects()[std::uniform_int_distribution<size_t>(0, bank_effects().size() - 1)(g)];
    const Sizes& s = sizes().at(name);
    const double size = share_of_usual(s.with, key.truth, key.design) * log_uniform(g, s.low, s.high);
    if (key.size_of(name) == 0) key.effects.push_back({name, size});
  }
  if (kind == "outside") {
    const std::vector<HiddenEffect> all = hidden_effects();
    key.hidden = all[std::uniform_int_distribution<size_t>(0, all.size() - 1)(g)].name;
    key.hidden_size = share_of_usual(GoesWith::weight, key.truth, key.design) * log_uniform(g, 0.6, 1.8);
  }
  key.seed = static_cast<unsigned>(g());
  return key;
}

nlohmann::json to_json(const BankKey& key) {
  nlohmann::json fabric = {{"density", key.truth.density}}, effects = nlohmann::json::array();
  for (const FabricParameter& p : fabric_parameters()) fabric[p.name] = key.truth.*p.member;
  for (const BankEffect& e : key.effects) effects.push_back({{"name", e.name}, {"size", e.size}});
  return {
      {"world", to_text(key.world)},    {"cause", key.cause()}, {"effects", effects}, {"hidden", key.hidden},
      {"hidden_size", key.hidden_size}, {"seed", key.seed},     {"fabric", fabric},   {"design", to_json(key.design)}};
}

BankKey bank_key(const nlohmann::json& json) {
  BankKey key;
  key.world = bank_world(json.at("world").get<std::string>());
  for (const nlohmann::json& e : json.at("effects"))
    key.effects.push_back({e.at("name").get<std::string>(), e.at("size").get<double>()});
  key.hidden = json.at("hidden").get<std::string>();
  key.hidden_size = json.at("hidden_size").get<double>();
  key.seed = json.at("seed").get<unsigned>();
  const nlohmann::json& fabric = json.at("fabric");
  key.truth.width_m = key.truth.height_m = kSwatch_m;
  key.truth.density = fabric.at("density").get<double>();
  for (const FabricParameter& p : fabric_parameters()) key.truth.*p.member = fabric.at(p.name).get<double>();
  key.design = bank_design(json.at("design"));
  return key;
}

std::optional<std::pair<std::string, double>> true_parameter(const BankKey& key) {
  using Named = std::pair<std::string, double>;
  if (key.effects.size() != 1 || !key.hidden.empty()) return {};
  const std::string& cause = key.effects[0].name;
  const double size = key.effects[0].size;
  if (cause == "marker_offset") {
    std::mt19937_64 g(key.seed);
    const Rig rig = draw_rig(key, g);
    Named largest{"", 0};
    for (const auto& [corner, offset] : {std::pair{"left_", rig.left_offset}, {"right_", rig.right_offset}})
      for (int a = 0; a < 3; ++a)
        if (std::abs(offset(a)) > std::abs(largest.second)) largest = {corner + std::string(1, "xyz"[a]), offset(a)};
    return largest;
  }
  const std::map<std::string, Named> same = {
      {"camera_delay", {"delay", size}},
      {"dropped_frames", {"delay_per_second", -1 / (key.design.rate_hz * size)}},
      {"rig_tilt", {"tilt_about_x", kTiltAxis.x() * size}},
      {"grip_slip", {"right_slip_per_path", size}},
      {"draught", {"air_y", kDraught.y() * size}},
      {"anisotropy", {"stretch_anisotropy", 0.5 * std::log1p(size)}},
      {"coupling", {"coupling", size}},
      {"bend_nonlinearity", {"bend_stiffening", size / (100 * key.truth.bend)}},
      {"bend_friction", {"bend_friction", size}},
      {"stretch_friction", {"stretch_friction", size}},
      {"creep", {"creep", size}},
      {"added_mass", {"added_mass", size}},
      {"local_mass", {"local_mass", size}},
  };
  const auto at = same.find(cause);
  return at == same.end() ? std::nullopt : std::optional(at->second);
}

void write_fresh_trials(const BankKey& key, const std::string& name, const std::filesystem::path& folder) {
  constexpr size_t kMost = 7;
  constexpr double kLongest_s = 2;
  std::mt19937_64 as_before(key.seed), g(key.seed ^ 0x5bd1e995ULL);
  const Rig rig = draw_rig(key, as_before);
  BankKey few = key;
  if (few.design.trials.size() > kMost) few.design.trials.resize(kMost);
  for (BankTrial& t : few.design.trials) t.duration_s = std::min(t.duration_s, kLongest_s);
  trial::write_campaign(recorded(few, rig, name, g), folder);
}

void write_bank_campaign(const BankKey& key, const std::string& name, const std::filesystem::path& folder) {
  std::mt19937_64 g(key.seed);
  const Rig rig = draw_rig(key, g);
  trial::write_campaign(recorded(key, rig, name, g), folder);
}

}  // namespace selvedge::hardware_sim
