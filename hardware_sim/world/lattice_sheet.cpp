#include "hardware_sim/world/lattice_sheet.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <Eigen/Geometry>

namespace selvedge::hardware_sim {

const std::vector<FabricParameter>& fabric_parameters() {
  using T = FabricTruth;
  static const std::vector<FabricParameter> all = {
      {"stretch", "N/m", &T::stretch, 1, 1e5},
      {"shear", "N/m", &T::shear, 0.1, 1e5},
      {"bend", "N·m", &T::bend, 0, 0.1},
      {"stretch_damping", "N·s/m", &T::stretch_damping, 0, 100},
      {"shear_damping", "N·s/m", &T::shear_damping, 0, 100},
      {"bend_damping", "N·m·s", &T::bend_damping, 0, 1},
      {"drag_normal", "kg/m³", &T::drag_normal, 0, 100},
      {"drag_tangent", "kg/(m²·s)", &T::drag_tangent, 0, 100},
      {"drag_fade", "s²/m²", &T::drag_fade, 0, 100},
  };
  return all;
}

namespace {

constexpr int kDragEvery = 4;           // steps
constexpr double kLongestLag_s = 2e-3;  // of a dashpot of the membrane behind its spring
constexpr double kBendLag_s = 1e-3;     // of bending's

// A dashpot of viscosity c behind a spring: as stiff as what it stands beside, but no slacker than kLongestLag_s.
double lag_of(double viscosity, double stiffness) { return std::min(kLongestLag_s, viscosity / stiffness); }

StrainLaw strain_law(double stiffness, double viscosity, double lag_s, double dt) {
  if (viscosity <= 0 || lag_s <= 0 || dt <= 0) return {stiffness, 0, 0};
  const double keep = std::exp(-dt / lag_s);
  return {stiffness, keep, viscosity / dt * (1 - keep)};
}

// At nodes and half way between them.
std::vector<LineCubic> halved(const std::vector<double>& nodes) {
  std::vector<LineCubic> out;
  for (size_t i = 0; i < nodes.size(); ++i) {
    out.push_back(line_cubic(nodes, nodes[i]));
    if (i + 1 < nodes.size()) out.push_back(line_cubic(nodes, 0.5 * (nodes[i] + nodes[i + 1])));
  }
  return out;
}

// Weights of all nodes in the value at a place.
std::vector<double> value_at(const std::vector<double>& nodes, double place) {
  std::vector<double> out(nodes.size(), 0.0);
  const LineCubic c = line_cubic(nodes, place);
  for (size_t i = 0; i < 4; ++i) out[static_cast<size_t>(c.first) + i] = c.weight[i];
  return out;
}

}  // namespace

LineCubic line_cubic(const std::vector<double>& nodes, double place) {
  const auto cell = std::upper_bound(nodes.begin(), nodes.end(), place) - nodes.begin() - 1;
  LineCubic out{std::clamp(static_cast<int>(cell) - 1, 0, static_cast<int>(nodes.size()) - 4), {1, 1, 1, 1}};
  const double* node = &nodes[static_cast<size_t>(out.first)];
  for (size_t i = 0; i < 4; ++i)
    for (size_t k = 0; k < 4; ++k)
      if (k != i) out.weight[i] *= (place - node[k]) / (node[i] - node[k]);
  return out;
}

LatticeSheet::LatticeSheet(const FabricTruth& truth, const LatticeOptions& options)
    : truth_(truth), options_(options), columns_(options.cells_across + 1), rows_(options.cells_down + 1),
      forces_(SheetGrid(graded_places(truth.width_m, options.cells_across, options.grading, true),
                        graded_places(truth.height_m, options.cells_down, options.grading, false))) {
  const SheetGrid& grid = forces_.grid();
  per_mass_.assign(grid.size(), 0.0f);
  for (SheetPlane<float>& plane : drag_) plane.assign(grid.size(), 0.0f);
  for (int i = 0; i < count(); ++i)
    area_.push_back(grid.u.node_weight[static_cast<size_t>(i % columns_)] *
                    grid.v.node_weight[static_cast<size_t>(i / columns_)]);
  mass_ = area_;
  for (double& mass : mass_) mass *= truth.density;
  for (int i = 0; i < count(); ++i) per_mass_[at(i)] = static_cast<float>(1 / mass_[static_cast<size_t>(i)]);
  seen_u_ = halved(grid.u.place);
  seen_v_ = halved(grid.v.place);
  if (options.edge_held) {
    for (int c = 0; c < columns_; ++c) {
      SheetGrip& grip = grips_.emplace_back();
      grip.node = {c};
      grip.weight = {1};
      grip.along = grid.u.place[static_cast<size_t>(c)] / truth.width_m;
    }
  } else {
    const auto value_on = [](const std::vector<double>& nodes) {
      return [&nodes](double place) { return value_at(nodes, place); };
    };
    for (const bool right : {false, true})
      grips_.push_back(corner_grip(grid.u.place, value_on(grid.u.place), grid.v.place, value_on(grid.v.place), right));
  }
  for (SheetGrip& grip : grips_) grip.set_responses(mass_.data());
  step_s_ = stable_step_s();

  Eigen::Matrix3Xd flat(3, count());
  const auto uv = rest_uv();
  for (int i = 0; i < count(); ++i)
    flat.col(i) = Eigen::Vector3d(uv[static_cast<size_t>(i)].x(), 0, -uv[static_cast<size_t>(i)].y());
  set_position(flat);
}

Eigen::Vector3d LatticeSheet::read(const SheetGrip& grip, const Eigen::Matrix3Xd& nodes) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (size_t i = 0; i < grip.node.size(); ++i) sum += grip.weight[i] * nodes.col(grip.node[i]);
  return sum;
}

