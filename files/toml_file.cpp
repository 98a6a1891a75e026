#include "files/toml_file.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include <fmt/ranges.h>

#include "files/bad_input.h"
#include "files/toml_text.h"
#include "files/whole_file.h"
#include "files/nearest_name.h"

namespace selvedge::files {

namespace {

// TOML knows inf and nan where JSON has no word for them, so values are carried over by hand.
nlohmann::json to_json(const toml::node& node) {
  if (const auto* table = node.as_table()) {
    nlohmann::json object = nlohmann::json::object();
    for (const auto& [key, value] : *table) object[std::string(key.str())] = to_json(value);
    return object;
  }
  if (const auto* array = node.as_array()) {
    nlohmann::json list = nlohmann::json::array();
    for (const auto& value : *array) list.push_back(to_json(value));
    return list;
  }
  if (const auto* value = node.as_string()) return value->get();
  if (const auto* value = node.as_integer()) return value->get();
  if (const auto* value = node.as_floating_point()) return value->get();
  if (const auto* value = node.as_boolean()) return value->get();
  return nullptr;  // dates and times, which no key wants
}

std::string found(const nlohmann::json& value) { return value.is_null() ? "a date" : value.dump(); }

void check_range(const std::string& where, double value, double least, double most, const std::string& unit) {
  if (!(value >= least && value <= most)) refuse(where, "found {}, expected {} to {} {}", value, least, most, unit);
}

}  // namespace

const nlohmann::json* Section::find(const std::string& key, bool required, const std::string& expected) {
  read_.insert(key);
  const auto entry = keys_.find(key);
  if (entry != keys_.end()) return &*entry;
  if (required) refuse(where_ + " " + key, "missing, expected {}", expected);
  return nullptr;
}

double Section::number(const std::string& key, std::optional<double> fallback, double least, double most,
                       const std::string& unit) {
  const auto* value = find(key, !fallback, "a number in " + unit);
  if (!value) return *fallback;
  if (!value->is_number()) refuse(where_ + " " + key, "found {}, expected a number in {}", found(*value), unit);
  check_range(where_ + " " + key, value->get<double>(), least, most, unit);
  return value->get<double>();
}

int64_t Section::integer(const std::string& key, std::optional<int64_t> fallback, int64_t least, int64_t most,
                         const std::string& unit) {
  const auto* value = find(key, !fallback, "a whole number");
  if (!value) return *fallback;
  if (!value->is_number_integer()) refuse(where_ + " " + key, "found {}, expected a whole number", found(*value));
  const int64_t result = value->get<int64_t>();
  if (result < least || result > most)
    refuse(where_ + " " + key, "found {}, expected {} to {} {}", result, least, most, unit);
  return result;
}

bool Section::flag(const std::string& key, std::optional<bool> fallback) {
  const auto* value = find(key, !fallback, "true or false");
  if (!value) return *fallback;
  if (!value->is_boolean()) refuse(where_ + " " + key, "found {}, expected true or false", found(*value));
  return value->get<bool>();
}

std::string Section::text(const std::string& key, std::optional<std::string> fallback) {
  const auto* value = find(key, !fallback, "a text in quotes");
  if (!value) return *fallback;
  if (!value->is_string()) refuse(where_ + " " + key, "found {}, expected a text in quotes", found(*value));
  return value->get<std::string>();
}

std::string Section::choice(const std::string& key, std::optional<std::string> fallback,
                            const std::vector<std::string>& allowed) {
  const std::string result = text(key, std::move(fallback));
  if (std::find(allowed.begin(), allowed.end(), result) == allowed.end())
    refuse(where_ + " " + key, "found \"{}\", expected one of {}", result, fmt::join(allowed, ", "));
  return result;
}

std::vector<double> Section::numbers(const std::string& key, std::optional<std::vector<double>> fallback, size_t count,
                                     double least, double most, const std::string& unit) {
  const auto* value = find(key, !fallback, "a list of numbers in " + unit);
  if (!value) return *fallback;
  if (!value->is_array()) refuse(where_ + " " + key, "found {}, expected a list of numbers in {}", found(*value), unit);
  if (count != 0 && value->size() != count)
    refuse(where_ + " " + key, "found {} numbers, expected {}", value->size(), count);
  std::vector<double> result;
  for (const auto& element : *value) {
    if (!element.is_number()) refuse(where_ + " " + key, "found {}, expected numbers in {}", found(element), unit);
    check_range(where_ + " " + key, element.get<double>(), least, most, unit);
    result.push_back(element.get<double>());
  }
  return result;
}

std::vector<std::string> Section::texts(const std::string& key, std::optional<std::vector<std::string>> fallback) {
  const auto* value = find(key, !fallback, "a list of texts");
  if (!value) return *fallback;
  if (!value->is_array()) refuse(where_ + " " + key, "found {}, expected a list of texts", found(*value));
  std::vector<std::string> result;
  for (const auto& element : *value) {
    if (!element.is_string()) refuse(where_ + " " + key, "found {}, expected texts in quotes", found(element));
    result.push_back(element.get<std::string>());
  }
  return result;
}

Section Section::section(const std::string& key) {
  const auto* value = find(key, false, "");
  if (value && !value->is_object()) refuse(where_ + " " + key, "found {}, expected a section", found(*value));
  return Section(where_ + "[" + key + "]", value ? *value : nlohmann::json::object());
}

std::vector<std::string> Section::keys() const {
  std::vector<std::string> names;
  for (const auto& [key, value] : keys_.items()) names.push_back(key);
  return names;
}

void Section::finish() const {
  for (const auto& [key, value] : keys_.items())
    if (!read_.contains(key))
      refuse(where_ + " " + key, "unknown key, expected one of {}{}", fmt::join(read_, ", "),
             did_you_mean(key, {read_.begin(), read_.end()}));
}

TomlFile TomlFile::parse(const std::string& text, const std::string& name, const std::vector<std::string>& sections) {
  TomlFile result;
  result.name_ = name;
  result.root_ = to_json(parse_toml(text, name));
  for (const auto& [key, value] : result.root_.items()) {
    if (!sections.empty() && std::find(sections.begin(), sections.end(), key) == sections.end())
      refuse(name, "unknown section or key \"{}\", expected sections {}", key, fmt::join(sections, ", "));
    if (!value.is_object()) refuse(name + " " + key, "found {}, expected a section [{}]", found(value), key);
  }
  return result;
}

TomlFile TomlFile::load(const std::filesystem::path& path, const std::vector<std::string>& sections) {
  return parse(read_whole(path), path.string(), sections);
}

Section TomlFile::section(const std::string& name) const {
  const auto entry = root_.find(name);
  return Section(fmt::format("{} [{}]", name_, name), entry == root_.end() ? nlohmann::json::object() : *entry);
}

}  // namespace selvedge::files
