#include "hardware_sim/world/world_configuration.h"

#include "hardware_sim/synthetic_grid/synthetic_poses.h"
#include "files/bad_input.h"

namespace selvedge::hardware_sim {

namespace {

using rig::Section;

Eigen::Vector3d vector3(Section& section, const std::string& key, const Eigen::Vector3d& fallback, double most,
                        const std::string& unit) {
  const auto v =
      section.numbers(key, std::vector<double>{fallback.x(), fallback.y(), fallback.z()}, 3, -most, most, unit);
  return {v[0], v[1], v[2]};
}

Eigen::Vector2d vector2(Section& section, const std::string& key, const Eigen::Vector2d& fallback, double most,
                        const std::string& unit) {
  const auto v = section.numbers(key, std::vector<double>{fallback.x(), fallback.y()}, 2, -most, most, unit);
  return {v[0], v[1]};
}

// Where a device stands by default.
struct Stand {
  Eigen::Vector3d position;
  Eigen::Vector2d focal_px, principal_px;
  std::vector<double> distortion;
  int width_px, height_px;
};

geometry::Projection read_projection(Section& s, const Stand& stand) {
  const Eigen::Vector3d position = vector3(s, "position_m", stand.position, 20, "m");
  const Eigen::Vector3d target = vector3(s, "look_at_m", {0, 0, -0.15}, 20, "m");
  const Eigen::Vector2d focal = vector2(s, "focal_px", stand.focal_px, 1e5, "px");
  const int width = int(s.integer("width_px", stand.width_px, 16, 8192, "px"));
  const int height = int(s.integer("height_px", stand.height_px, 16, 8192, "px"));
  const Eigen::Vector2d principal = vector2(s, "principal_px", stand.principal_px, 1e5, "px");
  const auto distortion = s.numbers("distortion", stand.distortion, 5, -5, 5, "OpenCV's k1 k2 p1 p2 k3");
  geometry::Projection projection = geometry::looking_at(position, target, focal, principal, width, height);
  std::copy(distortion.begin(), distortion.end(), projection.distortion.begin());
  return projection;
}

void read_fabric_keys(Section& s, FabricTruth& f) {
  f.width_m = s.number("width_m", f.width_m, 0.02, 3, "m");
  f.height_m = s.number("height_m", f.height_m, 0.02, 3, "m");
  f.density = s.number("density", f.density, 0.005, 5, "kg/m²");
  for (const FabricParameter& p : fabric_parameters())
    f.*p.member = s.number(p.name, f.*p.member, p.lower, p.upper, p.unit);
}

FabricTruth read_fabric(Section s) {
  FabricTruth f;
  read_fabric_keys(s, f);
  s.finish();
  return f;
}

// What a swatch leaves out it has from [fabric].
std::vector<Swatch> read_swatches(Section s, const FabricTruth& fabric) {
  std::vector<Swatch> swatches;
  if (s.keys().empty()) return swatches;
  for (const std::string& name : s.texts("names", std::nullopt)) {
    if (!s.has(name)) refuse(s.where() + " names", "no section for the swatch {}", in_quotes(name));
    Section keys = s.section(name);
    Swatch swatch{.name = name, .fabric = fabric, .effect = {}, .strength = 0, .extra = {}, .step_share = 1};
    read_fabric_keys(keys, swatch.fabric);
    swatch.effect = keys.text("effect", "");
    swatch.strength = keys.number("strength", 0, -1e6, 1e6, "(the effect's own unit)");
    keys.finish();
    swatches.push_back(swatch);
  }
  s.finish();
  if (swatches.empty()) refuse(s.where() + " names", "found none, expected at least one swatch");
  return swatches;
}

void read_grid(Section s, WorldConfiguration& world) {
  calib::MarkerGrid& g = world.grid;
  g.columns = int(s.integer("columns", g.columns, 2, 50));
  g.rows = int(s.integer("rows", g.rows, 2, 50));
  g.spacing_m = s.number("spacing_m", g.spacing_m, 0.005, 1, "m");
  g.fold_rad = s.number("fold_rad", g.fold_rad, 0, 2.5, "rad");
  g.disc_diameter_m = s.number("disc_diameter_m", g.disc_diameter_m, 1e-3, 0.2, "m");
  g.ground_diameter_m = s.number("ground_diameter_m", g.ground_diameter_m, 1e-3, 0.5, "m");
  g.margin_m = s.number("margin_m", g.margin_m, 0, 1, "m");
  world.board.centre_m = vector3(s, "centre_m", world.board.centre_m, 20, "m");
  world.board.spread_m = vector3(s, "spread_m", world.board.spread_m, 5, "m");
  world.board.yaw_rad = s.number("yaw_rad", world.board.yaw_rad, 0, 1.4, "rad");
  world.board.pitch_rad = s.number("pitch_rad", world.board.pitch_rad, 0, 1.4, "rad");
  world.board.roll_rad = s.number("roll_rad", world.board.roll_rad, 0, 3.2, "rad");
  s.finish();
}

void read_camera(Section s, WorldConfiguration& world) {
  world.camera =
      read_projection(s, {{0.06, -1.05, -0.12}, {1060, 1062}, {322.5, 236.5}, {-0.06, 0.03, 4e-4, -3e-4, 0}, 640, 480});
  world.noise_grey = s.number("noise_grey", world.noise_grey, 0, 50, "grey levels");
  PictureOptions& p = world.picture;
  p.camera_blur_px = s.number("blur_px", p.camera_blur_px, 0, 10, "px");
  p.background_grey = s.number("background_grey", p.background_grey, 0, 255, "grey levels");
  p.ambient_grey = s.number("ambient_grey", p.ambient_grey, 0, 255, "grey levels");
  p.lit_grey = s.number("lit_grey", p.lit_grey, 0, 255, "grey levels");
  s.finish();
}

Knock read_knock(Section s) {
  Knock knock;
  const std::string device = s.text("device", "none");
  if (device == "camera") knock.device = Knock::Device::camera;
  else if (device == "projector") knock.device = Knock::Device::projector;
  else if (device != "none")
    refuse(s.where() + " device", "expected camera, projector or none, found {}", in_quotes(device));
  knock.turn_deg = vector3(s, "turn_deg", Eigen::Vector3d::Zero(), 45, "degrees");
  knock.before_trial = int(s.integer("before_trial", 1, 1, 1000));
  s.finish();
  return knock;
}

nlohmann::json to_json(const geometry::Projection& p) {
  nlohmann::json rows = nlohmann::json::array();
  for (int r = 0; r < 3; ++r) rows.push_back({p.matrix(r, 0), p.matrix(r, 1), p.matrix(r, 2), p.matrix(r, 3)});
  return {{"width_px", p.width_px}, {"height_px", p.height_px}, {"projection", rows}, {"distortion", p.distortion}};
}

nlohmann::json fabric_truth_json(const FabricTruth& f) {
  nlohmann::json parameters = nlohmann::json::object();
  for (const FabricParameter& p : fabric_parameters()) parameters[p.name] = {{"value", f.*p.member}, {"unit", p.unit}};
  return {
      {"fabric", {{"width_m", f.width_m}, {"height_m", f.height_m}, {"mass_kg", f.density * f.width_m * f.height_m}}},
      {"parameters", parameters}};
}

}  // namespace

const std::vector<std::string>& world_sections() {
  static const std::vector<std::string> sections = {"fabric",    "swatches", "lattice", "air",  "camera",
                                                    "projector", "grid",     "stand",   "hand", "arm",
                                                    "knock",     "world",    "devices", "bus"};
  return sections;
}

WorldConfiguration read_world(const rig::Configuration& configuration) {
  WorldConfiguration world;
  world.fabric = read_fabric(configuration.section("fabric"));
  world.swatches = read_swatches(configuration.section("swatches"), world.fabric);
  if (!world.swatches.empty()) world.fabric = world.swatches.front().fabric;
  Section lattice = configuration.section("lattice");
  world.lattice.cells_across = int(lattice.integer("cells_across", world.lattice.cells_across, 4, 200));
  world.lattice.cells_down = int(lattice.integer("cells_down", world.lattice.cells_down, 4, 200));
  world.sag_side = lattice.number("sag_side", world.sag_side, -1, 1, "(+1 or -1)") < 0 ? -1 : 1;
  lattice.finish();
  Section air = configuration.section("air");
  world.lattice.air_m_s = vector3(air, "velocity_m_s", world.lattice.air_m_s, 20, "m/s");
  air.finish();
  read_camera(configuration.section("camera"), world);
  Section projector = configuration.section("projector");
  world.projector =
      read_projection(projector, {{-0.12, -0.98, 0.42}, {1290, 2575}, {457, 571}, {0.02, 0, 0, 0, 0}, 912, 1140});
  world.picture.projector_blur_px = projector.number("blur_px", 1.5, 0, 20, "px");
  projector.finish();
  read_grid(configuration.section("grid"), world);
  Section stand = configuration.section("stand");
  world.left_m = vector3(stand, "left_m", world.left_m, 20, "m");
  world.separation_m = stand.number("separation_m", 0.853 * world.fabric.width_m, 0.01, world.fabric.width_m, "m");
  stand.finish();
  Section hand = configuration.section("hand");
  world.hand.carry_s = hand.number("carry_s", world.hand.carry_s, 0.1, 20, "s");
  world.hand.sway_m = hand.number("sway_m", world.hand.sway_m, 0, 0.05, "m");
  hand.finish();
  Section arm = configuration.section("arm");
  // The default brings the tool of a UR5e in its home position to where the hand holds the right corner.
  world.world_from_arm.translation() = vector3(arm, "base_position_m", {0.540, 0.133, -0.263}, 100, "m");
  const Eigen::Vector3d turn = vector3(arm, "base_rpy_deg", Eigen::Vector3d::Zero(), 360, "degrees") * M_PI / 180;
  world.world_from_arm.linear() =
      (Eigen::AngleAxisd(turn.z(), Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(turn.y(), Eigen::Vector3d::UnitY()) *
       Eigen::AngleAxisd(turn.x(), Eigen::Vector3d::UnitX()))
          .toRotationMatrix();
  arm.finish();
  world.knock = read_knock(configuration.section("knock"));
  Section general = configuration.section("world");
  world.seed = unsigned(general.integer("seed", 1, 0, 1'000'000'000));
  general.finish();
  world.board.seed = world.hand.seed = world.seed;
  return world;
}

WorldConfiguration knocked(WorldConfiguration world) {
  if (world.knock.device == Knock::Device::camera) world.camera = turned(world.camera, world.knock.turn_deg);
  if (world.knock.device == Knock::Device::projector) world.projector = turned(world.projector, world.knock.turn_deg);
  return world;
}

nlohmann::json truth_json(const WorldConfiguration& world) {
  nlohmann::json truth = fabric_truth_json(world.fabric);
  truth["format"] = "truth/1";
  truth["camera"] = to_json(world.camera);
  truth["projector"] = to_json(world.projector);
  truth["hidden"] = nlohmann::json::array();
  if (const Eigen::Vector3d& air = world.lattice.air_m_s; !air.isZero())
    truth["hidden"].push_back(
        {{"effect", "draught"}, {"size", {{"air_x", air.x()}, {"air_y", air.y()}, {"air_z", air.z()}}}});
  for (const Swatch& swatch : world.swatches) {
    truth["swatches"][swatch.name] = fabric_truth_json(swatch.fabric);
    if (!swatch.effect.empty())
      truth["swatches"][swatch.name]["hidden"] = {{"effect", swatch.effect}, {"strength", swatch.strength}};
  }
  return truth;
}

}  // namespace selvedge::hardware_sim
