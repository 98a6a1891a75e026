#include "station/simulator/serve.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <stdexcept>
#include <tuple>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <tbb/parallel_for.h>
#include <unistd.h>

#include "cloth/spline/interpolation.h"
#include "files/bad_input.h"
#include "files/nesting.h"
#include "model/simulator.h"
#include "station/simulator/protocol.h"

namespace selvedge::station {

namespace {

using cloth::spline::SplineSheet;
using Eigen::Index;
using Eigen::Matrix3Xd;
using nlohmann::json;

constexpr double kSamePoint_m = 1e-9;

// A grid and what is asked of it; trials that are alike in these share it, so that their runs go side by side.
struct ServedSheet {
  cloth::spline::Swatch swatch;
  cloth::Hold hold;
  std::vector<Eigen::Vector2d> asked;
  SplineSheet sheet;
  std::shared_ptr<const cloth::spline::Interpolation> through;  // null where `asked` is not the points of the grid
  std::vector<cloth::SurfacePoint> points;
};

// A trial that was told, ready for runs.
struct ServedTrial {
  std::shared_ptr<const ServedSheet> on;
  cloth::Experiment experiment;
};
using ServedTrials = std::map<int, std::shared_ptr<const ServedTrial>>;

struct ServedRun {
  int number = 0;
  std::shared_ptr<const ServedTrial> trial;
  cloth::Experiment experiment;
  std::string error;
  std::vector<double> positions;
};

// Lines of a file, whatever pieces they come in.
class LinesOf {
 public:
  explicit LinesOf(int file) : file_(file) {}
  std::optional<std::string> next() {
    for (size_t looked = 0;;) {
      const size_t end = came_.find('\n', looked);
      if (end != std::string::npos) {
        std::string line = came_.substr(0, end);
        came_.erase(0, end + 1);
        return line;
      }
      looked = came_.size();
      std::array<char, 1 << 16> part;
      const ssize_t count = ::read(file_, part.data(), part.size());
      if (count == 0 || (count < 0 && errno != EINTR)) return std::nullopt;
      if (count > 0) came_.append(part.data(), static_cast<size_t>(count));
    }
  }