// Velocities of the nodes that the grip holds, so that it moves as it is to.
void LatticeSheet::hold(SheetGrip& grip) {
  for (size_t a = 0; a < 3; ++a) {
    double lacks = grip.velocity[static_cast<Eigen::Index>(a)];
    for (size_t i = 0; i < grip.node.size(); ++i)
      lacks -= grip.weight[i] * static_cast<double>(forces_.v[a][at(grip.node[i])]);
    for (size_t i = 0; i < grip.node.size(); ++i)
      forces_.v[a][at(grip.node[i])] += static_cast<float>(grip.response[i] * lacks);
  }
}

SheetLaw LatticeSheet::law(double dt) const {
  SheetLaw out;
  const FabricTruth& t = truth_;
  out.stretch = strain_law(t.stretch, t.stretch_damping, lag_of(t.stretch_damping, t.stretch), dt);
  out.shear = strain_law(t.shear, t.shear_damping, lag_of(t.shear_damping, t.shear), dt);
  out.bend = strain_law(t.bend, t.bend_damping, kBendLag_s, dt);
  out.drag_normal = t.drag_normal;
  out.drag_tangent = t.drag_tangent;
  out.drag_fade = t.drag_fade;
  for (size_t a = 0; a < 3; ++a) out.air[a] = options_.air_m_s[static_cast<Eigen::Index>(a)];
  return out;
}

