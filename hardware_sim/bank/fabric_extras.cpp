#include "hardware_sim/bank/fabric_extras.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>
#include <vector>

#include <Eigen/Geometry>

namespace selvedge::hardware_sim {

namespace {

using Eigen::Vector3d;

Vector3d at(const double* const plane[3], int i) { return {plane[0][i], plane[1][i], plane[2][i]}; }

void push(const LatticeView& s, int i, const Vector3d& force) {
  for (int a = 0; a < 3; ++a) s.f[a][i] += force(a);
}

// A lattice edge and its share of area.
struct Edge {
  int a, b;
  double h, area;
  bool along_u;
};

std::vector<Edge> edges_of(const LatticeView& s) {
  std::vector<Edge> edges;
  const double cell = s.hu * s.hv;
  for (int r = 0; r < s.rows; ++r)
    for (int c = 0; c < s.columns; ++c) {
      const int i = r * s.columns + c;
      if (c + 1 < s.columns) edges.push_back({i, i + 1, s.hu, cell * (r == 0 || r + 1 == s.rows ? 0.5 : 1), true});
      if (r + 1 < s.rows)
        edges.push_back({i, i + s.columns, s.hv, cell * (c == 0 || c + 1 == s.columns ? 0.5 : 1), false});
    }
  return edges;
}

// An additional stress on every edge, N/m: of its Green strain, strain rate and own memory.
class EdgeStress : public LatticeExtra {
 public:
  using Law = std::function<double(const Edge&, double strain, double rate, double dt_s, double& memory)>;
  explicit EdgeStress(Law law) : law_(std::move(law)) {}
  void begin(const LatticeView& s) override {
    edges_ = edges_of(s);
    memory_.assign(edges_.size(), 0.0);
  }
  void add(const LatticeView& s, double dt_s) override {
    for (size_t k = 0; k < edges_.size(); ++k) {
      const Edge& e = edges_[k];
      const Vector3d d = at(s.x, e.b) - at(s.x, e.a), w = at(s.v, e.b) - at(s.v, e.a);
      const double h2 = e.h * e.h, strain = 0.5 * (d.squaredNorm() / h2 - 1), rate = d.dot(w) / h2;
      const Vector3d pull = e.area * law_(e, strain, rate, dt_s, memory_[k]) / h2 * d;
      push(s, e.a, pull);
      push(s, e.b, -pull);
    }
  }

 private:
  Law law_;
  std::vector<Edge> edges_;
  std::vector<double> memory_;
};

// Three nodes of a lattice line.
struct Triple {
  int a, b, c;
  double h, area;
  bool along_u, at_rim;
};

std::vector<Triple> triples_of(const LatticeView& s) {
  std::vector<Triple> triples;
  const double cell = s.hu * s.hv;
  for (int r = 0; r < s.rows; ++r)
    for (int c = 0; c < s.columns; ++c) {
      const int i = r * s.columns + c;
      const bool side_r = r == 0 || r + 1 == s.rows, side_c = c == 0 || c + 1 == s.columns;
      if (c > 0 && c + 1 < s.columns)
        triples.push_back({i - 1, i, i + 1, s.hu, cell * (side_r ? 0.5 : 1), true, side_r});
      if (r > 0 && r + 1 < s.rows)
        triples.push_back({i - s.columns, i, i + s.columns, s.hv, cell * (side_c ? 0.5 : 1), false, side_c});
    }
  return triples;
}

Vector3d normal_at(const LatticeView& s, int i) {
  const int r = i / s.columns, c = i % s.columns;
  const Vector3d across =
      at(s.x, r * s.columns + std::min(c + 1, s.columns - 1)) - at(s.x, r * s.columns + std::max(c - 1, 0));
  const Vector3d down =
      at(s.x, std::min(r + 1, s.rows - 1) * s.columns + c) - at(s.x, std::max(r - 1, 0) * s.columns + c);
  return across.cross(down).normalized();
}

// An additional moment on every triple, N: of its curvature along the normal, its rate and its own memory.
class BendMoment : public LatticeExtra {
 public:
  using Law = std::function<double(const Triple&, double curvature, double rate, double dt_s, double& memory)>;
  explicit BendMoment(Law law) : law_(std::move(law)) {}
  void begin(const LatticeView& s) override {
    triples_ = triples_of(s);
    memory_.assign(triples_.size(), 0.0);
  }
  void add(const LatticeView& s, double dt_s) override {
    for (size_t k = 0; k < triples_.size(); ++k) {
      const Triple& t = triples_[k];
      const double h2 = t.h * t.h;
      const Vector3d n = normal_at(s, t.b);
      const double curvature = (at(s.x, t.a) - 2 * at(s.x, t.b) + at(s.x, t.c)).dot(n) / h2;
      const double rate = (at(s.v, t.a) - 2 * at(s.v, t.b) + at(s.v, t.c)).dot(n) / h2;
      const Vector3d pull = t.area * law_(t, curvature, rate, dt_s, memory_[k]) / h2 * n;
      push(s, t.a, -pull);
      push(s, t.b, 2 * pull);
      push(s, t.c, -pull);
    }
  }

