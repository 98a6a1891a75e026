#include "diagnose/where.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "diagnose/group_statistics.h"
#include "observe/stripe_residual.h"
#include "geometry/projection.h"

namespace selvedge::diagnose {

using Eigen::Index;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

struct Sum {
  double square = 0, noise = 0, count = 0;
  void add(double mm2, double noise2) {
    square += mm2;
    noise += noise2;
    ++count;
  }
};
// (axis, cell) → one sum a group.
using Table = std::map<std::string, std::map<std::string, std::vector<Sum>>>;

struct Look {
  const Study& study;
  double noise_mm;
  size_t groups;
  Table table;

  void add(const std::string& axis, const std::string& cell, size_t group, double mm2, double noise2) {
    auto& sums = table[axis][cell];
    sums.resize(groups);
    sums[group].add(mm2, noise2);
  }
};

std::string region(const Eigen::Vector2d& uv, double width_m, double height_m) {
  static const char* rows[] = {"top", "middle", "bottom"};
  static const char* columns[] = {"left", "centre", "right"};
  const auto third = [](double x, double size) { return std::clamp(static_cast<int>(3 * x / size), 0, 2); };
  return fmt::format("{} {}", rows[third(uv.y(), height_m)], columns[third(uv.x(), width_m)]);
}

std::string quarter(double t, double begin, double end) {
  static const char* names[] = {"first quarter", "second quarter", "third quarter", "last quarter"};
  return names[std::clamp(static_cast<int>(4 * (t - begin) / std::max(end - begin, 1e-9)), 0, 3)];
}

std::string regime(const model::ObservedTrial& trial, double t, double fast_share) {
  if (trial.still) return "static";
  if (trial.kind == trial::Experiment::robot) return "robot";
  double top = 0;
  for (const double s : trial.experiment.path.time_s)
    top = std::max(top, trial.experiment.path.velocity_at(s).colwise().norm().maxCoeff());
  return trial.experiment.path.velocity_at(t).colwise().norm().maxCoeff() > fast_share * top ? "fast" : "slow";
}

std::string image_third(double row_px, double height_px) {
  static const char* names[] = {"upper rows", "middle rows", "lower rows"};
  return names[std::clamp(static_cast<int>(3 * row_px / height_px), 0, 2)];
}

// Amplitudes of one evenly sampled trace: mean square at each frequency.
std::vector<double> spectrum(const std::vector<double>& trace) {
  const size_t n = trace.size();
  std::vector<double> power(n / 2 + 1, 0.0);
  for (size_t k = 0; k < power.size(); ++k) {
    double re = 0, im = 0;
    for (size_t j = 0; j < n; ++j) {
      const double a = 2 * M_PI * static_cast<double>(k * j % n) / static_cast<double>(n);
      re += trace[j] * std::cos(a);
      im += trace[j] * std::sin(a);
    }
    power[k] = (k == 0 || 2 * k == n ? 1 : 2) * (re * re + im * im) / static_cast<double>(n * n);
  }
  return power;
}

struct Bands {
  std::map<int, std::pair<double, double>> power;  // Hz, rounded → sum, count
};

const char* band(double hz) { return hz < 2 ? "below 2 Hz" : hz < 5 ? "2 to 5 Hz" : "above 5 Hz"; }

void look_at_markers(Look& look, ResidualMap& map, const VectorXd& residual_mm, size_t group, size_t trial,
                     Bands& bands, std::map<int, Sum>& rows, std::map<std::pair<double, double>, Sum>& spots) {
  const model::ObservedTrial& t = look.study.simulation->trials()[trial];
  const observe::MarkerTrack& m = *t.markers;
  const auto times = static_cast<Index>(m.time_s.size());
  const double noise2 = look.noise_mm * look.noise_mm;
  std::vector<Sum> at_time(m.time_s.size());
  const auto& camera = look.study.cameras[trial];
  for (size_t k = 0; k < m.uv.size(); ++k) {
    std::vector<double> trace[3];
    for (Index j = 0; j < times; ++j) {
      const Index column = static_cast<Index>(k) * times + j, row = 3 * column;
      Vector3d d = Vector3d::Zero();
      const bool is_seen = residual_mm.segment<3>(row).allFinite();
      if (is_seen) d = residual_mm.segment<3>(row);
      for (int a = 0; a < 3; ++a) trace[a].push_back(d(a));
      if (!is_seen) continue;
      const double time = m.time_s[static_cast<size_t>(j)], mm2 = d.squaredNorm();
      look.add("region", region(m.uv[k], t.width_m, t.height_m), group, mm2, noise2);
      look.add("regime", regime(t, time, look.study.protocol.fast_share), group, mm2, noise2);
      if (!t.still) look.add("time", quarter(time, m.time_s.front(), m.time_s.back()), group, mm2, noise2);
      at_time[static_cast<size_t>(j)].add(mm2, noise2);
      spots[{m.uv[k].x(), m.uv[k].y()}].add(mm2, noise2);
      if (camera) {
        const double px = geometry::project(*camera, m.position.col(column)).y();
        look.add("image", image_third(px, camera->height_px), group, mm2, noise2);
        rows[static_cast<int>(px / 40)].add(mm2, noise2);
      }
    }
    if (t.still || times < 16) continue;
    const double step = (m.time_s.back() - m.time_s.front()) / static_cast<double>(times - 1);
    for (const std::vector<double>& axis : trace) {
      const std::vector<double> power = spectrum(axis);
      const double noise = noise2 / 3 / static_cast<double>(power.size());
      for (size_t i = 0; i < power.size(); ++i) {
        const double hz = static_cast<double>(i) / (step * static_cast<double>(times));
        look.add("frequency", band(hz), group, power[i], noise);
        auto& [sum, count] = bands.power[static_cast<int>(std::lround(hz))];
        sum += power[i];
        count += 1;
      }
    }
  }
  ResidualMap::OverTime over{t.name, {}, {}};
  for (size_t j = 0; j < at_time.size(); ++j)
    if (at_time[j].count > 0) {
      over.time_s.push_back(m.time_s[j]);
      over.mm.push_back(std::sqrt(at_time[j].square / at_time[j].count));
    }
  if (!t.still) map.over_time.push_back(over);
}

void look_at_stripes(Look& look, ResidualMap& map, const VectorXd& residual_mm, size_t group, size_t trial,
                     SpotsSeen seen, std::map<int, Sum>& rows, std::map<std::pair<double, double>, Sum>& spots) {
  constexpr double kSpotsAcross = 6;  // of the map
  const model::ObservedTrial& t = look.study.simulation->trials()[trial];
  Index row = 0;
  const double noise2 = look.noise_mm * look.noise_mm;
  ResidualMap::OverTime over{t.name, {}, {}};
  for (const observe::StripeFrame& f : t.stripes->frames) {
    Sum here;
    if (seen.finite()) seen.at_time(f.time_s);
    const auto point = [&](const auto& p) {
      const Eigen::Vector2d& pixel = p.pixel;
      const double mm = residual_mm(row++), mm2 = mm * mm;
      if (!std::isfinite(mm)) return;
      look.add("regime", regime(t, f.time_s, look.study.protocol.fast_share), group, mm2, noise2);
      if (!t.still)
        look.add("time", quarter(f.time_s, t.stripes->frames.front().time_s, t.stripes->frames.back().time_s), group,
                 mm2, noise2);
      look.add("image", image_third(pixel.y(), t.stripes->camera.height_px), group, mm2, noise2);
      rows[static_cast<int>(pixel.y() / 40)].add(mm2, noise2);
      here.add(mm2, noise2);
      if (!seen.finite()) return;
      const Eigen::Vector2d uv = seen.uv(p);
      look.add("region", region(uv, t.width_m, t.height_m), group, mm2, noise2);
      const auto middle = [&](double x, double size) {
        return (std::min(std::floor(kSpotsAcross * x / size), kSpotsAcross - 1) + 0.5) * size / kSpotsAcross;
      };
      spots[{middle(uv.x(), t.width_m), middle(uv.y(), t.height_m)}].add(mm2, noise2);
    };
    for (const observe::DepthPoint& p : f.depth) point(p);
    for (const observe::OutlinePoint& p : f.outline) point(p);
    if (here.count > 0) {
      over.time_s.push_back(f.time_s);
      over.mm.push_back(std::sqrt(here.square / here.count));
    }
  }
  if (!t.still) map.over_time.push_back(over);
}

// One-sided: the cell's mean square exceeds the rest's, group after group.
double p_of(const std::vector<Sum>& cell, const std::map<std::string, std::vector<Sum>>& axis) {
  std::vector<double> difference;
  for (size_t g = 0; g < cell.size(); ++g) {
    if (cell[g].count == 0) continue;
    Sum rest;
    for (const auto& [name, sums] : axis)
      if (&sums != &cell && g < sums.size()) {
        rest.square += sums[g].square;
        rest.count += sums[g].count;
      }
    if (rest.count == 0 || rest.square <= 0 || cell[g].square <= 0) continue;
    difference.push_back(std::log(cell[g].square / cell[g].count) - std::log(rest.square / rest.count));
  }
  return p_above_zero(difference);
}

void correct(std::vector<Cell>& cells) {
  std::vector<size_t> order(cells.size());
  for (size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(), [&](size_t a, size_t b) { return cells[a].p_value < cells[b].p_value; });
  double least = 0;
  for (size_t i = 0; i < order.size(); ++i) {
    least = std::max(least, std::min(1.0, cells[order[i]].p_value * static_cast<double>(order.size() - i)));
    cells[order[i]].p_value = least;
  }
}

std::vector<Cell> cells_of(const Table& table) {
  std::vector<Cell> cells;
  for (const auto& [axis, by_cell] : table) {
    double total = 0;
    for (const auto& [name, sums] : by_cell)
      for (const Sum& s : sums) total += std::max(0.0, s.square - s.noise);
    for (const auto& [name, sums] : by_cell) {
      Sum all;
      double excess = 0;
      for (const Sum& s : sums) {
        all.square += s.square;
        all.count += s.count;
        excess += std::max(0.0, s.square - s.noise);
      }
      if (all.count == 0) continue;
      // A frequency band's mean square adds up over its bins, it is no mean of them.
      cells.push_back(
          {axis, name, total > 0 ? excess / total : 0, std::sqrt(all.square / all.count), p_of(sums, by_cell)});
    }
  }
  correct(cells);
  std::stable_sort(cells.begin(), cells.end(),
                   [](const Cell& a, const Cell& b) { return a.axis == b.axis ? a.share > b.share : a.axis < b.axis; });
  return cells;
}

}  // namespace

