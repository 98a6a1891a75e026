#include "hardware_sim/sheets/point_line.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace selvedge::hardware_sim {

namespace {

constexpr int kNodes = kDegree + 1;

// Value and first two derivatives at a place of the polynomials that are 1 at one of six nodes and 0 at the others
// (Fornberg 1988).
void polynomial_shares(const double* nodes, double place, double share[3][6]) {
  double c[kNodes][3] = {};
  c[0][0] = 1;
  double c1 = 1, c4 = nodes[0] - place;
  for (int i = 1; i < kNodes; ++i) {
    const int most = std::min(i, 2);
    double c2 = 1;
    const double c5 = c4;
    c4 = nodes[i] - place;
    for (int j = 0; j < i; ++j) {
      const double c3 = nodes[i] - nodes[j];
      c2 *= c3;
      if (j == i - 1) {
        for (int k = most; k >= 1; --k) c[i][k] = c1 * (k * c[i - 1][k - 1] - c5 * c[i - 1][k]) / c2;
        c[i][0] = -c1 * c5 * c[i - 1][0] / c2;
      }
      for (int k = most; k >= 1; --k) c[j][k] = (c4 * c[j][k] - k * c[j][k - 1]) / c3;
      c[j][0] = c4 * c[j][0] / c3;
    }
    c1 = c2;
  }
  for (int d = 0; d < 3; ++d)
    for (int i = 0; i < kNodes; ++i) share[d][i] = c[i][d];
}

void add_row(LineRows& rows, int first, const double* weight, int reach) {
  rows.first.push_back(first);
  for (int k = 0; k < reach; ++k) rows.weight.push_back(static_cast<float>(weight[k]));
  rows.reach = reach;
  ++rows.rows;
}

void add_point(PointLine& line, double place, double weight, const PointLine::Stencil& s) {
  line.point.push_back(place);
  line.point_weight.push_back(weight);
  add_row(line.value, s.first, s.share[0], kNodes);
  add_row(line.slope, s.first, s.share[1], kNodes);
  add_row(line.second, s.first, s.share[2], kNodes);
}

PointLine::Stencil stencil_from(const PointLine& line, int first, double place) {
  PointLine::Stencil s;
  s.first = first;
  polynomial_shares(&line.node[static_cast<size_t>(first)], place, s.share);
  return s;
}

void weigh_nodes(PointLine& line) {
  line.node_weight.assign(line.node.size(), 0.0);
  for (int p = 0; p < line.points(); ++p)
    for (int k = 0; k < kNodes; ++k)
      line.node_weight[static_cast<size_t>(line.value.first[static_cast<size_t>(p)] + k)] +=
          line.point_weight[static_cast<size_t>(p)] *
          static_cast<double>(line.value.weight[static_cast<size_t>(p * kNodes + k)]);
}

// Gauss-Lobatto places on 0 … 1 of degree 5, and their weights.
std::array<std::array<double, kNodes>, 2> lobatto() {
  const double far = std::sqrt((7 + 2 * std::sqrt(7.0)) / 21), near = std::sqrt((7 - 2 * std::sqrt(7.0)) / 21);
  const double wide = (14 - std::sqrt(7.0)) / 60, narrow = (14 + std::sqrt(7.0)) / 60, end = 1.0 / 30;
  return {
      {{0, (1 - far) / 2, (1 - near) / 2, (1 + near) / 2, (1 + far) / 2, 1}, {end, wide, narrow, narrow, wide, end}}};
}

}  // namespace

PointLine::Stencil PointLine::stencil_at(double place) const {
  const auto cell = std::clamp<std::ptrdiff_t>(std::upper_bound(node.begin(), node.end(), place) - node.begin() - 1, 0,
                                               static_cast<std::ptrdiff_t>(first_of_cell.size()) - 1);
  return stencil_from(*this, first_of_cell[static_cast<size_t>(cell)], place);
}