 private:
  Law law_;
  std::vector<Triple> triples_;
  std::vector<double> memory_;
};

// Stretch one way pulls the other way in: energy ν k E_uu E_vv at each cell.
class Coupling : public LatticeExtra {
 public:
  explicit Coupling(double nu) : nu_(nu) {}
  void add(const LatticeView& s, double) override {
    const double k = nu_ * s.truth->stretch, area = s.hu * s.hv;
    for (int r = 0; r + 1 < s.rows; ++r)
      for (int c = 0; c + 1 < s.columns; ++c) {
        const int i = r * s.columns + c, right = i + 1, below = i + s.columns, far = below + 1;
        const Vector3d a = 0.5 / s.hu * (at(s.x, right) - at(s.x, i) + at(s.x, far) - at(s.x, below));
        const Vector3d b = 0.5 / s.hv * (at(s.x, below) - at(s.x, i) + at(s.x, far) - at(s.x, right));
        const Vector3d fa = 0.5 / s.hu * area * k * 0.5 * (b.squaredNorm() - 1) * a;
        const Vector3d fb = 0.5 / s.hv * area * k * 0.5 * (a.squaredNorm() - 1) * b;
        push(s, i, fa + fb);
        push(s, right, fb - fa);
        push(s, below, fa - fb);
        push(s, far, -fa - fb);
      }
  }

 private:
  double nu_;
};

// Air carried along: what pushes a node across the fabric accelerates the air as well.
class AddedMass : public LatticeExtra {
 public:
  explicit AddedMass(double per_area) : per_area_(per_area) {}
  void add(const LatticeView& s, double) override {
    for (int i = 0; i < s.columns * s.rows; ++i) {
      const double area = s.mass[i] / s.truth->density, share = per_area_ * area / (s.mass[i] + per_area_ * area);
      const Vector3d n = normal_at(s, i), force = at(s.f, i) + s.mass[i] * s.gravity_m_s2;
      // Gravity is added later as mass times g; the weight of the air does not pull.
      push(s, i, -share * (force.dot(n)) * n);
    }
  }

 private:
  double per_area_;
};

// Nodes made heavier: one spot, or the rim.
class Weights : public LatticeExtra {
 public:
  using Law = std::function<double(int row, int column, const LatticeView&)>;
  explicit Weights(Law kg) : kg_(std::move(kg)) {}
  void begin(const LatticeView& s) override {
    for (int i = 0; i < s.columns * s.rows; ++i) s.mass[i] += kg_(i / s.columns, i % s.columns, s);
  }
  void add(const LatticeView&, double) override {}

 private:
  Law kg_;
};

Extra edge(EdgeStress::Law law, double step_share = 0.7) {
  return {std::make_shared<EdgeStress>(std::move(law)), step_share};
}
Extra bend(BendMoment::Law law, double step_share = 0.8) {
  return {std::make_shared<BendMoment>(std::move(law)), step_share};
}

// A hem is both: heavier rim nodes and stiffer rim lines.
class Hem : public LatticeExtra {
 public:
  explicit Hem(double size)
      : weights_([size](int r, int c, const LatticeView& s) {
          const bool rim = r == 0 || r + 1 == s.rows || c == 0 || c + 1 == s.columns;
          return rim ? 0.012 * size * 0.04 * (r == 0 || r + 1 == s.rows ? s.hu : s.hv) : 0.0;
        }) {}
  void begin(const LatticeView& s) override {
    weights_.begin(s);
    stiff_ =
        std::make_unique<BendMoment>([bend = s.truth->bend](const Triple& t, double curvature, double, double,
                                                            double&) { return t.at_rim ? 6 * bend * curvature : 0.0; });
    stiff_->begin(s);
  }
  void add(const LatticeView& s, double dt_s) override { stiff_->add(s, dt_s); }

