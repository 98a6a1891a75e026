// Which projector row each stripe edge is: linking edges into curves, counting from curve to curve, and tying
// the count to the held corners.
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include <Eigen/Dense>

#include "observe/stripe_observation.h"

namespace selvedge::observe {

namespace {

constexpr double kCornerReachPx = 40;    // edges that tell the row at a corner
constexpr double kCornerWeightPx = 15;   // their weight falls off with this distance
constexpr double kLeastAgreement = 0.3;  // of a period: how far the counted row may be from the corner's

double along(const StripeObservation& o, const StripeEdge& e) { return o.scans_columns ? e.pixel.y() : e.pixel.x(); }
int line_of(const StripeObservation& o, const StripeEdge& e) {
  return int(std::lround(o.scans_columns ? e.pixel.x() : e.pixel.y()));
}

// Index ranges of `edges` that lie on one scan line each.
std::vector<std::pair<size_t, size_t>> lines(const StripeObservation& o) {
  std::vector<std::pair<size_t, size_t>> ranges;
  for (size_t i = 0; i < o.edges.size(); ++i) {
    if (i == 0 || line_of(o, o.edges[i]) != line_of(o, o.edges[i - 1])) ranges.push_back({i, i});
    ranges.back().second = i + 1;
  }
  return ranges;
}

// The edge of `range` with the same polarity that is nearest to `position`; range.second where there is none.
size_t nearest(const StripeObservation& o, std::pair<size_t, size_t> range, bool rising, double position) {
  size_t best = range.second;
  double distance = 1e9;
  for (size_t i = range.first; i < range.second; ++i) {
    const double d = std::abs(along(o, o.edges[i]) - position);
    if (o.edges[i].rising == rising && d < distance) {
      best = i;
      distance = d;
    }
  }
  return best;
}

// Curve `b` follows curve `a` towards growing projector row, as seen on `votes` scan lines.
struct Link {
  int a, b, votes;
};

std::vector<Link> curve_links(const StripeObservation& o) {
  std::map<std::pair<int, int>, int> votes;
  for (size_t i = 0; i + 1 < o.edges.size(); ++i) {
    const StripeEdge& a = o.edges[i];
    const StripeEdge& b = o.edges[i + 1];
    if (line_of(o, a) != line_of(o, b) || a.run != b.run || a.rising == b.rising) continue;
    ++votes[o.scan_sign > 0 ? std::pair(a.curve, b.curve) : std::pair(b.curve, a.curve)];
  }
  std::vector<Link> links;
  for (const auto& [pair, count] : votes) links.push_back({pair.first, pair.second, count});
  std::sort(links.begin(), links.end(), [](const Link& p, const Link& q) { return p.votes > q.votes; });
  return links;
}

// Curves that hang together form a piece; half indices within a piece are right up to a whole even number.
struct Pieces {
  std::vector<int> piece, half_index;
  std::vector<std::vector<int>> members;

