#include "files/json_reader.h"

#include <algorithm>
#include <cmath>

#include <fmt/ranges.h>

#include "files/bad_input.h"
#include "files/whole_file.h"
#include "files/nearest_name.h"

namespace selvedge::files {

using nlohmann::json;

std::string shown(const json& value) {
  constexpr size_t longest = 60;
  const std::string text = value.dump(-1, ' ', true, json::error_handler_t::replace);
  return text.size() <= longest ? text : text.substr(0, longest) + "…";
}

std::vector<double> finite_numbers(const json& value, size_t count, const std::string& where) {
  if (!value.is_array() || value.size() != count)
    refuse(where, "found {}, expected a list of {} numbers", shown(value), count);
  std::vector<double> numbers;
  for (const json& entry : value) {
    if (!entry.is_number() || !std::isfinite(entry.get<double>()))
      refuse(where, "found {} in the list, expected {} finite numbers", shown(entry), count);
    numbers.push_back(entry.get<double>());
  }
  return numbers;
}

JsonReader::JsonReader(const std::filesystem::path& path) : object_(read_json(path)), path_(path.string()) {
  if (!object_.is_object()) refuse(path_, "found {}, expected a JSON object", shown(object_));
}

std::string JsonReader::where(const std::string& key) const { return path_ + ": " + prefix_ + key; }

const json& JsonReader::value(const std::string& key) const {
  const auto found = object_.find(key);
  if (found == object_.end()) refuse(where(key), "found no such key, expected it");
  return *found;
}

JsonReader JsonReader::child(const std::string& key) const {
  const json& object = value(key);
  if (!object.is_object()) refuse(where(key), "found {}, expected an object", shown(object));
  return {object, path_, prefix_ + key + "."};
}

std::vector<JsonReader> JsonReader::children(const std::string& key) const {
  const json& list = value(key);
  if (!list.is_array()) refuse(where(key), "found {}, expected a list of objects", shown(list));
  std::vector<JsonReader> children;
  for (size_t i = 0; i < list.size(); ++i) {
    const std::string name = key + "[" + std::to_string(i) + "]";
    if (!list[i].is_object()) refuse(where(name), "found {}, expected an object", shown(list[i]));
    children.push_back({list[i], path_, prefix_ + name + "."});
  }
  return children;
}

void JsonReader::allow_only(const std::vector<std::string>& keys) const {
  for (const auto& [key, unused] : object_.items())
    if (std::find(keys.begin(), keys.end(), key) == keys.end())
      refuse(where(key), "found a key that nothing reads, expected one of \"{}\"{}", fmt::join(keys, "\", \""),
             did_you_mean(key, keys));
}

double JsonReader::number(const std::string& key) const {
  const json& found = value(key);
  if (!found.is_number() || !std::isfinite(found.get<double>()))
    refuse(where(key), "found {}, expected a finite number", shown(found));
  return found.get<double>();
}

double JsonReader::positive(const std::string& key) const {
  const double found = number(key);
  if (!(found > 0)) refuse(where(key), "found {}, expected a number above 0", found);
  return found;
}

double JsonReader::number_or(const std::string& key, double missing) const { return has(key) ? number(key) : missing; }

double JsonReader::not_negative_or(const std::string& key, double missing) const {
  const double found = number_or(key, missing);
  if (found < 0) refuse(where(key), "found {}, expected 0 or more", found);
  return found;
}

int JsonReader::positive_whole(const std::string& key) const {
  const double found = positive(key);
  if (found != std::floor(found) || found > 1e6)
    refuse(where(key), "found {}, expected a whole number from 1 to 1000000", found);
  return static_cast<int>(found);
}

bool JsonReader::truth_or(const std::string& key, bool missing) const {
  if (!has(key)) return missing;
  if (!value(key).is_boolean()) refuse(where(key), "found {}, expected true or false", shown(value(key)));
  return value(key).get<bool>();
}

std::string JsonReader::text(const std::string& key) const {
  if (!value(key).is_string()) refuse(where(key), "found {}, expected a text", shown(value(key)));
  return value(key).get<std::string>();
}

std::vector<double> JsonReader::numbers(const std::string& key, size_t count) const {
  return finite_numbers(value(key), count, where(key));
}

std::vector<std::string> JsonReader::texts(const std::string& key) const {
  const json& found = value(key);
  if (!found.is_array()) refuse(where(key), "found {}, expected a list of texts", shown(found));
  std::vector<std::string> texts;
  for (const json& entry : found) {
    if (!entry.is_string()) refuse(where(key), "found {} in the list, expected texts", shown(entry));
    texts.push_back(entry.get<std::string>());
  }
  return texts;
}

size_t JsonReader::choice(const std::string& key, const std::vector<std::string>& choices) const {
  const std::string found = text(key);
  for (size_t i = 0; i < choices.size(); ++i)
    if (choices[i] == found) return i;
  refuse(where(key), "found {}, expected {}\"{}\"", in_quotes(found), choices.size() > 1 ? "one of " : "",
         fmt::join(choices, "\", \""));
}

}  // namespace selvedge::files
