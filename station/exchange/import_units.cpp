#include "station/exchange/import_units.h"

#include <cmath>
#include <map>

#include <Eigen/LU>

#include "files/bad_input.h"

namespace selvedge::station {

Units read_units(files::Section keys) {
  Units units;
  units.length_m = keys.number("length_m", 1, 1e-9, 1e3, "m");
  units.time_s = keys.number("time_s", 1, 1e-9, 1e3, "s");
  const auto axes = keys.texts("axes", std::vector<std::string>{"x", "y", "z"});
  keys.finish();
  static const std::map<std::string, int> known = {{"x", 0}, {"y", 1}, {"z", 2}};
  if (axes.size() != 3) refuse(keys.where() + " axes", "found {} axes, expected three", axes.size());
  units.axes.setZero();
  for (int row = 0; row < 3; ++row) {
    const std::string& text = axes[static_cast<size_t>(row)];
    const bool minus = !text.empty() && text[0] == '-';
    const auto axis = known.find(minus ? text.substr(1) : text);
    if (axis == known.end())
      refuse(keys.where() + " axes", "found {}, expected x, y, z or one of them with a minus", in_quotes(text));
    units.axes(row, axis->second) = minus ? -1 : 1;
  }
  if (std::abs(units.axes.determinant() - 1) > 1e-9)
    refuse(keys.where() + " axes", "are not right-handed, or name an axis twice");
  return units;
}

}  // namespace selvedge::station