// From the highest frequency of the flat sheet with its dashpots as stiff as the springs before them, by power
// iteration; 2 / ω is what symplectic Euler stands.
double LatticeSheet::stable_step_s() const {
  SheetForces<double> probe(forces_.grid());
  SheetLaw stiff = law(0);
  stiff.stretch.stiffness += truth_.stretch_damping / std::max(lag_of(truth_.stretch_damping, truth_.stretch), 1e-12);
  stiff.shear.stiffness += truth_.shear_damping / std::max(lag_of(truth_.shear_damping, truth_.shear), 1e-12);
  stiff.bend.stiffness += truth_.bend_damping / kBendLag_s;
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  Eigen::Matrix3Xd moved(3, count());
  for (Eigen::Index i = 0; i < moved.size(); ++i) moved.data()[i] = normal(random);
  const std::vector<Eigen::Vector2d> uv = rest_uv();
  const double small = 1e-9;
  double omega2 = 0;
  for (int round = 0; round < 40; ++round) {
    moved /= moved.norm();
    for (int i = 0; i < count(); ++i) {
      probe.x[0][at(i)] = uv[static_cast<size_t>(i)].x() + small * moved(0, i);
      probe.x[1][at(i)] = small * moved(1, i);
      probe.x[2][at(i)] = -uv[static_cast<size_t>(i)].y() + small * moved(2, i);
    }
    probe.strain(stiff);
    probe.pull(stiff);
    for (int i = 0; i < count(); ++i)
      for (size_t a = 0; a < 3; ++a)
        moved(static_cast<Eigen::Index>(a), i) = -probe.f[a][at(i)] / (small * mass_[static_cast<size_t>(i)]);
    omega2 = moved.norm();
  }
  return options_.step_share * step_share_ * 2 / std::sqrt(omega2);
}

std::vector<Eigen::Vector2d> LatticeSheet::rest_uv() const {
  std::vector<Eigen::Vector2d> uv;
  for (const double v : forces_.grid().v.place)
    for (const double u : forces_.grid().u.place) uv.emplace_back(u, v);
  return uv;
}

std::vector<std::array<int, 3>> LatticeSheet::triangles() const {
  std::vector<std::array<int, 3>> result;
  const int wide = static_cast<int>(seen_u_.size());
  for (int r = 0; r + 1 < static_cast<int>(seen_v_.size()); ++r)
    for (int c = 0; c + 1 < wide; ++c) {
      const int i = r * wide + c;
      result.push_back({i, i + wide, i + 1});
      result.push_back({i + 1, i + wide, i + wide + 1});
    }
  return result;
}

Eigen::Matrix3Xd LatticeSheet::seen(const Eigen::Matrix3Xd& nodes) const {
  const auto wide = static_cast<Eigen::Index>(seen_u_.size());
  Eigen::Matrix3Xd along(3, wide * rows_), out(3, wide * static_cast<Eigen::Index>(seen_v_.size()));
  for (Eigen::Index r = 0; r < rows_; ++r)
    for (Eigen::Index c = 0; c < wide; ++c) {
      const LineCubic& u = seen_u_[static_cast<size_t>(c)];
      const Eigen::Index first = r * columns_ + u.first;
      along.col(r * wide + c) = u.weight[0] * nodes.col(first) + u.weight[1] * nodes.col(first + 1) +
                                u.weight[2] * nodes.col(first + 2) + u.weight[3] * nodes.col(first + 3);
    }
  for (size_t r = 0; r < seen_v_.size(); ++r) {
    const LineCubic& v = seen_v_[r];
    const auto line = [&](int k) { return along.middleCols((v.first + k) * wide, wide); };
    out.middleCols(static_cast<Eigen::Index>(r) * wide, wide) =
        v.weight[0] * line(0) + v.weight[1] * line(1) + v.weight[2] * line(2) + v.weight[3] * line(3);
  }
  return out;
}

