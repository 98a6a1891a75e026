#include "hardware_sim/bank/bank_design.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include <nlohmann/json.hpp>

#include "hardware_sim/world/sheet_grip.h"

namespace selvedge::hardware_sim {

namespace {

constexpr double kGravity = 9.81;

// At the 5th, 25th, 50th, 75th and 95th percentile. Of bending lengths the mean of warp and weft.
using Percentiles = std::array<double, 5>;
constexpr Percentiles kDensity = {0.031, 0.104, 0.197, 0.294, 0.488};             // kg/m²
constexpr Percentiles kBendingLength = {0.0103, 0.0151, 0.0186, 0.0229, 0.0298};  // m

// Logarithms straight between percentiles; none beyond the outer ones.
double drawn(const Percentiles& at, std::mt19937_64& g) {
  constexpr Percentiles share = {0.05, 0.25, 0.5, 0.75, 0.95};
  const double p = uniform(g, share.front(), share.back());
  const auto k = static_cast<size_t>(
      std::clamp<std::ptrdiff_t>(std::upper_bound(share.begin(), share.end(), p) - share.begin(), 1, 4));
  const double between = (p - share[k - 1]) / (share[k] - share[k - 1]);
  return at[k - 1] * std::pow(at[k] / at[k - 1], between);
}

const char* to_text(SwatchHold hold) { return hold == SwatchHold::corners ? "corners" : "top_edge"; }

}  // namespace

double uniform(std::mt19937_64& g, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(g);
}

double log_uniform(std::mt19937_64& g, double low, double high) {
  return std::exp(uniform(g, std::log(low), std::log(high)));
}

double bending_length_m(const FabricTruth& truth) { return std::cbrt(truth.bend / (kGravity * truth.density)); }

const std::array<MeasuredStretch, 10>& measured_stretch() {
  static constexpr std::array<MeasuredStretch, 10> ten = {{
      {"denim", 205, 1014, 226, 1052, 10, 53},
      {"ponte roma", 31, 44, 144, 192, 0, 32},
      {"interlock", 17, 34, 127, 406, 0, 37},
      {"rib knit", 43, 65, 106, 255, 0, 83},
      {"sweat", 12, 3, 92, 243, 0, 18},
      {"ribbon", 152, 245, 97, 360, 106, 30},
      {"royal target", 2017, 2035, 2110, 2153, 9, 105},
      {"jet set", 43, 171, 227, 405, 54, 14},
      {"white dots", 2002, 2027, 2107, 2150, 0, 19},
      {"swim solid", 48, 105, 69, 124, 7, 61},
  }};
  return ten;
}

FabricTruth draw_fabric(std::mt19937_64& g) {
  constexpr double kMostStrain = 0.1;
  const FabricTruth usual;
  FabricTruth t;
  t.width_m = t.height_m = kSwatch_m;
  t.density = drawn(kDensity, g);
  t.bend = kGravity * t.density * std::pow(drawn(kBendingLength, g), 3);
  t.bend_damping = usual.bend_damping / usual.bend * t.bend * log_uniform(g, 0.5, 1.5);
  do {
    const auto& ten = measured_stretch();
    const MeasuredStretch& one = ten[std::uniform_int_distribution<size_t>(0, ten.size() - 1)(g)];
    t.stretch = std::sqrt(one.one_way * one.other_way);
    t.shear = one.shear;
  } while (kGravity * t.density * kSwatch_m > kMostStrain * t.stretch);
  t.drag_normal = log_uniform(g, 0.7, 1.3);
  return t;
}

BankDesign usual_design() {
  using trial::Experiment;
  BankDesign design;
  for (const Experiment kind : {Experiment::static_hang, Experiment::static_hang, Experiment::waving,
                                Experiment::waving, Experiment::waving, Experiment::robot, Experiment::robot})
    design.trials.push_back({kind, kind == Experiment::static_hang ? 0.167 : 1.667});
  return design;
}

SwatchHold draw_hold(const FabricTruth& fabric, std::mt19937_64& g) {
  constexpr double kMostStrain = 0.3;
  const bool by_edge = uniform(g, 0, 1) < 1.0 / 3;
  const double at_a_corner = kGravity * fabric.density * kSwatch_m * kSwatch_m / 2 / kGrip_m / fabric.stretch;
  return by_edge || bending_length_m(fabric) < kCornersFrom_m || at_a_corner > kMostStrain ? SwatchHold::top_edge
                                                                                           : SwatchHold::corners;
}

BankDesign draw_design(const FabricTruth& fabric, std::mt19937_64& g) {
  using trial::Experiment;
  constexpr double kStill_s = 0.5;
  BankDesign design;
  design.hold = draw_hold(fabric, g);
  design.dots_across = std::uniform_int_distribution<int>(3, 10)(g);
  design.dots_down = std::uniform_int_distribution<int>(3, 10)(g);
  constexpr double kRates[] = {30, 60, 100, 120, 180, 240};
  design.rate_hz = kRates[std::uniform_int_distribution<size_t>(0, std::size(kRates) - 1)(g)];
  design.noise_m = log_uniform(g, 1e-4, 2e-3);
  const int count = std::uniform_int_distribution<int>(3, 12)(g), still = count < 5 ? 1 : 2, robot = count < 5 ? 0 : 2;
  const double robot_s = log_uniform(g, 1, 10);
  for (int i = 0; i < count; ++i) {
    const double duration_s = log_uniform(g, 1, 10);
    if (i < still) design.trials.push_back({Experiment::static_hang, kStill_s});
    else if (i < count - robot) design.trials.push_back({Experiment::waving, duration_s});
    else design.trials.push_back({Experiment::robot, robot_s});
  }
  return design;
}

nlohmann::json to_json(const BankDesign& design) {
  nlohmann::json trials = nlohmann::json::array();
  for (const BankTrial& t : design.trials) trials.push_back({{"kind", to_text(t.kind)}, {"duration_s", t.duration_s}});
  return {{"hold", to_text(design.hold)}, {"dots_across", design.dots_across}, {"dots_down", design.dots_down},
          {"rate_hz", design.rate_hz},    {"noise_m", design.noise_m},         {"trials", trials}};
}

BankDesign bank_design(const nlohmann::json& json) {
  BankDesign design;
  design.hold = json.at("hold").get<std::string>() == "corners" ? SwatchHold::corners : SwatchHold::top_edge;
  design.dots_across = json.at("dots_across").get<int>();
  design.dots_down = json.at("dots_down").get<int>();
  design.rate_hz = json.at("rate_hz").get<double>();
  design.noise_m = json.at("noise_m").get<double>();
  for (const nlohmann::json& t : json.at("trials")) {
    const auto kind = t.at("kind").get<std::string>();
    design.trials.push_back({kind == "static"   ? trial::Experiment::static_hang
                             : kind == "waving" ? trial::Experiment::waving
                                                : trial::Experiment::robot,
                             t.at("duration_s").get<double>()});
  }
  return design;
}

}  // namespace selvedge::hardware_sim
