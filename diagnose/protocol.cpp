#include "diagnose/protocol.h"

#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "diagnose/effects/effect.h"
#include "estimate/kept_input.h"
#include "files/sha256.h"

namespace selvedge::diagnose {

double form_along_an_axis_mm(const Protocol& protocol) { return protocol.form_mm / std::sqrt(3.0); }

void to_json(nlohmann::json& json, const Protocol& p) {
  json = {{"coarse_cells", p.coarse_cells},
          {"cells", p.cells},
          {"lengths_a_cell", p.lengths_a_cell},
          {"seen_lengths_a_cell", p.seen_lengths_a_cell},
          {"most_cells", p.most_cells},
          {"finer", p.finer},
          {"coarser", p.coarser},
          {"rate_hz", p.rate_hz},
          {"image_rate_hz", p.image_rate_hz},
          {"seen_apart", p.seen_apart},
          {"most_delay_s", p.most_delay_s},
          {"most_motion_s", p.most_motion_s},
          {"lead_s", p.lead_s},
          {"nudging_per_s", p.nudging_per_s},
          {"harder", p.harder},
          {"enough", p.enough},
          {"near_enough", p.near_enough},
          {"usual_within", p.usual_within},
          {"least_shear", p.least_shear},
          {"most_shear", p.most_shear},
          {"free_s", p.free_s},
          {"hold_per_s", p.hold_per_s},
          {"image_window_s", p.image_window_s},
          {"base_difference", p.base_difference},
          {"columns_again", p.columns_again},
          {"force_waves", p.force_waves},
          {"force_share", p.force_share},
          {"force_smoothness", p.force_smoothness},
          {"white_share", p.white_share},
          {"mesh_waves", p.mesh_waves},
          {"straight_within", p.straight_within},
          {"grid_share", p.grid_share},
          {"lasting_share", p.lasting_share},
          {"least_scale", p.least_scale},
          {"scale_ratio", p.scale_ratio},
          {"scales", p.scales},
          {"right_scale", p.right_scale},
          {"seen_right_scale", p.seen_right_scale},
          {"right_sd", p.right_sd},
          {"window_sd", p.window_sd},
          {"unknown_over", p.unknown_over},
          {"base_sd", p.base_sd},
          {"effect_sd", p.effect_sd},
          {"negligible_share", p.negligible_share},
          {"negligible_mm", p.negligible_mm},
          {"calibration_mm", p.calibration_mm},
          {"tells", p.tells},
          {"prior_none", p.prior_none},
          {"prior_unknown", p.prior_unknown},
          {"prior_two", p.prior_two},
          {"prior_three", p.prior_three},
          {"prior_beside", p.prior_beside},
          {"tempering", p.tempering},
          {"most_rounds", p.most_rounds},
          {"moves_on", p.moves_on},
          {"point_nats", p.point_nats},
          {"valleys", p.valleys},
          {"looks_at", p.looks_at},
          {"longest_step", p.longest_step},
          {"short_step", p.short_step},
          {"pairs_tried", p.pairs_tried},
          {"least_part", p.least_part},
          {"leaders", p.leaders},
          {"form_mm", p.form_mm},
          {"rig_size_share", p.rig_size_share},
          {"fabric_size_share", p.fabric_size_share},
          {"credible", p.credible},
          {"fast_share", p.fast_share}};
}

std::string protocol_hash(const Protocol& protocol, const std::vector<Effect>& effects) {
  std::string text = nlohmann::json(protocol).dump() + '\n' + estimate::code_version() + '\n';
  for (const Effect& e : effects) {
    text += e.name + '\n';
    for (const model::Parameter& p : e.parameters)
      text += fmt::format("  {} {} {} {} {} {}\n", p.name, p.unit, p.start, p.lower, p.upper, p.scale);
  }
  return files::sha256_hex(text);
}

}  // namespace selvedge::diagnose
