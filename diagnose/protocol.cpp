#include "diagnose/protocol.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "diagnose/effects/effect.h"
#include "estimate/kept_input.h"
#include "files/sha256.h"

namespace selvedge::diagnose {

void to_json(nlohmann::json& json, const Protocol& p) {
  json = {{"coarse_cells", p.coarse_cells},
          {"cells", p.cells},
          {"most_cells", p.most_cells},
          {"finer", p.finer},
          {"rate_hz", p.rate_hz},
          {"image_rate_hz", p.image_rate_hz},
          {"nudging_per_s", p.nudging_per_s},
          {"still_samples", p.still_samples},
          {"sample_cut", p.sample_cut},
          {"harder", p.harder},
          {"lost_mm", p.lost_mm},
          {"parted_mm", p.parted_mm},
          {"largest_grid_mm", p.largest_grid_mm},
          {"enough", p.enough},
          {"near_enough", p.near_enough},
          {"base_difference", p.base_difference},
          {"updated_within", p.updated_within},
          {"isotropic_shear", p.isotropic_shear},
          {"isotropic_within", p.isotropic_within},
          {"other_start_gain", p.other_start_gain},
          {"base_step", p.base_step},
          {"effect_step", p.effect_step},
          {"finalists", p.finalists},
          {"far", p.far},
          {"far_cost", p.far_cost},
          {"full_refit_enough", p.full_refit_enough},
          {"plainly_none", p.plainly_none},
          {"pair_gain", p.pair_gain},
          {"pairs", p.pairs},
          {"absorbed", p.absorbed},
          {"kappa", p.kappa},
          {"free_kappa", p.free_kappa},
          {"cost_per_parameter", p.cost_per_parameter},
          {"cost_unknown", p.cost_unknown},
          {"prior_none", p.prior_none},
          {"prior_unknown", p.prior_unknown},
          {"two_share", p.two_share},
          {"grid_share", p.grid_share},
          {"still_grid_share", p.still_grid_share},
          {"form_mm", p.form_mm},
          {"free_form_mm", p.free_form_mm},
          {"form_share", p.form_share},
          {"null_mean", p.null_mean},
          {"null_sd", p.null_sd},
          {"free_null_mean", p.free_null_mean},
          {"free_null_sd", p.free_null_sd},
          {"null_freedom", p.null_freedom},
          {"plain_gap", p.plain_gap},
          {"credible", p.credible},
          {"ahead_s", p.ahead_s},
          {"ahead_nudging_per_s", p.ahead_nudging_per_s},
          {"bootstraps", p.bootstraps},
          {"run_free", p.run_free},
          {"fast_share", p.fast_share},
          {"rig_size_share", p.rig_size_share},
          {"fabric_size_share", p.fabric_size_share}};
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
