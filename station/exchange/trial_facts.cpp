#include "station/exchange/trial_facts.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "capture/trial/trial_summary.h"
#include "report/text_table.h"

namespace selvedge::station {

using report::short_number;
using trial::Trial;

namespace {

std::string span_of_times(const trial::Sampling& sampling) {
  return fmt::format("{} s at {} Hz", short_number(sampling.last_s - sampling.first_s), short_number(sampling.rate_hz));
}

std::string gaps_of_times(const trial::Sampling& sampling) {
  if (sampling.gaps == 0) return "no gaps";
  return fmt::format("{} gaps, longest {} s", sampling.gaps, short_number(sampling.longest_gap_s, 3));
}

std::string frames_line(const trial::Frames& frames) {
  const size_t missing = trial::missing_numbers(frames);
  return fmt::format("{}, {}, {}", frames.number.size(), span_of_times(trial::sampling(frames.time_s)),
                     missing == 0 ? "no number missing" : fmt::format("{} numbers missing", missing));
}

std::string markers_line(const trial::MarkerSummary& markers) {
  return fmt::format("{} markers, {} times, {}, {} hidden, {}", markers.markers, markers.sampling.count,
                     span_of_times(markers.sampling), percent_of(markers.hidden_share),
                     gaps_of_times(markers.sampling));
}

std::string surface_line(const trial::Surface& surface) {
  const trial::Sampling sampling = trial::sampling(surface.time_s);
  const double points = static_cast<double>(surface.time_s.size()) / static_cast<double>(sampling.count);
  return fmt::format("{} clouds of {} points, {}, {}, {}", sampling.count, short_number(points, 3),
                     span_of_times(sampling), gaps_of_times(sampling),
                     surface.seen_from_m ? fmt::format("seen from {} m", fmt::join(*surface.seen_from_m, ", "))
                                         : "seen from a place not stated");
}

}  // namespace

std::string percent_of(double share) { return short_number(100 * share, 3) + " %"; }

std::string seen_by(const geometry::Projection& projection) {
  const bool distorted = projection.distortion != std::array<double, 5>{};
  return fmt::format("{} x {} px, {}", projection.width_px, projection.height_px,
                     distorted ? "distorted" : "without distortion");
}

std::string fabric_in_words(const Trial& trial) {
  const trial::Fabric& fabric = trial.fabric;
  return fmt::format("{}, {} x {} m, {} g{}, {} g/m²", fabric.name.empty() ? "(no name)" : fabric.name,
                     short_number(fabric.width_m), short_number(fabric.height_m), short_number(1e3 * fabric.mass_kg),
                     fabric.mass_known ? "" : " (guessed)", short_number(1e3 * trial::areal_mass(trial), 3));
}

std::string noise_in_words(const Trial& trial) {
  std::vector<std::string> parts;
  if (trial.mocap_noise_m) parts.push_back(short_number(1e3 * *trial.mocap_noise_m, 3) + " mm of the tracker");
  if (trial.noise_grey_levels) parts.push_back(short_number(*trial.noise_grey_levels, 3) + " grey levels");
  return parts.empty() ? "not stated" : fmt::format("{}", fmt::join(parts, ", "));
}

// Of a material test.
std::vector<std::string> material_test_in_words(const Trial& trial) {
  const auto mm = [](double m) { return short_number(1e3 * m, 4) + " mm"; };
  if (const auto& t = trial.cantilever)
    return {"strip", fmt::format("{}° from the warp, {} beyond the edge, bending length {}, midline of {} points",
                                 short_number(t->angle_deg), mm(t->overhang_m),
                                 t->bending_length_m ? mm(*t->bending_length_m) : "not given", t->midline_m.cols())};
  if (const auto& t = trial.cusick)
    return {"disc", fmt::format("{} across on a support of {}, {} captures", mm(t->disc_m), mm(t->support_m),
                                t->outlines.size())};
  size_t rows = 0;
  for (const trial::Pull& pull : trial.tensile->pulls) rows += pull.time_s.size();
  return {"strip",
          fmt::format("{}° from the warp, {} x {}, {} pulls, {} samples, force in {}",
                      short_number(trial.tensile->angle_deg), mm(trial.tensile->width_m), mm(trial.tensile->length_m),
                      trial.tensile->pulls.size(), rows, trial.tensile->force_unit)};
}

std::vector<std::vector<std::string>> facts_of(const Trial& trial) {
  if (trial::is_material_test(trial.experiment))
    return {
        {"experiment", to_text(trial.experiment)}, {"fabric", fabric_in_words(trial)}, material_test_in_words(trial)};
  const trial::Sampling corners = trial::sampling(trial.corners.time_s);
  return {{"experiment", to_text(trial.experiment)},
          {"state", to_text(trial.state)},
          {"held", to_text(trial.held)},
          {"fabric", fabric_in_words(trial)},
          {"start", trial.starts_at_rest ? "at rest" : "not known to be at rest"},
          {"gravity", fmt::format("{} m/s²", fmt::join(trial.gravity_m_s2, ", "))},
          {"camera", trial.camera ? seen_by(*trial.camera) : "none"},
          {"projector", trial.projector ? seen_by(*trial.projector) : "none"},
          {"stripes", trial.pattern ? fmt::format("period {} px, duty {}", short_number(trial.pattern->period_px),
                                                  short_number(trial.pattern->duty))
                                    : "none"},
          {"corners", fmt::format("{} samples, {}, hidden left {}, right {}, {}", trial.corners.time_s.size(),
                                  span_of_times(corners), percent_of(trial::hidden_share(trial.corners.left)),
                                  percent_of(trial::hidden_share(trial.corners.right)), gaps_of_times(corners))},
          {"frames", trial.frames ? frames_line(*trial.frames) : "none"},
          {"markers", trial.markers ? markers_line(trial::summary(*trial.markers)) : "none"},
          {"surface", trial.surface ? surface_line(*trial.surface) : "none"},
          {"robot", trial.robot ? fmt::format("{} samples, {}", trial.robot->time_s.size(),
                                              span_of_times(trial::sampling(trial.robot->time_s)))
                                : "none"},
          {"noise", noise_in_words(trial)}};
}

}  // namespace selvedge::station
