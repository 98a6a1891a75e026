#include "station/simulator/check.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>

#include <fmt/format.h>

#include "files/bad_input.h"
#include "station/simulator/foreign_simulator.h"

namespace selvedge::station {

namespace {

using Eigen::Index;
using Eigen::Vector3d;
using Kind = SimulatorFinding::Kind;

constexpr double kSide_m = 0.2, kMass_kg = 0.0064;  // a woven cotton of 160 g/m²
constexpr size_t kAlong = 7;                        // points along each direction
constexpr double kHeld_m = 1e-3;                    // a held point may lie so far from its grip
constexpr double kAtRest_m = 2e-3;                  // what hangs may creep in a second
constexpr double kSame_m = 1e-4;                    // derivatives are differences of runs: what is the same must be
constexpr double kEffect_m = 1e-6;
constexpr double kWave_s = 1, kEnd_s = 2;

// A square by its upper corners or edge; wave_m: how far the right grip goes and comes back.
SimulatorTrial small_case(cloth::Hold hold, double wave_m, const std::vector<double>& time_s) {
  SimulatorTrial out;
  out.width_m = out.height_m = kSide_m;
  out.mass_kg = kMass_kg;
  out.hold = hold;
  out.gravity_m_s2 = Vector3d(0, 0, -9.81);
  out.time_s = time_s;
  for (size_t i = 0; i < kAlong * kAlong; ++i)
    out.points.emplace_back(kSide_m * static_cast<double>(i % kAlong) / (kAlong - 1),
                            kSide_m * static_cast<double>(i / kAlong) / (kAlong - 1));
  const double apart = hold == cloth::Hold::corners ? 0.8 * kSide_m : kSide_m;
  constexpr int kSteps = 120;
  out.left.resize(3, kSteps + 1);
  out.right.resize(3, kSteps + 1);
  for (int k = 0; k <= kSteps; ++k) {
    const double t = kWave_s * k / kSteps;
    out.grip_s.push_back(t);
    out.left.col(k) = Vector3d(-0.5 * apart, 0.1, 1);
    out.right.col(k) = Vector3d(0.5 * apart, 0.1 + 0.5 * wave_m * (1 - std::cos(2 * M_PI * t / kWave_s)), 1);
  }
  return out;
}

std::vector<double> wave_times() {
  std::vector<double> times;
  for (int k = 0; k <= 30; ++k) times.push_back(kWave_s * k / 30);
  return times;
}

Vector3d place_in(const std::vector<double>& numbers, size_t points, size_t time, size_t point) {
  const double* at = numbers.data() + 3 * (time * points + point);
  return {at[0], at[1], at[2]};
}

double furthest_apart_m(const std::vector<double>& a, const std::vector<double>& b) {
  double most = 0;
  for (size_t i = 0; i + 2 < std::min(a.size(), b.size()); i += 3)
    most = std::max(most, Vector3d(a[i] - b[i], a[i + 1] - b[i + 1], a[i + 2] - b[i + 2]).norm());
  return most;
}

class SimulatorCheck {
 public:
  SimulatorCheck(const std::string& command, const SimulatorCheckOptions& options)
      : command_(command), options_(options) {}

  std::vector<SimulatorFinding> all() {
    try {
      first_words();
      hang();
      wave();
      again();
      alone();
      effects();
      shapes();
      beside();
      end();
    } catch (const std::exception& breach) { found(Kind::wrong, "{}", breach.what()); }
    return std::move(findings_);
  }

 private:
  template <class... Arguments>
  void found(Kind kind, fmt::format_string<Arguments...> text, Arguments&&... arguments) {
    findings_.push_back({kind, fmt::format(text, std::forward<Arguments>(arguments)...)});
    options_.tell(findings_.back());
  }

  std::unique_ptr<ForeignProcess> started() const {
    return std::make_unique<ForeignProcess>("simulator", command_, ForeignOptions{options_.log, options_.run_limit_s});
  }

  // Numbers of one run; empty: it diverged, which is told.
  std::vector<double> asked(ForeignProcess& process, const SimulatorTrial& trial, SimulatorRun run,
                            const std::string& what) {
    for (const SimulatorParameter& p : hello_.parameters) run.parameters.try_emplace(p.name, p.usual);
    const auto begin = std::chrono::steady_clock::now();
    ForeignPositions answer = process.run({std::make_shared<const SimulatorTrial>(trial)}, {run}).front();
    took_s_.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    if (!answer.error.empty()) found(Kind::wrong, "{}: it says: {}", what, answer.error);
    return std::move(answer.numbers);
  }
  std::vector<double> asked(const SimulatorTrial& trial, const SimulatorRun& run, const std::string& what) {
    return asked(*process_, trial, run, what);
  }