void LatticeSheet::hang(const Eigen::Vector3d& left, const Eigen::Vector3d& right, const Eigen::Vector3d& side) {
  const Eigen::Vector3d span = right - left, along = span.normalized(), down = options_.gravity_m_s2.normalized();
  const Eigen::Vector3d across = (side - side.dot(along) * along - side.dot(down) * down).normalized();
  constexpr int kPieces = 2000;
  // Length of the sine of height `bulge` up to each of its pieces' ends.
  const auto lengths = [&](double bulge) {
    std::vector<double> length(kPieces + 1, 0.0);
    for (int i = 1; i <= kPieces; ++i) {
      const double slope = bulge * M_PI * std::cos(M_PI * (i - 0.5) / kPieces);
      length[i] = length[i - 1] + std::hypot(span.norm(), slope) / kPieces;
    }
    return length;
  };
  double low = 0, high = truth_.width_m;
  for (int i = 0; i < 60; ++i) (lengths(0.5 * (low + high)).back() < truth_.width_m ? low : high) = 0.5 * (low + high);
  const std::vector<double> length = lengths(low);
  Eigen::Matrix3Xd position(3, count());
  for (int c = 0; c < columns_; ++c) {
    const double wanted = length.back() * forces_.grid().u.place[static_cast<size_t>(c)] / truth_.width_m;
    const auto next =
        std::clamp<std::ptrdiff_t>(std::lower_bound(length.begin(), length.end(), wanted) - length.begin(), 1, kPieces);
    const double u =
        (static_cast<double>(next) - (length[next] - wanted) / (length[next] - length[next - 1])) / kPieces;
    for (int r = 0; r < rows_; ++r)
      position.col(r * columns_ + c) =
          left + u * span + std::sin(M_PI * u) * low * across + forces_.grid().v.place[static_cast<size_t>(r)] * down;
  }
  set_position(position);
  set_velocity(Eigen::Matrix3Xd::Zero(3, count()));
}

void LatticeSheet::set_position(const Eigen::Matrix3Xd& position) {
  origin_ = position.rowwise().mean();
  for (size_t a = 0; a < 3; ++a)
    for (int i = 0; i < count(); ++i) {
      const auto axis = static_cast<Eigen::Index>(a);
      forces_.x[a][at(i)] = static_cast<float>(position(axis, i) - origin_[axis]);
    }
  forces_.begin();
  since_drag_ = 0;
}

void LatticeSheet::set_velocity(const Eigen::Matrix3Xd& velocity) {
  for (size_t a = 0; a < 3; ++a)
    for (int i = 0; i < count(); ++i)
      forces_.v[a][at(i)] = static_cast<float>(velocity(static_cast<Eigen::Index>(a), i));
  since_drag_ = 0;
}

Eigen::Matrix3Xd LatticeSheet::dense(const SheetField<float>& field) const {
  Eigen::Matrix3Xd result(3, count());
  for (int r = 0, i = 0; r < rows_; ++r) {
    const size_t start = forces_.grid().at(r, 0);
    for (size_t c = start; c < start + static_cast<size_t>(columns_); ++c, ++i)
      result.col(i) << static_cast<double>(field[0][c]), static_cast<double>(field[1][c]),
          static_cast<double>(field[2][c]);
  }
  return result;
}

Eigen::Matrix3Xd LatticeSheet::position() const { return dense(forces_.x).colwise() + origin_; }

Eigen::Matrix3Xd LatticeSheet::velocity() const { return dense(forces_.v); }

Eigen::Vector3d LatticeSheet::point(const Eigen::Matrix3Xd& nodes, const Eigen::Vector2d& uv) const {
  const LineCubic u = line_cubic(forces_.grid().u.place, uv.x()), v = line_cubic(forces_.grid().v.place, uv.y());
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c)
      sum += v.weight[static_cast<size_t>(r)] * u.weight[static_cast<size_t>(c)] *
             nodes.col((v.first + r) * columns_ + u.first + c);
  return sum;
}

// Shows the extras nodes and strains, each in double precision.
void LatticeSheet::look() {
  for (size_t a = 0; a < 3; ++a) {
    const auto axis = static_cast<Eigen::Index>(a);
    for (std::vector<double>* plane : {&x_seen_[a], &v_seen_[a], &f_seen_[a]})
      plane->resize(static_cast<size_t>(count()));
    for (int i = 0; i < count(); ++i) {
      const auto k = static_cast<size_t>(i);
      x_seen_[a][k] = static_cast<double>(forces_.x[a][at(i)]) + origin_[axis];
      v_seen_[a][k] = static_cast<double>(forces_.v[a][at(i)]);
      f_seen_[a][k] = static_cast<double>(forces_.f[a][at(i)] + drag_[a][at(i)]);
    }
  }
}

