#include "hardware_sim/bank/worlds.h"

#include <cmath>
#include <stdexcept>

#include "hardware_sim/bank/named_extra.h"
#include "hardware_sim/bank/point_extras.h"

namespace selvedge::hardware_sim {

namespace {

constexpr int kLatticeCells = 36;

class LatticeSwatch : public SwatchSheet {
 public:
  LatticeSwatch(const FabricTruth& truth, const SwatchOptions& options,
                const std::vector<std::pair<std::string, double>>& effects)
      : sheet_(truth, lattice_options(options)) {
    for (const auto& [name, size] : effects) {
      const Extra extra = named_extra(name, size, "effect");
      sheet_.add_extra(extra.extra, extra.step_share);
    }
  }
  std::vector<Eigen::Vector2d> rest_uv() const override { return sheet_.rest_uv(); }
  void place(const Eigen::Matrix3Xd& nodes) override {
    sheet_.set_position(nodes);
    stop();
  }
  void advance(double duration_s, const Eigen::Vector3d& left_end, const Eigen::Vector3d& right_end,
               double brake) override {
    sheet_.advance(duration_s, left_end, right_end, brake);
  }
  void stop() override { sheet_.set_velocity(Eigen::Matrix3Xd::Zero(3, sheet_.count())); }
  double kinetic_energy() const override { return sheet_.kinetic_energy(); }
  Eigen::Matrix3Xd points(const std::vector<Eigen::Vector2d>& uv) const override {
    const Eigen::Matrix3Xd nodes = sheet_.position();
    Eigen::Matrix3Xd out(3, static_cast<Eigen::Index>(uv.size()));
    for (size_t i = 0; i < uv.size(); ++i) out.col(static_cast<Eigen::Index>(i)) = sheet_.point(nodes, uv[i]);
    return out;
  }

 private:
  static LatticeOptions lattice_options(const SwatchOptions& o) {
    LatticeOptions out;
    out.cells_across = out.cells_down = static_cast<int>(std::lround(o.fineness * kLatticeCells));
    out.edge_held = o.hold == SwatchHold::top_edge;
    out.gravity_m_s2 = o.gravity_m_s2;
    out.air_m_s = o.air_m_s;
    return out;
  }

  LatticeSheet sheet_;
};

std::unique_ptr<SwatchSheet> point_swatch(PointKind kind, const FabricTruth& truth, const SwatchOptions& options,
                                          const std::vector<std::pair<std::string, double>>& effects) {
  auto sheet = std::make_unique<PointSheet>(kind, truth, options);
  for (const auto& [name, size] : effects) {
    if (add_point_extra(*sheet, name, size)) continue;
    // What acts on nodes alone is the same on every grid.
    const Extra extra = named_extra(name, size, "effect");
    sheet->add(extra.extra, extra.step_share);
  }
  return sheet;
}

}  // namespace

const std::vector<std::string>& bank_world_names() {
  static const std::vector<std::string> names = {"lattice", "sliding", "elements"};
  return names;
}

BankWorld bank_world(const std::string& name) {
  for (size_t k = 0; k < bank_world_names().size(); ++k)
    if (bank_world_names()[k] == name) return static_cast<BankWorld>(k);
  throw std::invalid_argument("bank_world: found " + name);
}

const char* to_text(BankWorld world) { return bank_world_names()[static_cast<size_t>(world)].c_str(); }

std::unique_ptr<SwatchSheet> make_swatch(BankWorld world, const FabricTruth& truth, const SwatchOptions& options,
                                         const std::vector<std::pair<std::string, double>>& effects) {
  switch (world) {
    case BankWorld::sliding: return point_swatch(PointKind::sliding, truth, options, effects);
    case BankWorld::elements: return point_swatch(PointKind::elements, truth, options, effects);
    case BankWorld::lattice: break;
  }
  return std::make_unique<LatticeSwatch>(truth, options, effects);
}

}  // namespace selvedge::hardware_sim