  void first_words() {
    process_ = started();
    hello_ = process_->hello();
    const auto corners = std::find(hello_.holds.begin(), hello_.holds.end(), cloth::Hold::corners);
    hold_ = corners != hello_.holds.end() ? *corners : hello_.holds.front();
    found(Kind::good, "{}{}: {} parameters, {} runs at once", hello_.name,
          hello_.version.empty() ? "" : " " + hello_.version, hello_.parameters.size(), hello_.at_once);
  }

  void held_points(const SimulatorTrial& trial, const std::vector<double>& numbers, const std::string& what) {
    double left = 0, right = 0;
    const size_t count = trial.points.size();
    for (size_t t = 0; t < trial.time_s.size(); ++t) {
      const auto k = static_cast<Index>(std::lround(trial.time_s[t] / kWave_s * 120));
      left = std::max(left, (place_in(numbers, count, t, 0) - trial.left.col(k)).norm());
      right = std::max(right, (place_in(numbers, count, t, kAlong - 1) - trial.right.col(k)).norm());
    }
    const double most = std::max(left, right);
    if (most > kHeld_m)
      found(Kind::wrong, "{}: held points lie up to {:.1f} mm (left) and {:.1f} mm (right) from their grips", what,
            1e3 * left, 1e3 * right);
    else found(Kind::good, "{}: held points lie within {:.2f} mm of their grips", what, 1e3 * most);
  }

  void hang() {
    const std::string what = fmt::format("a hang by {}", to_text(hold_));
    const SimulatorTrial trial = small_case(hold_, 0, {0, kWave_s});
    hung_ = asked(trial, {}, what);
    if (hung_.empty()) return;
    held_points(trial, hung_, what);
    const size_t count = trial.points.size();
    double below = 0, creeps = 0;
    for (size_t p = count - kAlong; p < count; ++p) below += (1 - place_in(hung_, count, 0, p).z()) / kAlong;
    for (size_t p = 0; p < count; ++p)
      creeps = std::max(creeps, (place_in(hung_, count, 1, p) - place_in(hung_, count, 0, p)).norm());
    const Kind hangs = below > 0.4 * kSide_m && below < 2 * kSide_m ? Kind::good : Kind::wrong;
    found(hangs, "{}: its lower edge hangs {:.0f} mm below its grips, of a height of {:.0f} mm", what, 1e3 * below,
          1e3 * kSide_m);
    found(creeps < kAtRest_m ? Kind::good : Kind::wrong,
          "{}: between time zero and {} s it moves by {:.2f} mm; it is to hang at rest before time zero", what, kWave_s,
          1e3 * creeps);
  }

  void wave() {
    const SimulatorTrial trial = waved();
    wave_ = asked(trial, {}, "a wave");
    if (wave_.empty() || hung_.empty()) return;
    held_points(trial, wave_, "a wave");
    const size_t count = trial.points.size();
    double moves = 0, begins = 0;
    for (size_t p = 0; p < count; ++p) {
      begins = std::max(begins, (place_in(wave_, count, 0, p) - place_in(hung_, count, 0, p)).norm());
      for (size_t t = 0; t < trial.time_s.size(); ++t)
        moves = std::max(moves, (place_in(wave_, count, t, p) - place_in(wave_, count, 0, p)).norm());
    }
    if (begins > kAtRest_m) found(Kind::wrong, "a wave: it begins {:.1f} mm from where it hangs", 1e3 * begins);
    found(moves > 0.01 ? Kind::good : Kind::wrong, "a wave of 40 mm moves it by {:.0f} mm", 1e3 * moves);
    found(Kind::good, "a wave of {} s takes {:.3f} s", kWave_s, took_s_.back());
  }

  void same(double apart_m, const std::string& what) {
    found(apart_m == 0        ? Kind::good
          : apart_m < kSame_m ? Kind::remark
                              : Kind::wrong,
          "{}: {:.3g} mm apart", what, 1e3 * apart_m);
  }

  void again() {
    if (wave_.empty()) return;
    const std::vector<double> twice = asked(waved(), {}, "the same wave again");
    if (!twice.empty()) same(furthest_apart_m(wave_, twice), "the same wave again");
  }