LatticeView LatticeSheet::view() {
  look();
  LatticeView out{columns_,     rows_,        &forces_.grid(),      time_s_, &truth_, {}, {}, {},
                  mass_.data(), area_.data(), options_.gravity_m_s2};
  for (size_t a = 0; a < 3; ++a) {
    out.x[a] = x_seen_[a].data();
    out.v[a] = v_seen_[a].data();
    out.f[a] = f_seen_[a].data();
  }
  return out;
}

void LatticeSheet::add_extra(std::shared_ptr<LatticeExtra> extra, double step_share) {
  extra->begin(view());
  for (int i = 0; i < count(); ++i) per_mass_[at(i)] = static_cast<float>(1 / mass_[static_cast<size_t>(i)]);
  for (SheetGrip& grip : grips_) grip.set_responses(mass_.data());
  step_share_ *= step_share;
  step_s_ = stable_step_s();
  extras_.push_back(std::move(extra));
}

// What extras add to the strains' stresses.
void LatticeSheet::act_on_stress(double dt) {
  StrainView& s = strains_;
  s.grid = &forces_.grid();
  s.truth = &truth_;
  if (s.e_uu.empty())
    s = {columns_,
         rows_,
         &forces_.grid(),
         &truth_,
         std::vector<double>(static_cast<size_t>(rows_ * (columns_ - 1))),
         std::vector<double>(static_cast<size_t>((rows_ - 1) * columns_)),
         {},
         {}};
  s.stress_uu.assign(s.e_uu.size(), 0.0);
  s.stress_vv.assign(s.e_vv.size(), 0.0);
  const SheetGrid& grid = forces_.grid();
  for (int r = 0; r < rows_; ++r)
    for (int c = 0; c + 1 < columns_; ++c)
      s.e_uu[static_cast<size_t>(r * (columns_ - 1) + c)] = static_cast<double>(forces_.uu.strain[grid.at(r, c)]);
  for (int r = 0; r + 1 < rows_; ++r)
    for (int c = 0; c < columns_; ++c)
      s.e_vv[static_cast<size_t>(r * columns_ + c)] = static_cast<double>(forces_.vv.strain[grid.at(r, c)]);
  for (const auto& extra : extras_) extra->stress(s, dt);
  for (int r = 0; r < rows_; ++r)
    for (int c = 0; c + 1 < columns_; ++c)
      forces_.uu.stress[grid.at(r, c)] += static_cast<float>(s.stress_uu[static_cast<size_t>(r * (columns_ - 1) + c)]);
  for (int r = 0; r + 1 < rows_; ++r)
    for (int c = 0; c < columns_; ++c)
      forces_.vv.stress[grid.at(r, c)] += static_cast<float>(s.stress_vv[static_cast<size_t>(r * columns_ + c)]);
}

void LatticeSheet::act_on_nodes(double dt) {
  const LatticeView seen = view();
  for (const auto& extra : extras_) extra->add(seen, dt);
  for (size_t a = 0; a < 3; ++a)
    for (int i = 0; i < count(); ++i)
      forces_.f[a][at(i)] = static_cast<float>(f_seen_[a][static_cast<size_t>(i)]) - drag_[a][at(i)];
}

void LatticeSheet::step(double dt, double brake, bool held) {
  forces_.strain(law_);
  if (std::any_of(extras_.begin(), extras_.end(), [](const auto& extra) { return extra->has_stress(); }))
    act_on_stress(dt);
  forces_.pull(law_);
  if (since_drag_ == 0) forces_.drag(law_, drag_);
  since_drag_ = (since_drag_ + 1) % kDragEvery;
  if (!extras_.empty()) act_on_nodes(dt);
  time_s_ += dt;
  const auto keep = static_cast<float>(std::exp(-brake * dt)), h = static_cast<float>(dt);
  const size_t first = forces_.grid().at(0, 0), last = forces_.grid().at(rows_, 0);
  for (size_t a = 0; a < 3; ++a) {
    const auto g = static_cast<float>(options_.gravity_m_s2[static_cast<Eigen::Index>(a)]);
    float* v = forces_.v[a].data();
    const float *f = forces_.f[a].data(), *drag = drag_[a].data(), *per_mass = per_mass_.data();
    for (size_t i = first; i < last; ++i) v[i] = keep * (v[i] + h * ((f[i] + drag[i]) * per_mass[i] + g));
  }
  if (held)
    for (SheetGrip& grip : grips_) hold(grip);
  for (size_t a = 0; a < 3; ++a) {
    const float* v = forces_.v[a].data();
    float* x = forces_.x[a].data();
    for (size_t i = first; i < last; ++i) x[i] += h * v[i];
  }
}