 private:
  int file_;
  std::string came_;
};

void write_all(int file, const char* bytes, size_t count) {
  while (count > 0) {
    const ssize_t written = ::write(file, bytes, count);
    if (written < 0 && errno != EINTR) throw std::runtime_error(fmt::format("answers: {}", std::strerror(errno)));
    if (written <= 0) continue;
    bytes += written;
    count -= static_cast<size_t>(written);
  }
}

Matrix3Xd columns_of(const json& rows) {
  Matrix3Xd out(3, static_cast<Index>(rows.size()));
  for (Index i = 0; i < out.cols(); ++i)
    for (Index axis = 0; axis < 3; ++axis)
      out(axis, i) = rows.at(static_cast<size_t>(i)).at(static_cast<size_t>(axis)).get<double>();
  return out;
}

Eigen::Vector3d vector_of(const json& three) { return columns_of(json::array({three})).col(0); }

cloth::Hold hold_of(const std::string& text) {
  for (const cloth::Hold hold : {cloth::Hold::corners, cloth::Hold::top_edge, cloth::Hold::top_edge_clamped})
    if (text == to_text(hold)) return hold;
  refuse("hold", "found {}, expected corners, top_edge or top_edge_clamped", in_quotes(text));
}

// The even grid whose greville_points these are; else one of `cells`.
struct SheetOf {
  SplineSheet sheet;
  bool is_of_points = false;
};
SheetOf sheet_of(const cloth::spline::Swatch& swatch, cloth::Hold hold, const std::vector<Eigen::Vector2d>& points,
                 int cells) {
  const auto made = [&](int count) {
    return make_spline_sheet(swatch, make_grid(swatch, hold, swatch.width_m / count));
  };
  std::set<double> columns;
  for (const Eigen::Vector2d& uv : points) columns.insert(uv.x());
  const int of_points = static_cast<int>(columns.size()) - cloth::spline::kDegree;
  constexpr int kLeast = 4, kMost = 128;
  if (of_points < kLeast || of_points > kMost) return {made(cells), false};
  SplineSheet sheet = made(of_points);
  const std::vector<Eigen::Vector2d> own = greville_points(sheet);
  const bool same = std::equal(own.begin(), own.end(), points.begin(), points.end(),
                               [](const auto& a, const auto& b) { return (a - b).norm() < kSamePoint_m; });
  if (same) return {std::move(sheet), true};
  return {made(cells), false};
}

std::shared_ptr<const ServedSheet> served_sheet(const cloth::spline::Swatch& swatch, cloth::Hold hold,
                                                std::vector<Eigen::Vector2d> asked, int cells,
                                                const ServedTrials& trials) {
  for (const auto& [number, trial] : trials) {
    const ServedSheet& on = *trial->on;
    if (on.swatch.width_m == swatch.width_m && on.swatch.height_m == swatch.height_m && on.hold == hold &&
        on.asked == asked)
      return trial->on;
  }
  SheetOf found = sheet_of(swatch, hold, asked, cells);
  auto out =
      std::make_shared<ServedSheet>(ServedSheet{swatch, hold, std::move(asked), std::move(found.sheet), nullptr, {}});
  if (found.is_of_points)
    out->through = std::make_shared<const cloth::spline::Interpolation>(out->sheet.u.basis, out->sheet.v.basis);
  for (const Eigen::Vector2d& uv : out->asked) {
    cloth::SurfacePoint& point = out->points.emplace_back();
    const cloth::SurfacePoint whole = surface_point(out->sheet, uv);
    for (size_t k = 0; k < whole.vertices.size(); ++k)
      if (whole.weights[k] != 0) {
        point.vertices.push_back(whole.vertices[k]);
        point.weights.push_back(whole.weights[k]);
      }
  }
  return out;
}

std::shared_ptr<const ServedTrial> served_trial(const json& told, int cells, const ServedTrials& trials) {
  auto out = std::make_shared<ServedTrial>();
  cloth::Experiment& e = out->experiment;
  const cloth::spline::Swatch swatch{told.at("width"), told.at("height")};
  e.material.density = told.at("mass").get<double>() / (swatch.width_m * swatch.height_m);
  e.gravity_m_s2 = vector_of(told.at("gravity"));
  e.start_s = told.at("start");
  e.sample_s = told.at("times").get<std::vector<double>>();
  e.path = cloth::make_path(hold_of(told.at("hold")), told.at("grip_times").get<std::vector<double>>(),
                            columns_of(told.at("left")), columns_of(told.at("right")));
  if (told.contains("clamp_direction")) e.path.clamp_direction = vector_of(told.at("clamp_direction")).normalized();
  std::vector<Eigen::Vector2d> points;
  for (const json& uv : told.at("points")) points.emplace_back(uv.at(0).get<double>(), uv.at(1).get<double>());
  out->on = served_sheet(swatch, e.path.hold, std::move(points), cells, trials);
  return out;
}

ServedRun served_run(const json& told, const std::shared_ptr<const ServedTrial>& trial,
                     const std::vector<model::Parameter>& parameters) {
  ServedRun run{told.at("run"), trial, {}, {}, {}};
  model::Prediction prediction;
  prediction.experiment = trial->experiment;
  for (const model::Parameter& p : parameters) p.apply(prediction, told.at("parameters").value(p.name, p.start));
  run.experiment = std::move(prediction.experiment);
  run.experiment.starts_at_rest = told.value("hangs", true);
  if (!told.contains("shape")) {
    run.experiment.start_shape = hung_shape(trial->on->sheet, run.experiment, 1);
  } else if (trial->on->through) {
    run.experiment.start_shape = columns_of(told.at("shape"));
    trial->on->through->solve(run.experiment.start_shape);
  } else {
    run.error = "it begins at a shape where the points are the Greville points of an even grid alone";
  }
  return run;
}

// In doubles: by what floats round off, derivatives of what hardly shows err, and a fit takes other steps than here.
void take_positions(ServedRun& run, const std::vector<Matrix3Xd>& samples) {
  run.positions.resize(3 * run.trial->on->points.size() * samples.size());
  double* at = run.positions.data();
  for (const Matrix3Xd& x : samples)
    for (const cloth::SurfacePoint& point : run.trial->on->points) {
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      for (size_t k = 0; k < point.weights.size(); ++k) sum += point.weights[k] * x.col(point.vertices[k]);
      for (Index axis = 0; axis < 3; ++axis) *at++ = sum(axis);
    }
}

// Runs that go through the simulation side by side: of one sheet, alike in how they begin.
void simulate_alike(const std::vector<ServedRun*>& runs) {
  const SplineSheet& sheet = runs.front()->trial->on->sheet;
  std::vector<cloth::Experiment> lanes;
  for (const ServedRun* run : runs) lanes.push_back(run->experiment);
  std::vector<cloth::Trajectory> trajectories;
  if (lanes.front().sample_s.size() == 1 && lanes.front().starts_at_rest) {
    for (const cloth::Rest& rest : relax(sheet, lanes))
      trajectories.push_back({{rest.position}, rest.position, rest.at_rest, rest.position.allFinite()});
  } else {
    trajectories = simulate(sheet, lanes);
  }
  tbb::parallel_for(size_t{0}, runs.size(), [&](size_t i) {
    const std::vector<Matrix3Xd>& samples = trajectories[i].samples;
    if (!trajectories[i].finite) runs[i]->error = "diverged";
    else take_positions(*runs[i], samples);
  });
}

void simulate_all(std::vector<ServedRun>& runs) {
  using Alike = std::tuple<const ServedSheet*, bool, bool>;
  std::map<Alike, std::vector<ServedRun*>> groups;
  for (ServedRun& run : runs)
    if (run.error.empty())
      groups[{run.trial->on.get(), run.experiment.starts_at_rest, run.experiment.sample_s.size() == 1}].push_back(&run);
  for (const auto& [alike, group] : groups) simulate_alike(group);
}

void answer(int out, const ServedRun& run) {
  json head = {{"run", run.number}};
  if (!run.error.empty()) head["error"] = run.error;
  else head["doubles"] = run.positions.size();
  const std::string text = head.dump() + '\n';
  write_all(out, text.data(), text.size());
  if (!run.error.empty()) return;
  write_all(out, reinterpret_cast<const char*>(run.positions.data()), sizeof(double) * run.positions.size());
}

SimulatorHello own_hello(const std::vector<model::Parameter>& parameters, model::Drag drag) {
  SimulatorHello hello;
  hello.name = fmt::format("selvedge, {}", model::to_text(drag));
  for (const model::Parameter& p : parameters)
    hello.parameters.push_back({p.name, p.unit, p.start, p.lower, p.upper, p.logarithmic, !p.at_rest, p.tried});
  hello.holds = {cloth::Hold::corners, cloth::Hold::top_edge, cloth::Hold::top_edge_clamped};
  hello.start_shape = true;
  hello.at_once = 64;
  hello.processes = 1;  // it has threads of its own
  return hello;
}

}  // namespace

void serve_simulator(int in, int out, const ServeOptions& options) {
  const std::vector<model::Parameter> parameters = model::base_parameters(options.drag);
  const std::string hello = hello_line(own_hello(parameters, options.drag)) + '\n';
  write_all(out, hello.data(), hello.size());
  LinesOf lines(in);
  ServedTrials trials;
  std::vector<ServedRun> runs;
  int number = 0;
  while (const std::optional<std::string> line = lines.next()) {
    ++number;
    try {
      files::refuse_deep_json(*line, "told");
      const json told = json::parse(*line);
      if (told.at("do") == "trial") {
        trials[told.at("trial").get<int>()] = served_trial(told, options.cells, trials);
        continue;
      }
      if (told.at("do") != "run") refuse("do", "found {}, expected trial or run", told.at("do").dump());
      runs.push_back(served_run(told, trials.at(told.at("trial").get<int>()), parameters));
      if (told.value("more", false)) continue;
    } catch (const std::exception& error) {
      refuse(fmt::format("standard input, line {}", number), "expected simulator/1, found {}: {}", in_quotes(*line),
             error.what());
    }
    simulate_all(runs);
    for (const ServedRun& run : runs) answer(out, run);
    runs.clear();
  }
}

}  // namespace selvedge::station
