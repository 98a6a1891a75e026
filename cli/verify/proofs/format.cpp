// `./selvedge prove format`: a trial comes back from disk unchanged, and every damage to one is refused.
#include <cmath>
#include <cstring>
#include <fstream>

#include "capture/trial/trial_writer.h"
#include "cli/verify/figures.h"
#include "cli/verify/proofs/damaged_trials.h"
#include "files/bad_input.h"
#include "files/csv_table.h"
#include "files/whole_file.h"

namespace selvedge::cli {

namespace fs = std::filesystem;

namespace {

// Doubles whose bits differ; two NaNs count as equal.
size_t changed(const double* a, const double* b, size_t count) {
  size_t different = 0;
  for (size_t i = 0; i < count; ++i)
    different += std::memcmp(&a[i], &b[i], sizeof(double)) != 0 && !(std::isnan(a[i]) && std::isnan(b[i]));
  return different;
}

struct RoundTrip {
  size_t numbers = 0, changed_numbers = 0, pixels = 0, changed_pixels = 0;

  void compare(const double* a, const double* b, size_t count) {
    numbers += count;
    changed_numbers += changed(a, b, count);
  }
  void compare(const std::vector<double>& a, const std::vector<double>& b) {
    if (a.size() != b.size()) changed_numbers += a.size() + b.size();
    else compare(a.data(), b.data(), a.size());
  }
  void compare(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b) {
    if (a.cols() != b.cols()) changed_numbers += static_cast<size_t>(a.size() + b.size());
    else compare(a.data(), b.data(), static_cast<size_t>(a.size()));
  }
};

void compare_trials(const ExampleTrial& example, const trial::Trial& back, RoundTrip& result) {
  const trial::Trial& t = example.trial;
  result.compare(t.corners.time_s, back.corners.time_s);
  result.compare(t.corners.left, back.corners.left);
  result.compare(t.corners.right, back.corners.right);
  result.compare(t.frames->time_s, back.frames->time_s);
  result.compare(t.markers->time_s, back.markers->time_s);
  result.compare(t.markers->position, back.markers->position);
  result.compare(t.robot->commanded, back.robot->commanded);
  result.compare(t.robot->measured, back.robot->measured);
  result.compare(t.camera->matrix.data(), back.camera->matrix.data(), 12);
  result.compare(t.projector->matrix.data(), back.projector->matrix.data(), 12);
  result.compare(t.camera->distortion.data(), back.camera->distortion.data(), 5);
  result.compare(t.gravity_m_s2.data(), back.gravity_m_s2.data(), 3);
  result.compare(t.clamp_direction.data(), back.clamp_direction.data(), 3);
  const std::vector<double> scalars = {t.fabric.width_m, t.fabric.height_m, t.fabric.mass_kg,     t.exposure_s,
                                       t.frame_rate_hz,  *t.mocap_noise_m,  *t.noise_grey_levels, t.pattern->period_px};
  result.compare(scalars, {back.fabric.width_m, back.fabric.height_m, back.fabric.mass_kg, back.exposure_s,
                           back.frame_rate_hz, *back.mocap_noise_m, *back.noise_grey_levels, back.pattern->period_px});
  for (size_t i = 0; i < example.images.size(); ++i) {
    const trial::GreyImage image = trial::read_frame(back, i);
    result.pixels += static_cast<size_t>(image.size());
    result.changed_pixels += static_cast<size_t>((image.array() != example.images[i].array()).count());
  }
}

// Every length to which a CSV file can be cut: only cuts between two lines may be read.
size_t cuts_read_inside_a_line(const fs::path& path) {
  const std::string whole = files::read_whole(path);
  size_t wrong = 0;
  for (size_t length = 0; length < whole.size(); ++length) {
    if (length > 0 && whole[length - 1] == '\n') continue;
    std::ofstream(path, std::ios::binary).write(whole.data(), static_cast<std::streamsize>(length));
    try {
      files::read_csv(path, {{"t_s"}});
      ++wrong;
    } catch (const BadInput&) {}
  }
  return wrong;
}

}  // namespace

std::vector<Figure> prove_format(const FigureOptions& options) {
  const std::string source = "exchange format, version 1";
  ScratchFolder scratch;
  RoundTrip round_trip;
  const int repeats = options.quick ? 1 : 6;
  for (int i = 0; i < repeats; ++i) {
    const ExampleTrial example = example_trial(options.seed + static_cast<unsigned>(i));
    const fs::path folder = scratch.path() / "sound" / std::to_string(i);
    trial::write_trial(example.trial, folder, example.images);
    compare_trials(example, trial::read_trial(folder), round_trip);
    options.progress(0.5 * (i + 1) / repeats, "round trips");
  }

  const fs::path sound = scratch.path() / "sound" / "0", copy = scratch.path() / "trial";
  double refused = 0, naming = 0, read = 0;
  for (const Damage& damage : damages()) {
    fs::remove_all(copy);
    fs::copy(sound, copy, fs::copy_options::recursive);
    damage.apply(copy);
    const std::string text = refusal_of(copy);
    refused += !text.empty();
    naming += text.find(damage.culprit) != std::string::npos && text.find('\n') == std::string::npos;
  }
  for (const Damage& change : harmless_changes()) {
    fs::remove_all(copy);
    fs::copy(sound, copy, fs::copy_options::recursive);
    change.apply(copy);
    read += refusal_of(copy).empty();
  }
  options.progress(0.8, "damages");
  fs::remove_all(copy);
  fs::copy(sound, copy, fs::copy_options::recursive);
  const double wrong_cuts = static_cast<double>(cuts_read_inside_a_line(copy / "corners.csv"));
  options.progress(1, "cuts");

  const double damage_count = static_cast<double>(damages().size());
  const double change_count = static_cast<double>(harmless_changes().size());
  return {
      {"numbers changed by writing and reading, of " + std::to_string(round_trip.numbers),
       static_cast<double>(round_trip.changed_numbers), 0, "numbers", Relation::at_most, source},
      {"pixels changed by writing and reading, of " + std::to_string(round_trip.pixels),
       static_cast<double>(round_trip.changed_pixels), 0, "pixels", Relation::at_most, source},
      {"kinds of damage refused", refused, damage_count, "trials", Relation::at_least, source},
      {"refusals on one line that name the culprit", naming, damage_count, "trials", Relation::at_least, source},
      {"trials read that lack optional parts", read, change_count, "trials", Relation::at_least, source},
      {"cuts inside a line of corners.csv that were read", wrong_cuts, 0, "files", Relation::at_most, source},
  };
}

}  // namespace selvedge::cli
