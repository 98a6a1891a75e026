// The constants of a diagnosis that were measured or chosen, with where each was set. A blind check seals them whole;
// the code, whose hash is sealed too (protocol_hash), holds no others.
//
// ln: of a base coordinate.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace selvedge::diagnose {

struct Effect;

struct Protocol {
  // Grids and rates.
  long coarse_cells = 10, cells = 0;        // of a fit's start, along the width; 0: chosen by the bending length
  double lengths_a_cell = 1;                // bending lengths, where it is chosen
  double seen_lengths_a_cell = 0.67;        // of trials of pictures
  long most_cells = 30;                     // that are chosen so
  double finer = 1.5;                       // times as many, to see what the grid does
  double coarser = 1.5;                     // times as few, on which the way to where a set is likeliest is found
  double rate_hz = 30, image_rate_hz = 10;  // observations are averaged, or thinned, to these
  double seen_apart = 0.14;                 // of the width: points of a picture

  // What recordings show by themselves (measured.h), and how much of them is looked at (model/excerpts.h).
  double most_delay_s = 0.5;
  double most_motion_s = 9, lead_s = 0.4;  // on coarse_cells; on more in inverse proportion

  // The base fit, where no fit was made before: nudging gains towards markers, and what ends it.
  double nudging_per_s = 10, harder = 2;
  double enough = 1e-3, near_enough = 1e-2;  // of the cost: smaller decreases end it; that of its start

  // Where the windows begin: damping and drag so near to what is usual (ln), shear in shares of the stretch stiffness.
  double usual_within = 1.4, least_shear = 0.1, most_shear = 1;

  // Windows (windows.h).
  double free_s = 0.25, hold_per_s = 20;
  double image_window_s = 0.5;

  // Derivatives.
  double base_difference = 0.06;  // ln
  long columns_again = 31;        // of effects, whose derivatives are taken again where a set is likeliest

  // Model error (evidence.h). A smooth force of usual size is so large a share of the fabric's weight.
  long force_waves = 3;
  double force_share = 0.01, force_smoothness = 0.3;
  double white_share = 0.3;       // of what the forces do to a row, that no smooth force makes
  double grid_share = 0.5;        // of what a finer grid changes
  long mesh_waves = 6;            // patterns along each side of a picture, of 0, 1, 2 … half waves
  double straight_within = 0.15;  // ln: how far the base is moved along derivatives
  double lasting_share = 1;       // of their usual size: smooth forces that are the same in all windows
  double least_scale = 0.125, scale_ratio = 1.4142135623730951;
  long scales = 18;
  // Median and ln deviation of s in a right model; the median where only cameras look: less, for there the sheet runs
  // free for longer, and a force leads further.
  double right_scale = 1, seen_right_scale = 0.125, right_sd = 0.3;
  double window_sd = 0.5;   // ln deviation of a window's model error from s
  double unknown_over = 2;  // times the median: where something unknown begins

  // Priors.
  double base_sd = 1;    // ln
  double effect_sd = 2;  // scales
  // Of an effect that is said not to be there: of its scale, and rms in the windows beyond a refit of the base.
  double negligible_share = 0.3, negligible_mm = 0.03;
  double calibration_mm = 0.06;  // instead, of what only a camera sees: about a tenth of a projector's row
  double tells = 0.6;            // of effect_sd: an effect of which more is negligible cannot be told
  double prior_none = 0.38, prior_unknown = 0.12, prior_two = 0.1, prior_three = 0.02;  // the rest: one effect
  double prior_beside = 0.15;  // of a set of effects: something unknown beside
  double tempering = 1;        // power of the evidence

  // Where the leaders stand.
  long most_rounds = 8;    // on the coarse grid, and then on the usual one
  double moves_on = 4;     // nats: a step that gains less is the last
  double point_nats = 30;  // by which the evidence of one model differs from one likeliest point to another
  long valleys = 3;        // times that the way to where a set is likeliest may lead the base elsewhere
  double looks_at = 1;     // nats: a set that gains so much on none is looked at where it stands, too
  double longest_step = 0.7, short_step = 0.1;  // ln; the second where the first leads nowhere
  long pairs_tried = 5;                         // that a third effect is tried beside

  // What is told.
  double least_part = 0.1;  // of what a right model would take of the gap: an effect that takes less is not named
  long leaders = 6;         // sets of effects that are sized, and whose reduction is found
  double form_mm = 0.4;  // in space, that a right model leaves beside the sensor's noise, of predictions free_s ahead
  // Standard deviation of a named effect's size about the true one, over that, beside what the evidence shows: of the
  // rig, its clock and the air, and of what the fabric is.
  double rig_size_share = 0.15, fabric_size_share = 0.3;
  double credible = 0.9;    // of the confusable set
  double fast_share = 0.5;  // of the held corners' top speed: faster is fast
};

// Of form_mm along one axis, as a marker's residual on one is, or a depth along its ray.
double form_along_an_axis_mm(const Protocol& protocol);

// Each member by its name.
void to_json(nlohmann::json& json, const Protocol& protocol);

// SHA-256, hexadecimal, of the protocol, of the effects with their parameters, and of the code.
std::string protocol_hash(const Protocol& protocol, const std::vector<Effect>& effects);

}  // namespace selvedge::diagnose
