#include "hardware_sim/bank/fabric_extras.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>
#include <vector>

#include <Eigen/Geometry>

#include "hardware_sim/bank/added_weights.h"

namespace selvedge::hardware_sim {

namespace {

using Eigen::Vector3d;

Vector3d at(const double* const plane[3], int i) { return {plane[0][i], plane[1][i], plane[2][i]}; }

void push(const LatticeView& s, int i, const Vector3d& force) {
  for (int a = 0; a < 3; ++a) s.f[a][i] += force(a);
}

// An additional stress on the strains along u and along v, N/m: of Green's strain, its rate and a memory of its own.
class EdgeStress : public LatticeExtra {
 public:
  using Law = std::function<double(bool along_u, double strain, double rate, double dt_s, double& memory)>;
  explicit EdgeStress(Law law) : law_(std::move(law)) {}
  bool has_stress() const override { return true; }
  void stress(StrainView& s, double dt_s) override {
    add_to(along_u_, true, s.e_uu, s.stress_uu, dt_s);
    add_to(along_v_, false, s.e_vv, s.stress_vv, dt_s);
  }
  void add(const LatticeView&, double) override {}

 private:
  struct Memory {
    std::vector<double> before, kept;
  };
  void add_to(Memory& memory, bool along_u, const std::vector<double>& strain, std::vector<double>& stress,
              double dt_s) {
    if (memory.before.empty()) {
      memory.before = strain;
      memory.kept.assign(strain.size(), 0.0);
    }
    for (size_t i = 0; i < strain.size(); ++i) {
      stress[i] += law_(along_u, strain[i], (strain[i] - memory.before[i]) / dt_s, dt_s, memory.kept[i]);
      memory.before[i] = strain[i];
    }
  }

  Law law_;
  Memory along_u_, along_v_;
};

// Three nodes of a lattice line, and their weights in the second derivative at the middle one, 1/m².
struct Triple {
  int a, b, c;
  double weight_a, weight_c, area;
  bool along_u, at_rim;
};

std::vector<Triple> triples_of(const LatticeView& s) {
  std::vector<Triple> triples;
  const auto add = [&](const std::vector<double>& place, int k, int middle, int next, bool along_u, bool at_rim) {
    const auto i = static_cast<size_t>(k);
    const double before = place[i] - place[i - 1], after = place[i + 1] - place[i], both = before + after;
    triples.push_back({middle - next, middle, middle + next, 2 / (before * both), 2 / (after * both), s.area[middle],
                       along_u, at_rim});
  };
  for (int r = 0; r < s.rows; ++r)
    for (int c = 0; c < s.columns; ++c) {
      const int i = r * s.columns + c;
      if (c > 0 && c + 1 < s.columns) add(s.grid->u.place, c, i, 1, true, r == 0 || r + 1 == s.rows);
      if (r > 0 && r + 1 < s.rows) add(s.grid->v.place, r, i, s.columns, false, c == 0 || c + 1 == s.columns);
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

std::vector<Vector3d> normals_of(const LatticeView& s) {
  std::vector<Vector3d> out(static_cast<size_t>(s.columns * s.rows));
  for (size_t i = 0; i < out.size(); ++i) out[i] = normal_at(s, static_cast<int>(i));
  return out;
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
    const std::vector<Vector3d> normals = normals_of(s);
    for (size_t k = 0; k < triples_.size(); ++k) {
      const Triple& t = triples_[k];
      const Vector3d& n = normals[static_cast<size_t>(t.b)];
      const auto second = [&](const double* const plane[3]) {
        const Vector3d middle = at(plane, t.b);
        return (t.weight_a * (at(plane, t.a) - middle) + t.weight_c * (at(plane, t.c) - middle)).dot(n);
      };
      const Vector3d pull = t.area * law_(t, second(s.x), second(s.v), dt_s, memory_[k]) * n;
      push(s, t.a, -t.weight_a * pull);
      push(s, t.b, (t.weight_a + t.weight_c) * pull);
      push(s, t.c, -t.weight_c * pull);
    }
  }

 private:
  Law law_;
  std::vector<Triple> triples_;
  std::vector<double> memory_;
};

// Stretch one way pulls the other way in: energy ν k E_uu E_vv at each cell, each the mean of its two sides.
class Coupling : public LatticeExtra {
 public:
  explicit Coupling(double nu) : nu_(nu) {}
  bool has_stress() const override { return true; }
  void stress(StrainView& s, double) override {
    const double k = nu_ * s.truth->stretch;
    const auto u = [&](int r, int c) { return static_cast<size_t>(r * (s.columns - 1) + c); };
    const auto v = [&](int r, int c) { return static_cast<size_t>(r * s.columns + c); };
    for (int r = 0; r + 1 < s.rows; ++r)
      for (int c = 0; c + 1 < s.columns; ++c) {
        const double along = 0.5 * (s.e_uu[u(r, c)] + s.e_uu[u(r + 1, c)]);
        const double down = 0.5 * (s.e_vv[v(r, c)] + s.e_vv[v(r, c + 1)]);
        const double area =
            s.grid->u.middle_weight[static_cast<size_t>(c)] * s.grid->v.middle_weight[static_cast<size_t>(r)];
        for (const int next : {0, 1}) {
          const double side_u =
              s.grid->u.middle_weight[static_cast<size_t>(c)] * s.grid->v.node_weight[static_cast<size_t>(r + next)];
          const double side_v =
              s.grid->u.node_weight[static_cast<size_t>(c + next)] * s.grid->v.middle_weight[static_cast<size_t>(r)];
          s.stress_uu[u(r + next, c)] += 0.5 * k * down * area / side_u;
          s.stress_vv[v(r, c + next)] += 0.5 * k * along * area / side_v;
        }
      }
  }
  void add(const LatticeView&, double) override {}

 private:
  double nu_;
};

// Air carried along: what pushes a node across the fabric accelerates the air as well.
class AddedMass : public LatticeExtra {
 public:
  explicit AddedMass(double per_area) : per_area_(per_area) {}
  void add(const LatticeView& s, double) override {
    for (int i = 0; i < s.columns * s.rows; ++i) {
      const double area = s.area[i], share = per_area_ * area / (s.mass[i] + per_area_ * area);
      const Vector3d n = normal_at(s, i), force = at(s.f, i) + s.mass[i] * s.gravity_m_s2;
      // Gravity is added later as mass times g; the weight of the air does not pull.
      push(s, i, -share * (force.dot(n)) * n);
    }
  }

 private:
  double per_area_;
};

// Of something spread over 10 mm about a flat place, what a node has.
double patch_share(const LatticeView& s, int row, int column, double u, double v) {
  const auto at = [&](int r, int c) {
    const double du = s.grid->u.place[static_cast<size_t>(c)] - u, dv = s.grid->v.place[static_cast<size_t>(r)] - v;
    return s.area[r * s.columns + c] * std::exp(-(du * du + dv * dv) / (0.01 * 0.01));
  };
  double all = 0;
  for (int r = 0; r < s.rows; ++r)
    for (int c = 0; c < s.columns; ++c) all += at(r, c);
  return at(row, column) / all;
}

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
          double rim_m = 0;
          if (r == 0 || r + 1 == s.rows) rim_m = s.grid->u.node_weight[static_cast<size_t>(c)];
          else if (c == 0 || c + 1 == s.columns) rim_m = s.grid->v.node_weight[static_cast<size_t>(r)];
          return 0.012 * size * 0.04 * rim_m;
        }) {}
  void begin(const LatticeView& s) override {
    weights_.begin(s);
    // The strip that it stiffens is as wide on every lattice.
    stiff_ = std::make_unique<BendMoment>(
        [bend = s.truth->bend, across_u = s.grid->v.node_weight, across_v = s.grid->u.node_weight](
            const Triple& t, double curvature, double, double, double&) {
      if (!t.at_rim) return 0.0;
      const double strip_m = 0.0068, width_m = t.along_u ? across_u.front() : across_v.front();
      return 6 * bend * curvature * strip_m / width_m;
    });
    stiff_->begin(s);
  }
  void add(const LatticeView& s, double dt_s) override { stiff_->add(s, dt_s); }