std::vector<double> PointLine::value_at(double place) const {
  const Stencil s = stencil_at(place);
  std::vector<double> out(node.size(), 0.0);
  for (int k = 0; k < kNodes; ++k) out[static_cast<size_t>(s.first + k)] = s.share[0][k];
  return out;
}

PointLine sliding_line(const std::vector<double>& nodes) {
  PointLine line;
  line.node = nodes;
  const int cells = line.nodes() - 1;
  for (int c = 0; c < cells; ++c) line.first_of_cell.push_back(std::clamp(c - 2, 0, line.nodes() - kNodes));
  for (int c = 0; c < cells; ++c) {
    const double from = nodes[static_cast<size_t>(c)], length = nodes[static_cast<size_t>(c) + 1] - from;
    for (const double side : {-1.0, 1.0}) {
      const double place = from + length * 0.5 * (1 + side / std::sqrt(3.0));
      add_point(line, place, 0.5 * length, stencil_from(line, line.first_of_cell[static_cast<size_t>(c)], place));
    }
  }
  for (const double place : nodes) {
    const PointLine::Stencil s = line.stencil_at(place);
    add_row(line.node_slope, s.first, s.share[1], kNodes);
  }
  weigh_nodes(line);
  return line;
}

PointLine element_line(const std::vector<double>& ends) {
  PointLine line;
  const auto [places, weights] = lobatto();
  const auto elements = static_cast<int>(ends.size()) - 1;
  line.node = {ends.front()};
  for (int e = 0; e < elements; ++e) {
    const double from = ends[static_cast<size_t>(e)], length = ends[static_cast<size_t>(e) + 1] - from;
    for (int k = 1; k < kNodes; ++k) {
      line.node.push_back(from + length * places[static_cast<size_t>(k)]);
      line.first_of_cell.push_back(e * kDegree);
    }
  }
  for (int e = 0; e < elements; ++e) {
    const double from = ends[static_cast<size_t>(e)], length = ends[static_cast<size_t>(e) + 1] - from;
    for (size_t k = 0; k < kNodes; ++k) {
      const double place = from + length * places[k];
      add_point(line, place, weights[k] * length, stencil_from(line, e * kDegree, place));
    }
  }
  // At a kink: the polynomials before and behind it.
  constexpr int kBoth = 2 * kDegree + 1;
  for (int e = 0; e + 1 < elements; ++e) {
    const double place = ends[static_cast<size_t>(e) + 1];
    const PointLine::Stencil before = stencil_from(line, e * kDegree, place),
                             behind = stencil_from(line, (e + 1) * kDegree, place);
    double jump[kBoth] = {}, mean[kBoth] = {};
    for (int k = 0; k < kNodes; ++k) {
      jump[k] -= before.share[1][k];
      jump[kDegree + k] += behind.share[1][k];
      mean[k] += 0.5 * before.share[2][k];
      mean[kDegree + k] += 0.5 * behind.share[2][k];
    }
    add_row(line.kink, e * kDegree, jump, kBoth);
    add_row(line.kink_bend, e * kDegree, mean, kBoth);
    line.kink_penalty.push_back(
        2.0 * (kDegree - 1) * (kDegree - 1) /
        std::min(place - ends[static_cast<size_t>(e)], ends[static_cast<size_t>(e) + 2] - place));
  }
  for (int i = 0; i < line.nodes(); ++i) {
    double slope[kBoth] = {};
    const int element = std::min(i / kDegree, elements - 1);
    const bool shared = i % kDegree == 0 && i > 0 && i < line.nodes() - 1;
    const int from = shared ? element - 1 : std::min(element, elements - 2);
    for (int e = shared ? element - 1 : element; e <= element; ++e) {
      const PointLine::Stencil s = stencil_from(line, e * kDegree, line.node[static_cast<size_t>(i)]);
      for (int k = 0; k < kNodes; ++k) slope[(e - from) * kDegree + k] += (shared ? 0.5 : 1) * s.share[1][k];
    }
    add_row(line.node_slope, from * kDegree, slope, kBoth);
  }
  weigh_nodes(line);
  return line;
}

}  // namespace selvedge::hardware_sim
