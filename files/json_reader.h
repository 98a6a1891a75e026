// Checked access to one JSON object: every refusal names the file, the key with its parents, what was
// found and what was expected.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace selvedge::files {

class JsonReader {
 public:
  // The file's one object. Throws BadInput where it is missing, not JSON, or not an object.
  explicit JsonReader(const std::filesystem::path& path);

  bool has(const std::string& key) const { return object_.contains(key); }
  JsonReader child(const std::string& key) const;                  // must be an object
  std::vector<JsonReader> children(const std::string& key) const;  // must be a list of objects
  const nlohmann::json& value(const std::string& key) const;       // must be there

  // Throws BadInput naming a key that is none of these.
  void allow_only(const std::vector<std::string>& keys) const;

  const std::string& path() const { return path_; }
  const nlohmann::json& object() const { return object_; }

  // Each throws BadInput where the key is missing or of another kind.
  double number(const std::string& key) const;    // finite
  double positive(const std::string& key) const;  // above 0
  double number_or(const std::string& key, double missing) const;
  double not_negative_or(const std::string& key, double missing) const;
  int positive_whole(const std::string& key) const;
  bool truth_or(const std::string& key, bool missing) const;
  std::string text(const std::string& key) const;
  std::vector<double> numbers(const std::string& key, size_t count) const;
  std::vector<std::string> texts(const std::string& key) const;
  // Index of the text in `choices`.
  size_t choice(const std::string& key, const std::vector<std::string>& choices) const;

  // "PATH: PARENT.KEY".
  std::string where(const std::string& key) const;

 private:
  JsonReader(const nlohmann::json& object, std::string path, std::string prefix)
      : object_(object), path_(std::move(path)), prefix_(std::move(prefix)) {}

  nlohmann::json object_;
  std::string path_, prefix_;
};

// The value on one line, cut short, as an error shows it.
std::string shown(const nlohmann::json& value);

// A JSON array of `count` finite numbers. Throws BadInput starting with `where`.
std::vector<double> finite_numbers(const nlohmann::json& value, size_t count, const std::string& where);

}  // namespace selvedge::files
