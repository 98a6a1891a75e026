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
#include "station/exchange/trial_facts.h"

namespace selvedge::cli {

namespace {

using report::short_number;
using trial::Trial;

void print_trial(const Trial& trial) {
  fmt::print("{}", report::text_table({"trial", trial.name}, station::facts_of(trial)));
}

std::vector<std::string> campaign_row(const Trial& trial) {
  if (trial::is_material_test(trial.experiment)) {
    std::vector<std::string> row(18, "-");
    row[0] = trial.name;
    row[1] = to_text(trial.experiment);
    row[3] = to_text(trial.state);
    return row;
  }
  const trial::Sampling corners = trial::sampling(trial.corners.time_s);
  const trial::MarkerSummary markers = trial.markers ? trial::summary(*trial.markers) : trial::MarkerSummary{};
  const trial::Sampling clouds = trial.surface ? trial::sampling(trial.surface->time_s) : trial::Sampling{};
  const double hidden = (trial::hidden_share(trial.corners.left) + trial::hidden_share(trial.corners.right)) / 2;
  return {trial.name,
          to_text(trial.experiment),
          to_text(trial.held),
          to_text(trial.state),
          short_number(corners.last_s - corners.first_s, 3),
          short_number(corners.rate_hz, 3),
          station::percent_of(hidden),
          std::to_string(corners.gaps),
          trial.frames ? std::to_string(trial.frames->number.size()) : "-",
          trial.frames ? short_number(trial::sampling(trial.frames->time_s).rate_hz, 3) : "-",
          trial.frames ? std::to_string(trial::missing_numbers(*trial.frames)) : "-",
          trial.markers ? std::to_string(markers.markers) : "-",
          trial.markers ? std::to_string(markers.sampling.count) : "-",
          trial.markers ? short_number(markers.sampling.rate_hz, 3) : "-",
          trial.markers ? station::percent_of(markers.hidden_share) : "-",
          trial.surface ? std::to_string(clouds.count) : "-",
          trial.surface ? std::to_string(trial.surface->time_s.size() / clouds.count) : "-",
          trial.surface ? short_number(clouds.rate_hz, 3) : "-"};
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
             station::fabric_in_words(first), first.camera ? station::seen_by(*first.camera) : "none",
             first.projector ? station::seen_by(*first.projector) : "none", station::noise_in_words(first));
  for (const auto& group : campaign.replicates) fmt::print("same motion: {}\n", fmt::join(group, ", "));
  std::vector<std::vector<std::string>> rows;
  for (const Trial& trial : campaign.trials) rows.push_back(campaign_row(trial));
  std::vector<std::string> header = {"trial",  "experiment", "held",   "state",  "s",           "corners Hz",
                                     "hidden", "gaps",       "frames", "Hz",     "missing",     "markers",
                                     "times",  "Hz",         "hidden", "clouds", "points each", "Hz"};
  drop_empty_columns(header, rows);
  fmt::print("\n{}", report::text_table(header, rows));
  for (const Trial& trial : campaign.trials)
    if (trial::is_material_test(trial.experiment))
      fmt::print("{}: {}\n", trial.name, station::material_test_in_words(trial)[1]);
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
  if (trial.surface) remark("points", trial.surface->time_s);
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