  explicit Pieces(const std::vector<bool>& rising) {
    for (size_t i = 0; i < rising.size(); ++i) {
      piece.push_back(int(i));
      half_index.push_back(rising[i] ? 0 : 1);
      members.push_back({int(i)});
    }
  }
  // Half index of b becomes that of a plus one, where the two are not of one piece yet.
  void join(int a, int b) {
    if (piece[a] == piece[b]) return;
    int move = half_index[a] + 1 - half_index[b];
    int into = piece[a], from = piece[b];
    if (members[into].size() < members[from].size()) {
      std::swap(into, from);
      move = -move;
    }
    for (const int curve : members[from]) {
      piece[curve] = into;
      half_index[curve] += move;
      members[into].push_back(curve);
    }
    members[from].clear();
  }
};

// Curves whose links mostly contradict the count: a fold that hides rows, or a bridge between two stripes.
std::vector<bool> contradicted(const Pieces& pieces, const std::vector<Link>& links, size_t curves) {
  std::vector<int> agree(curves, 0), differ(curves, 0);
  for (const Link& link : links) {
    auto& tally = pieces.half_index[link.b] == pieces.half_index[link.a] + 1 ? agree : differ;
    tally[link.a] += link.votes;
    tally[link.b] += link.votes;
  }
  std::vector<bool> result(curves);
  for (size_t i = 0; i < curves; ++i) result[i] = 3 * differ[i] > agree[i];
  return result;
}

// For each piece near a corner: how many whole periods its count must be moved by, with a weight.
using Votes = std::map<std::pair<int, int>, double>;  // (piece, periods) → weight

void vote_at_corner(const StripeObservation& o, const StripePattern& pattern, const Pieces& pieces,
                    const std::vector<bool>& doubtful, const Eigen::Vector2d& corner_px, double corner_row,
                    Votes& votes) {
  struct Fit {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Identity() * 1e-6;
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    double weight = 0;
    int edges = 0;
  };
  std::map<int, Fit> fits;
  for (const StripeEdge& edge : o.edges) {
    const Eigen::Vector2d d = edge.pixel - corner_px;
    if (d.norm() > kCornerReachPx || doubtful[edge.curve]) continue;
    const double weight = std::exp(-0.5 * d.squaredNorm() / (kCornerWeightPx * kCornerWeightPx));
    const Eigen::Vector3d basis(1, d.x(), d.y());
    Fit& fit = fits[pieces.piece[edge.curve]];
    fit.normal += weight * basis * basis.transpose();
    fit.right += weight * render::border_px(pattern, pieces.half_index[edge.curve]) * basis;
    fit.weight += weight;
    ++fit.edges;
  }
  for (const auto& [piece, fit] : fits) {
    if (fit.edges < 8) continue;
    const double relative_row = fit.normal.ldlt().solve(fit.right)(0);
    const double periods = (corner_row - relative_row) / pattern.period_px;
    const double miss = std::abs(periods - std::round(periods));
    if (miss > kLeastAgreement) continue;
    votes[{piece, int(std::lround(periods))}] += fit.weight * (1 - 2 * miss);
  }
}

}  // namespace

void link_curves(StripeObservation& o) {
  const auto ranges = lines(o);
  std::vector<double> slope(o.edges.size(), 0.0);
  int curves = 0;
  for (size_t l = 0; l < ranges.size(); ++l) {
    const auto range = ranges[l];
    const bool follows = l > 0;
    const int step = follows ? line_of(o, o.edges[range.first]) - line_of(o, o.edges[ranges[l - 1].first]) : 0;
    for (size_t i = range.first; i < range.second; ++i) {
      StripeEdge& edge = o.edges[i];
      edge.curve = -1;
      if (follows && step <= 4) {
        // The two lines' edges must choose each other, each from where its curve was heading.
        const auto previous = ranges[l - 1];
        size_t best = previous.second;
        double miss = 1e9;
        for (size_t j = previous.first; j < previous.second; ++j) {
          if (o.edges[j].rising != edge.rising) continue;
          const double d = std::abs(along(o, edge) - along(o, o.edges[j]) - slope[j] * step);
          if (d < miss) {
            miss = d;
            best = j;
          }
        }
        if (best < previous.second && miss < 1.0 + step && miss * edge.rows_per_px < 0.3 * o.period_px &&
            nearest(o, range, edge.rising, along(o, o.edges[best]) + slope[best] * step) == i) {
          edge.curve = o.edges[best].curve;
          slope[i] = std::clamp(0.5 * slope[best] + 0.5 * (along(o, edge) - along(o, o.edges[best])) / step, -3.0, 3.0);
        }
      }
      if (edge.curve < 0) edge.curve = curves++;
    }
  }
  o.curves = curves;
}

int label_edges(StripeObservation& o, const geometry::Projection& camera, const geometry::Projection& projector,
                const StripePattern& pattern, const Eigen::Vector3d& left_corner, const Eigen::Vector3d& right_corner) {
  std::vector<bool> rising(size_t(o.curves));
  for (const StripeEdge& edge : o.edges) rising[edge.curve] = edge.rising;
  const std::vector<Link> links = curve_links(o);
  Pieces pieces(rising);
  for (const Link& link : links) pieces.join(link.a, link.b);
  const std::vector<bool> doubtful = contradicted(pieces, links, rising.size());

  Votes votes;
  for (const Eigen::Vector3d& corner : {left_corner, right_corner}) {
    const Eigen::Vector2d lit = geometry::project(projector, corner);
    vote_at_corner(o, pattern, pieces, doubtful, geometry::project(camera, corner),
                   pattern.horizontal ? lit.y() : lit.x(), votes);
  }
  struct Verdict {
    int periods = 0;
    double best = 0, second = 0;
  };
  std::map<int, Verdict> verdicts;
  for (const auto& [key, weight] : votes) {
    Verdict& v = verdicts[key.first];
    if (weight > v.best) v = {key.second, weight, v.best};
    else v.second = std::max(v.second, weight);
  }
  int labelled = 0;
  for (StripeEdge& edge : o.edges) {
    const auto verdict = verdicts.find(pieces.piece[edge.curve]);
    edge.labelled =
        verdict != verdicts.end() && verdict->second.second < 0.5 * verdict->second.best && !doubtful[edge.curve];
    if (!edge.labelled) continue;
    edge.half_index = pieces.half_index[edge.curve] + 2 * verdict->second.periods;
    edge.projector_px = render::border_px(pattern, edge.half_index);
    ++labelled;
  }
  return labelled;
}

}  // namespace selvedge::observe