 private:
  AddedWeights weights_;
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
  bool has_stress() const override { return inner_ && inner_->has_stress(); }
  void stress(StrainView& s, double dt_s) override { inner_->stress(s, dt_s); }
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
      return [k = size * t.stretch](bool along_u, double strain, double, double, double&) {
        return along_u ? k * strain : 0.0;
      };
    });
  if (name == "coupling") return {std::make_shared<Coupling>(size), 0.7};
  if (name == "stretch_stiffening")  // cubic: k (size · E)² E
    return edge_of_truth(
        [size](const FabricTruth& t) {
      return [k = t.stretch, size](bool, double strain, double, double, double&) {
        const double x = std::clamp(strain, -0.3, 0.3);
        return k * size * size * x * x * x;
      };
        },
        0.4);
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
    return edge(
        [size](bool, double, double rate, double dt_s, double& stress) {
      return stress = std::clamp(stress + size / 0.004 * rate * dt_s, -size, size);
        },
        0.6);
  if (name == "creep")  // share: a spring behind a dashpot that gives way within 0.8 s
    return edge_of_truth([size](const FabricTruth& t) {
      return [k = size * t.stretch](bool, double, double rate, double dt_s, double& stress) {
        return stress += dt_s * (k * rate - stress / 0.8);
      };
    });
  if (name == "hem") return {std::make_shared<Hem>(size), 0.4};
  if (name == "added_mass") return {std::make_shared<AddedMass>(size), 1};  // kg/m²
  if (name == "local_mass")  // kg, a patch a third from the right, near the lower edge
    return {std::make_shared<AddedWeights>([size](int r, int c, const LatticeView& s) {
              return size * patch_share(s, r, c, 2 * s.truth->width_m / 3, s.truth->height_m * 19 / 22);
            }),
            1};
  throw std::invalid_argument("fabric_extra: found " + name);
}

}  // namespace selvedge::hardware_sim
