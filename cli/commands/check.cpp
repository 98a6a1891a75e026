// `./selvedge check PATH`: what a trial or campaign holds, or why it is refused.
#include <algorithm>
#include <memory>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "capture/trial/doubts.h"
#include "capture/trial/trial.h"
#include "capture/trial/trial_summary.h"
#include "cli/command.h"
#include "report/text_table.h"

namespace selvedge::cli {

namespace {

using report::short_number;
using trial::Trial;

std::string percent(double share) { return short_number(100 * share, 3) + " %"; }

std::string span(const trial::Sampling& sampling) {
  return fmt::format("{} s at {} Hz", short_number(sampling.last_s - sampling.first_s), short_number(sampling.rate_hz));
}

std::string gaps(const trial::Sampling& sampling) {
  if (sampling.gaps == 0) return "no gaps";
  return fmt::format("{} gaps, longest {} s", sampling.gaps, short_number(sampling.longest_gap_s, 3));
}

std::string seen_by(const geometry::Projection& projection) {
  const bool distorted = projection.distortion != std::array<double, 5>{};
  return fmt::format("{} x {} px, {}", projection.width_px, projection.height_px,
                     distorted ? "distorted" : "without distortion");
}

std::string fabric_line(const Trial& trial) {
  const trial::Fabric& fabric = trial.fabric;
  return fmt::format("{}, {} x {} m, {} g{}, {} g/m²", fabric.name.empty() ? "(no name)" : fabric.name,
                     short_number(fabric.width_m), short_number(fabric.height_m), short_number(1e3 * fabric.mass_kg),
                     fabric.mass_known ? "" : " (guessed)", short_number(1e3 * trial::areal_mass(trial), 3));
}

std::string noise_line(const Trial& trial) {
  std::vector<std::string> parts;
  if (trial.mocap_noise_m) parts.push_back(short_number(1e3 * *trial.mocap_noise_m, 3) + " mm of the tracker");
  if (trial.noise_grey_levels) parts.push_back(short_number(*trial.noise_grey_levels, 3) + " grey levels");
  return parts.empty() ? "not stated" : fmt::format("{}", fmt::join(parts, ", "));
}

std::string frames_line(const trial::Frames& frames) {
  const size_t missing = trial::missing_numbers(frames);
  return fmt::format("{}, {}, {}", frames.number.size(), span(trial::sampling(frames.time_s)),
                     missing == 0 ? "no number missing" : fmt::format("{} numbers missing", missing));
}

std::string markers_line(const trial::MarkerSummary& markers) {
  return fmt::format("{} markers, {} times, {}, {} hidden, {}", markers.markers, markers.sampling.count,
                     span(markers.sampling), percent(markers.hidden_share), gaps(markers.sampling));
}

// Of a material test.
std::vector<std::string> test_row(const Trial& trial) {
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

void print_trial(const Trial& trial) {
  if (trial::is_material_test(trial.experiment)) {
    fmt::print("{}", report::text_table(
                         {"trial", trial.name},
                         {{"experiment", to_text(trial.experiment)}, {"fabric", fabric_line(trial)}, test_row(trial)}));
    return;
  }
  const trial::Sampling corners = trial::sampling(trial.corners.time_s);
  std::vector<std::vector<std::string>> rows = {
      {"experiment", to_text(trial.experiment)},
      {"state", to_text(trial.state)},
      {"held", to_text(trial.held)},
      {"fabric", fabric_line(trial)},
      {"start", trial.starts_at_rest ? "at rest" : "not known to be at rest"},
      {"gravity", fmt::format("{} m/s²", fmt::join(trial.gravity_m_s2, ", "))},
      {"camera", trial.camera ? seen_by(*trial.camera) : "none"},
      {"projector", trial.projector ? seen_by(*trial.projector) : "none"},
      {"stripes", trial.pattern ? fmt::format("period {} px, duty {}", short_number(trial.pattern->period_px),
                                              short_number(trial.pattern->duty))
                                : "none"},
      {"corners", fmt::format("{} samples, {}, hidden left {}, right {}, {}", trial.corners.time_s.size(),
                              span(corners), percent(trial::hidden_share(trial.corners.left)),
                              percent(trial::hidden_share(trial.corners.right)), gaps(corners))},
      {"frames", trial.frames ? frames_line(*trial.frames) : "none"},
      {"markers", trial.markers ? markers_line(trial::summary(*trial.markers)) : "none"},
      {"robot", trial.robot ? fmt::format("{} samples, {}", trial.robot->time_s.size(),
                                          span(trial::sampling(trial.robot->time_s)))
                            : "none"},
      {"noise", noise_line(trial)}};
  fmt::print("{}", report::text_table({"trial", trial.name}, rows));
}

std::vector<std::string> campaign_row(const Trial& trial) {
  if (trial::is_material_test(trial.experiment)) {
    std::vector<std::string> row(15, "-");
    row[0] = trial.name;
    row[1] = to_text(trial.experiment);
    row[3] = to_text(trial.state);
    return row;
  }
  const trial::Sampling corners = trial::sampling(trial.corners.time_s);
  const trial::MarkerSummary markers = trial.markers ? trial::summary(*trial.markers) : trial::MarkerSummary{};
  const double hidden = (trial::hidden_share(trial.corners.left) + trial::hidden_share(trial.corners.right)) / 2;
  return {trial.name,
          to_text(trial.experiment),
          to_text(trial.held),
          to_text(trial.state),
          short_number(corners.last_s - corners.first_s, 3),
          short_number(corners.rate_hz, 3),
          percent(hidden),
          std::to_string(corners.gaps),
          trial.frames ? std::to_string(trial.frames->number.size()) : "-",
          trial.frames ? short_number(trial::sampling(trial.frames->time_s).rate_hz, 3) : "-",
          trial.frames ? std::to_string(trial::missing_numbers(*trial.frames)) : "-",
          trial.markers ? std::to_string(markers.markers) : "-",
          trial.markers ? std::to_string(markers.sampling.count) : "-",
          trial.markers ? short_number(markers.sampling.rate_hz, 3) : "-",
          trial.markers ? percent(markers.hidden_share) : "-"};
}

void drop_empty_columns(std::vector<std::string>& header, std::vector<std::vector<std::string>>& rows) {
  for (size_t c = header.size(); c-- > 0;) {
    if (!std::all_of(rows.begin(), rows.end(), [c](const auto& row) { return row[c] == "-"; })) continue;
    const auto at = static_cast<std::ptrdiff_t>(c);
    header.erase(header.begin() + at);
    for (auto& row : rows) row.erase(row.begin() + at);
  }
}

void print_campaign(const trial::Campaign& campaign) {
  const Trial& first = campaign.trials.front();
  fmt::print("campaign of {} trials\nfabric: {}\ncamera: {}\nprojector: {}\nnoise: {}\n", campaign.trials.size(),
             fabric_line(first), first.camera ? seen_by(*first.camera) : "none",
             first.projector ? seen_by(*first.projector) : "none", noise_line(first));
  for (const auto& group : campaign.replicates) fmt::print("same motion: {}\n", fmt::join(group, ", "));
  std::vector<std::vector<std::string>> rows;
  for (const Trial& trial : campaign.trials) rows.push_back(campaign_row(trial));
  std::vector<std::string> header = {"trial",      "experiment", "held",  "state",  "s",
                                     "corners Hz", "hidden",     "gaps",  "frames", "Hz",
                                     "missing",    "markers",    "times", "Hz",     "hidden"};
  drop_empty_columns(header, rows);
  fmt::print("\n{}", report::text_table(header, rows));
  for (const Trial& trial : campaign.trials)
    if (trial::is_material_test(trial.experiment)) fmt::print("{}: {}\n", trial.name, test_row(trial)[1]);
}

// What was passed over on reading.
void print_damage(const Trial& trial) {
  for (const std::string& sentence : trial.damaged) fmt::print("damaged: {}: {}\n", trial.name, sentence);
}

// An observation outside the times of the corners has no motion to compare it with.
void print_remarks(const Trial& trial) {
  const trial::Sampling corners = trial::sampling(trial.corners.time_s);
  const auto remark = [&](const char* what, const std::vector<double>& times_s) {
    const auto outside = std::count_if(times_s.begin(), times_s.end(),
                                       [&](double t) { return t < corners.first_s || t > corners.last_s; });
    if (outside > 0)
      fmt::print("note: {}: {} of {} {} lie outside the corners' times, {} to {} s\n", trial.name, outside,
                 times_s.size(), what, short_number(corners.first_s), short_number(corners.last_s));
  };
  if (trial.frames) remark("frames", trial.frames->time_s);
  if (trial.markers) remark("marker samples", trial.markers->time_s);
}

// Headers were checked on reading; here every pixel is decoded.
void decode_all(const Trial& trial) {
  if (!trial.frames) return;
  for (size_t i = 0; i < trial.frames->path.size(); ++i) read_frame(trial, i);
}

void check(const std::string& path) {
  const trial::Campaign campaign = trial::read_campaign(path);
  for (const Trial& trial : campaign.trials) decode_all(trial);
  if (std::filesystem::exists(std::filesystem::path(path) / "campaign.json")) print_campaign(campaign);
  else print_trial(campaign.trials.front());
  for (const Trial& trial : campaign.trials) {
    print_damage(trial);
    print_remarks(trial);
  }
  for (const std::string& doubt : trial::doubts(campaign)) fmt::print("doubt: {}\n", doubt);
}

}  // namespace

void add_check(CLI::App& app, int&) {
  CLI::App* sub = app.add_subcommand("check", "Say what a trial or campaign holds, or refuse it");
  auto path = std::make_shared<std::string>();
  sub->add_option("PATH", *path, "Folder of a trial or campaign")->required();
  sub->callback([path] { check(*path); });
}

}  // namespace selvedge::cli