double LatticeSheet::largest_strain() const {
  float most = 0;
  for (const StrainPlanes<float>* s : {&forces_.uu, &forces_.vv})
    for (const float e : s->strain) most = std::max(most, e);
  return static_cast<double>(most);
}

// A side's stiffness against being stretched grows by 1 + 3 E.
void LatticeSheet::steps(double duration_s, double brake, bool held) {
  const double stands = step_s_ / std::sqrt(1 + 3 * largest_strain());
  const int count = std::max(1, static_cast<int>(std::ceil(duration_s / stands)));
  const double dt = duration_s / count;
  law_ = law(dt);
  for (int i = 0; i < count; ++i) step(dt, brake, held);
}

void LatticeSheet::advance(double duration_s, const Eigen::Vector3d& left_end, const Eigen::Vector3d& right_end,
                           double brake) {
  for (SheetGrip& grip : grips_) {
    Eigen::Vector3d here = origin_;
    for (size_t i = 0; i < grip.node.size(); ++i)
      for (size_t a = 0; a < 3; ++a)
        here[static_cast<Eigen::Index>(a)] += grip.weight[i] * static_cast<double>(forces_.x[a][at(grip.node[i])]);
    grip.velocity = (left_end + grip.along * (right_end - left_end) - here) / duration_s;
  }
  steps(duration_s, brake, true);
}

void LatticeSheet::advance_free(double duration_s) { steps(duration_s, 0, false); }

SheetForces<double> LatticeSheet::exact() const {
  SheetForces<double> out(forces_.grid());
  const Eigen::Matrix3Xd x = position(), v = velocity();
  for (size_t a = 0; a < 3; ++a)
    for (int i = 0; i < count(); ++i) {
      out.x[a][at(i)] = x(static_cast<Eigen::Index>(a), i);
      out.v[a][at(i)] = v(static_cast<Eigen::Index>(a), i);
    }
  return out;
}

Eigen::Matrix3Xd LatticeSheet::internal_forces() const {
  SheetForces<double> forces = exact();
  const SheetLaw elastic = law(0);
  SheetField<double> drag = forces.v;
  forces.strain(elastic);
  forces.pull(elastic);
  forces.drag(elastic, drag);
  Eigen::Matrix3Xd result(3, count());
  for (size_t a = 0; a < 3; ++a)
    for (int i = 0; i < count(); ++i) result(static_cast<Eigen::Index>(a), i) = forces.f[a][at(i)] + drag[a][at(i)];
  return result;
}

double LatticeSheet::kinetic_energy() const {
  double sum = 0;
  for (int i = 0; i < count(); ++i)
    for (size_t a = 0; a < 3; ++a)
      sum += 0.5 * mass_[static_cast<size_t>(i)] * std::pow(static_cast<double>(forces_.v[a][at(i)]), 2);
  return sum;
}

LatticeEnergy LatticeSheet::energy() const {
  SheetForces<double> forces = exact();
  const SheetForces<double>::Elastic elastic = forces.elastic(law(0));
  LatticeEnergy e{elastic.stretch, elastic.shear, elastic.bend, kinetic_energy(), 0};
  const Eigen::Matrix3Xd x = position();
  for (int i = 0; i < count(); ++i) e.weight -= mass_[static_cast<size_t>(i)] * options_.gravity_m_s2.dot(x.col(i));
  return e;
}

}  // namespace selvedge::hardware_sim