Where split_residual(const Study& study, const std::vector<SpotsSeen>& seen, const std::vector<VectorXd>& residual_mm,
                     double noise_mm) {
  Where out;
  Look look{study, noise_mm, study.groups.size(), {}};
  Bands bands;
  std::map<int, Sum> rows;
  std::map<std::pair<double, double>, Sum> spots;
  out.map.width_m = study.simulation->trials()[0].width_m;
  out.map.height_m = study.simulation->trials()[0].height_m;
  for (const model::ObservedTrial& t : study.simulation->trials())
    if (const cloth::Hold hold = t.experiment.path.hold;
        std::find(out.map.held.begin(), out.map.held.end(), hold) == out.map.held.end())
      out.map.held.push_back(hold);
  for (size_t g = 0; g < study.groups.size(); ++g)
    for (const size_t trial : study.groups[g]) {
      if (study.simulation->trials()[trial].markers)
        look_at_markers(look, out.map, residual_mm[trial], g, trial, bands, rows, spots);
      else look_at_stripes(look, out.map, residual_mm[trial], g, trial, seen[trial], rows, spots);
    }
  out.cells = cells_of(look.table);
  for (const auto& [uv, sum] : spots) {
    out.map.uv.emplace_back(uv.first, uv.second);
    out.map.at_mm.push_back(std::sqrt(sum.square / sum.count));
  }
  for (const auto& [hz, power] : bands.power) {
    out.map.frequency_hz.push_back(hz);
    out.map.frequency_mm.push_back(std::sqrt(3 * power.first / power.second));
  }
  for (const auto& [row, sum] : rows) {
    out.map.image_row_px.push_back(40 * row + 20);
    out.map.image_mm.push_back(std::sqrt(sum.square / sum.count));
  }
  return out;
}

}  // namespace selvedge::diagnose
