#include "python/sound_trial.h"

#include <algorithm>

#include "files/bad_input.h"

namespace selvedge::python {

namespace {

std::string part(const trial::Trial& t, const char* name) {
  return fmt::format("trial {}: {}", t.name.empty() ? "without a name" : t.name, name);
}

template <class... Sizes>
void expect_length(const std::string& where, size_t rows, Sizes... sizes) {
  for (const auto size : {static_cast<size_t>(sizes)...})
    if (size != rows) refuse(where, "found an array of {} rows, expected {} as time_s has", size, rows);
}

void expect_ascending(const std::string& where, const std::vector<double>& time_s) {
  for (size_t i = 1; i < time_s.size(); ++i)
    if (!(time_s[i] >= time_s[i - 1]))
      refuse(where + ".time_s", "found {} s after {} s, expected ascending times", time_s[i], time_s[i - 1]);
}

}  // namespace

void expect_sound(const trial::Trial& t) {
  const std::pair<const char*, double> sizes[] = {{"fabric.width_m", t.fabric.width_m},
                                                  {"fabric.height_m", t.fabric.height_m},
                                                  {"fabric.mass_kg", t.fabric.mass_kg}};
  for (const auto& [name, size] : sizes)
    if (!(size > 0)) refuse(part(t, name), "found {}, expected a number above 0", size);
  expect_length(part(t, "corners"), t.corners.time_s.size(), t.corners.left.cols(), t.corners.right.cols());
  expect_ascending(part(t, "corners"), t.corners.time_s);
  if (!trial::is_material_test(t.experiment) && t.corners.time_s.empty())
    refuse(part(t, "corners"), "found no samples, expected the two held corners");
  if (t.markers) {
    expect_length(part(t, "markers"), t.markers->time_s.size(), t.markers->marker.size(), t.markers->uv.size(),
                  t.markers->position.cols());
    expect_ascending(part(t, "markers"), t.markers->time_s);
  }
  if (t.surface) {
    expect_length(part(t, "surface"), t.surface->time_s.size(), t.surface->position.cols());
    expect_ascending(part(t, "surface"), t.surface->time_s);
  }
  if (t.robot)
    expect_length(part(t, "robot"), t.robot->time_s.size(), t.robot->commanded.cols(), t.robot->measured.cols());
  if (t.frames) expect_length(part(t, "frames"), t.frames->time_s.size(), t.frames->number.size());
}

void expect_sound(const trial::Campaign& campaign) {
  if (campaign.trials.empty()) refuse("Campaign.trials", "found none, expected at least one");
  for (const trial::Trial& t : campaign.trials) expect_sound(t);
}

}  // namespace selvedge::python
