#include "rig/projector/flash_table.h"

#include <algorithm>

#include "files/bad_input.h"
#include "files/toml_text.h"

namespace selvedge::projector {

namespace {

constexpr int kPlanes = 24;
constexpr int kImages = 64;

// Keys of one table, each read once; the rest is refused.
class Keys {
 public:
  Keys(std::string where, const toml::table& table) : where_(std::move(where)), table_(table) {}

  double number(const std::string& key, std::optional<double> fallback, double least, double most) {
    read_.push_back(key);
    const auto value = table_[key].value<double>();
    if (!value && (table_.contains(key) || !fallback)) refuse(where_ + " " + key, "a number expected");
    return in_range(key, value.value_or(fallback.value_or(0)), least, most);
  }
  std::string choice(const std::string& key, const std::vector<std::string>& allowed) {
    read_.push_back(key);
    const auto value = table_[key].value<std::string>();
    if (!value || std::find(allowed.begin(), allowed.end(), *value) == allowed.end())
      refuse(where_ + " " + key, "found {}, expected \"{}\" or \"{}\"", value.value_or("no text"), allowed[0],
             allowed[1]);
    return *value;
  }
  std::vector<double> list(const std::string& key, double least, double most) {
    read_.push_back(key);
    const auto* array = table_[key].as_array();
    if (array == nullptr || array->empty()) refuse(where_ + " " + key, "a list of numbers expected");
    std::vector<double> values;
    for (const auto& entry : *array) {
      const auto value = entry.value<double>();
      if (!value) refuse(where_ + " " + key, "a list of numbers expected");
      values.push_back(in_range(key, *value, least, most));
    }
    return values;
  }
  void finish() const {
    for (const auto& [key, value] : table_)
      if (std::find(read_.begin(), read_.end(), key.str()) == read_.end())
        refuse(where_ + " " + std::string(key.str()), "unknown key");
  }

 private:
  double in_range(const std::string& key, double value, double least, double most) const {
    if (!(value >= least && value <= most))
      refuse(where_ + " " + key, "found {}, expected {} to {}", value, least, most);
    return value;
  }
  std::string where_;
  const toml::table& table_;
  std::vector<std::string> read_;
};

Pattern read_stripes(Keys& keys) {
  Pattern pattern;
  pattern.kind = PatternKind::stripes;
  pattern.duty = keys.number("duty", 0.5, 0, 1);
  pattern.first_bright_row_px = keys.number("first_bright_row_px", 0, -1e4, 1e4);
  return pattern;
}

void read_planes(Keys& keys, const std::string& where, FlashTable& table) {
  const int image = static_cast<int>(keys.number("image", std::nullopt, 0, kImages - 1));
  int plane = static_cast<int>(keys.number("first_plane", std::nullopt, 0, kPlanes - 1));
  const bool gray = keys.choice("kind", {"gray_code", "stripes"}) == "gray_code";
  Pattern pattern;
  if (!gray) pattern = read_stripes(keys);
  pattern.kind = gray ? PatternKind::gray_code : PatternKind::stripes;
  pattern.orientation = keys.choice("orientation", {"horizontal", "vertical"}) == "vertical" ? Orientation::vertical
                                                                                             : Orientation::horizontal;
  for (const double value : gray ? keys.list("bits", 0, 30) : keys.list("period_px", 1, 4096)) {
    if (gray) pattern.bit = static_cast<int>(value);
    else pattern.period_px = value;
    if (plane >= kPlanes) refuse(where, "image {} has {} planes, more are listed", image, kPlanes);
    if (table.at(image, plane) != nullptr) refuse(where, "image {} plane {} is listed twice", image, plane);
    table.planes.push_back({image, plane++, pattern});
  }
}

}  // namespace

const FlashPlane* FlashTable::find(const Pattern& pattern) const {
  const auto same = [&](const FlashPlane& plane) {
    Pattern wanted = canonical(pattern);
    wanted.level = plane.pattern.level;
    wanted.inverted = plane.pattern.inverted;
    return plane.pattern == wanted;
  };
  const auto found = std::find_if(planes.begin(), planes.end(), same);
  return found == planes.end() ? nullptr : &*found;
}

const Pattern* FlashTable::at(int image, int plane) const {
  const auto found = std::find_if(planes.begin(), planes.end(), [&](const FlashPlane& entry) {
    return entry.image == image && entry.plane == plane;
  });
  return found == planes.end() ? nullptr : &found->pattern;
}

FlashTable read_flash_table(const std::filesystem::path& path) {
  const toml::table root = files::read_toml(path);
  FlashTable table;
  for (const auto& [key, value] : root)
    if (key.str() != "lines" && key.str() != "planes")
      refuse(path.string(), "unknown key {}, expected [lines] and [[planes]]", key.str());
  if (const auto* lines = root["lines"].as_table()) {
    Keys keys(path.string() + " [lines]", *lines);
    table.lines = read_stripes(keys);
    table.lines->period_px = keys.number("period_px", std::nullopt, 1, 4096);
    keys.finish();
  }
  const auto* runs = root["planes"].as_array();
  for (size_t i = 0; runs != nullptr && i < runs->size(); ++i) {
    const std::string where = fmt::format("{} [[planes]] {}", path.string(), i + 1);
    const auto* run = runs->get(i)->as_table();
    if (run == nullptr) refuse(where, "a table expected");
    Keys keys(where, *run);
    read_planes(keys, where, table);
    keys.finish();
  }
  return table;
}

FlashTable standard_flash_table() {
  FlashTable table;
  Pattern gray{.kind = PatternKind::gray_code};
  for (gray.bit = 0; gray.bit < 11; ++gray.bit) table.planes.push_back({0, gray.bit, gray});
  gray.orientation = Orientation::vertical;
  for (gray.bit = 0; gray.bit < 10; ++gray.bit) table.planes.push_back({1, gray.bit, gray});
  for (int i = 0; i < 23; ++i)
    table.planes.push_back({2, i, Pattern{.kind = PatternKind::stripes, .period_px = 4.0 + 2 * i}});
  return table;
}

}  // namespace selvedge::projector