 private:
  Weights weights_;
  std::unique_ptr<BendMoment> stiff_;
};

// Laws that need the fabric's own numbers get them when the sheet is known.
template <class Base, class Law>
class OfTruth : public LatticeExtra {
 public:
  explicit OfTruth(std::function<Law(const FabricTruth&)> make) : make_(std::move(make)) {}
  void begin(const LatticeView& s) override {
    inner_ = std::make_unique<Base>(make_(*s.truth));
    inner_->begin(s);
  }
  void add(const LatticeView& s, double dt_s) override { inner_->add(s, dt_s); }

 private:
  std::function<Law(const FabricTruth&)> make_;
  std::unique_ptr<Base> inner_;
};

Extra edge_of_truth(std::function<EdgeStress::Law(const FabricTruth&)> make, double step_share = 0.7) {
  return {std::make_shared<OfTruth<EdgeStress, EdgeStress::Law>>(std::move(make)), step_share};
}

}  // namespace

Extra fabric_extra(const std::string& name, double size) {
  if (name == "anisotropy")  // share by which threads along u are stiffer
    return edge_of_truth([size](const FabricTruth& t) {
      return [k = size * t.stretch](const Edge& e, double strain, double, double, double&) {
        return e.along_u ? k * strain : 0.0;
      };
    });
  if (name == "coupling") return {std::make_shared<Coupling>(size), 0.7};
  if (name == "stretch_stiffening")  // cubic: k (size · E)² E
    return edge_of_truth(
        [size](const FabricTruth& t) {
      return [k = t.stretch, size](const Edge&, double strain, double, double, double&) {
        const double x = std::clamp(strain, -0.3, 0.3);
        return k * size * size * x * x * x;
      };
        },
        0.5);
  if (name == "bend_nonlinearity")  // N·m: extra rigidity that comes with 10 1/m of curvature
    return bend(
        [size](const Triple&, double curvature, double, double, double&) {
      const double k = std::clamp(curvature, -60.0, 60.0);
      return size * (k / 10) * (k / 10) * curvature;
        },
        0.5);
  if (name == "rest_curvature")  // N: constant moment along u
    return bend([size](const Triple& t, double, double, double, double&) { return t.along_u ? -size : 0.0; });
  if (name == "bend_friction")  // N: one slider behind a spring that gives way over 3 1/m
    return bend([size](const Triple&, double, double rate, double dt_s, double& moment) {
      return moment = std::clamp(moment + size / 3 * rate * dt_s, -size, size);
    });
  if (name == "stretch_friction")  // N/m: likewise, over a strain of 0.004
    return edge([size](const Edge&, double, double rate, double dt_s, double& stress) {
      return stress = std::clamp(stress + size / 0.004 * rate * dt_s, -size, size);
    });
  if (name == "creep")  // share: a spring behind a dashpot that gives way within 0.8 s
    return edge_of_truth([size](const FabricTruth& t) {
      return [k = size * t.stretch](const Edge&, double, double rate, double dt_s, double& stress) {
        return stress += dt_s * (k * rate - stress / 0.8);
      };
    });
  if (name == "hem") return {std::make_shared<Hem>(size), 0.4};
  if (name == "added_mass") return {std::make_shared<AddedMass>(size), 1};  // kg/m²
  if (name == "local_mass")  // kg, a third from the right, near the lower edge
    return {std::make_shared<Weights>([size](int r, int c, const LatticeView& s) {
              return r == s.rows - 4 && c == 2 * s.columns / 3 ? size : 0.0;
            }),
            1};
  throw std::invalid_argument("fabric_extra: found " + name);
}

}  // namespace selvedge::hardware_sim