  void alone() {
    if (wave_.empty()) return;
    SimulatorTrial trial = waved();
    const size_t point = kAlong * kAlong / 2 + 1, time = trial.time_s.size() - 1;
    const Vector3d among = place_in(wave_, trial.points.size(), time, point);
    trial.points = {trial.points[point]};
    trial.time_s = {0, trial.time_s[time]};
    const std::vector<double> one = asked(trial, {}, "one point at two times");
    if (!one.empty()) same((place_in(one, 1, 1, 0) - among).norm(), "one point at two times, and among all");
  }

  void effects() {
    if (wave_.empty()) return;
    for (const SimulatorParameter& p : hello_.parameters) {
      const double by = p.logarithmic ? p.usual * 2 : p.usual + 0.2 * (p.upper - p.lower);
      const double less = p.logarithmic ? p.usual / 2 : p.usual - 0.2 * (p.upper - p.lower);
      const double value = by <= p.upper ? by : std::max(less, p.lower);
      SimulatorRun run;
      run.parameters[p.name] = value;
      const std::string what = fmt::format("{} {:.3g} {}", p.name, value, p.unit);
      const std::vector<double> other = asked(waved(), run, what);
      if (other.empty()) continue;
      const double effect = furthest_apart_m(wave_, other);
      found(effect > kEffect_m ? Kind::good : Kind::wrong, "{} instead of {:.3g} moves a wave by {:.2g} mm", what,
            p.usual, 1e3 * effect);
      const size_t first = 3 * kAlong * kAlong;
      const double at_rest =
          furthest_apart_m({wave_.begin(), wave_.begin() + first}, {other.begin(), other.begin() + first});
      if (p.motion_only && at_rest > kSame_m)
        found(Kind::wrong, "{}: it is said to act on motion alone, and moves what hangs by {:.2g} mm", what,
              1e3 * at_rest);
    }
  }

  // Set to where it was in the middle of the wave, it has to begin there.
  void shapes() {
    if (!hello_.start_shape || wave_.empty()) return;
    const SimulatorTrial trial = waved();
    SimulatorRun run;
    run.hangs = false;
    run.start.resize(3, kAlong * kAlong);
    for (size_t p = 0; p < kAlong * kAlong; ++p)
      run.start.col(static_cast<Index>(p)) = place_in(wave_, trial.points.size(), 0, p) + 0.02 * Vector3d::UnitY();
    const ForeignPositions answer =
        process_->run({std::make_shared<const SimulatorTrial>(trial)}, {with_usual(run)}).front();
    if (!answer.error.empty()) return found(Kind::remark, "set to a shape: it says: {}", answer.error);
    double off = 0;  // of the lower half, which no grip holds
    for (size_t p = kAlong * kAlong / 2; p < kAlong * kAlong; ++p)
      off = std::max(
          off, (place_in(answer.numbers, trial.points.size(), 0, p) - run.start.col(static_cast<Index>(p))).norm());
    found(off < kAtRest_m ? Kind::good : Kind::wrong, "set to a shape: it begins {:.2f} mm from it", 1e3 * off);
  }

  void beside() {
    if (hello_.processes == 1 || wave_.empty()) return;
    const std::unique_ptr<ForeignProcess> second = started();
    second->hello();
    const std::vector<double> other = asked(*second, waved(), {}, "a second process");
    if (!other.empty()) same(furthest_apart_m(wave_, other), "the same wave by a second process");
  }

  void end() {
    if (process_->ends_when_told(kEnd_s)) found(Kind::good, "it ends when its standard input is closed");
    else found(Kind::wrong, "it does not end within {} s after its standard input was closed", kEnd_s);
  }

  SimulatorTrial waved() const { return small_case(hold_, 0.04, wave_times()); }
  SimulatorRun with_usual(SimulatorRun run) const {
    for (const SimulatorParameter& p : hello_.parameters) run.parameters.try_emplace(p.name, p.usual);
    return run;
  }

  std::string command_;
  SimulatorCheckOptions options_;
  std::vector<SimulatorFinding> findings_;
  std::unique_ptr<ForeignProcess> process_;
  SimulatorHello hello_;
  cloth::Hold hold_ = cloth::Hold::corners;
  std::vector<double> hung_, wave_;
  std::vector<double> took_s_;
};

}  // namespace

std::vector<SimulatorFinding> check_simulator(const std::string& command, const SimulatorCheckOptions& options) {
  return SimulatorCheck(command, options).all();
}

}  // namespace selvedge::station
