// The constants of a diagnosis that were measured or chosen, with where each was set. A blind check seals them whole;
// how often and how damped its fits step is part of the code, whose hash is sealed too (protocol_hash).
//
// "The bank" are 19 campaigns of the simulated world and four whose key is known (docs/diagnosis-measured.md); what is
// said of motions that run free rests on few. ln: of a base coordinate, or of an error, as it says.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace selvedge::diagnose {

struct Effect;

struct Protocol {
  // Grids, rates, and how simulations are held.
  long coarse_cells = 10, cells = 0;        // of the start and of derivatives, along the width; 0: one a bending length
  long most_cells = 32;                     // that are chosen so
  double finer = 1.5;                       // times as many: what derivatives are derivatives of
  double rate_hz = 30, image_rate_hz = 10;  // observations are thinned to these
  double nudging_per_s = 10;                // nudging gain of fits and judging (cloth/guide.h); 0: simulations run free
  double still_samples = 6;                 // samples of a moving trial that one of a still trial weighs as much as
  double sample_cut = 6;       // robust standard deviations of a trial's residual, at which single samples are cut
  double harder = 2;           // times the gain, for trials that leave the recorded folds all the same
  double lost_mm = 6;          // models that keep the folds were never found so far off under nudging
  double parted_mm = 1.5;      // between two grids: one went another way
  double largest_grid_mm = 3;  // change by a finer grid up to which it is a correction, where the fit leaves less

  // The base fit.
  double enough = 1e-3, near_enough = 1e-2;  // of the cost: smaller decreases end it; one that is refitted after
  double base_difference = 0.06;             // ln, of its derivatives
  double updated_within = 0.2;               // ln: derivatives updated by Broyden's rule serve within it
  double isotropic_shear = 0.4;              // of the stretch stiffness: an isotropic sheet of Poisson's ratio 1/4
  double isotropic_within = 0.2;             // ln
  double other_start_gain = 0.99;            // of the cost, below which a fit from another start is kept

  // Hypotheses.
  double base_step = 0.08, effect_step = 0.3;  // of derivatives afresh: ln, and scales of an effect
  long finalists = 4;                          // effects that are refitted on the fine grid and held out
  double far = 0.3;                            // ln, from the base fit: derivatives are taken afresh
  double far_cost = 0.15;                      // of the cost: a full refit that gained so much goes on once more
  double full_refit_enough = 2e-4;             // of the cost
  double plainly_none = 0.65;                  // probability of none from which no effect is fitted further
  double pair_gain = 0.2;   // ln of the error's square that a second effect could win, for one to be sought
  long pairs = 3;           // that are refitted
  double absorbed = 0.995;  // share of an effect's trace beyond which a refit of the base hides it

  // The verdict (verdict.h): set on the bank.
  double kappa = 12, free_kappa = 6;  // of trials that run free, which swing by chance
  double cost_per_parameter = 0.85, cost_unknown = 6.0;
  double prior_none = 0.38, prior_unknown = 0.15;   // the rest is shared by the effects alike
  double two_share = 0.1;                           // two effects at once, before one: shared by all pairs alike
  double grid_share = 0.3, still_grid_share = 0.7;  // of still trials: a fold that a finer grid moves, any form moves
  double form_mm = 0.15;
  double free_form_mm = 0.8;  // right models were 0.5 and 1.1 mm off in null campaigns of markers
  double form_share = 0.3;    // of the base's held-out error: a right effect of another form leaves so much
  // Of ln(held-out base error / what a right model leaves) in null campaigns: mean and spread. Nudged: five of the bank
  // (-0.21 … 0.02); free: supposed from two of images.
  double null_mean = -0.12, null_sd = 0.1, free_null_mean = 0.1, free_null_sd = 0.2;
  double null_freedom = 4;  // of Student's distribution about it
  double plain_gap = 0.05;  // p-value from which `none` loses by as much as it is smaller
  double credible = 0.9;    // of the confusable set

  // What is told.
  double ahead_s = 0.25, ahead_nudging_per_s = 20;  // predictions a short time ahead (ahead.h)
  long bootstraps = 2000;
  long run_free = 2;        // effects whose gap reduction is looked at; where the answer is none, one
  double fast_share = 0.5;  // of the held corners' top speed: faster is fast
  // Standard deviation of a named effect's size about the true one, over that, beside what trials show: of the rig, its
  // clock and the air, and of what the fabric is. Of 17 causes named right the first were off by 0.01 to 0.29, the
  // others by 0.1 to 0.6.
  double rig_size_share = 0.15, fabric_size_share = 0.3;
};

// Each member by its name.
void to_json(nlohmann::json& json, const Protocol& protocol);

// SHA-256, hexadecimal, of the protocol, of the effects with their parameters, and of the code.
std::string protocol_hash(const Protocol& protocol, const std::vector<Effect>& effects);

}  // namespace selvedge::diagnose
