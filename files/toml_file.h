// A configuration file in TOML, section by section, each key with default, unit and range.
//
// What reads a section takes it into a struct of its own, key by key, and then calls finish(), which refuses the keys
// that nobody read. Every error names file, section and key, what was found and what was expected.
#pragma once

#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace selvedge::files {

class Section {
 public:
  Section(std::string where, nlohmann::json keys) : where_(std::move(where)), keys_(std::move(keys)) {}

  // No fallback: the key must be there. Bounds are inclusive. unit is for the error's text.
  double number(const std::string& key, std::optional<double> fallback, double least, double most,
                const std::string& unit);
  int64_t integer(const std::string& key, std::optional<int64_t> fallback, int64_t least, int64_t most,
                  const std::string& unit = "");
  bool flag(const std::string& key, std::optional<bool> fallback);
  std::string text(const std::string& key, std::optional<std::string> fallback);
  std::string choice(const std::string& key, std::optional<std::string> fallback,
                     const std::vector<std::string>& allowed);
  // count 0: any length.
  std::vector<double> numbers(const std::string& key, std::optional<std::vector<double>> fallback, size_t count,
                              double least, double most, const std::string& unit);
  std::vector<std::string> texts(const std::string& key, std::optional<std::vector<std::string>> fallback);
  Section section(const std::string& key);  // [where.key]; empty where it is missing
  bool has(const std::string& key) const { return keys_.contains(key); }
  std::vector<std::string> keys() const;  // in alphabetic order

  // Throws BadInput naming a key that nobody asked for.
  void finish() const;
  const std::string& where() const { return where_; }  // "rig.toml [camera]"

 private:
  const nlohmann::json* find(const std::string& key, bool required, const std::string& expected);
  std::string where_;
  nlohmann::json keys_;
  std::set<std::string> read_;
};

class TomlFile {
 public:
  // Throws BadInput where the file is missing, is not TOML (with line and column), or has a section that is none of
  // `sections` (empty: any).
  static TomlFile load(const std::filesystem::path& path, const std::vector<std::string>& sections);
  static TomlFile parse(const std::string& text, const std::string& name, const std::vector<std::string>& sections);

  bool has(const std::string& section) const { return root_.contains(section); }
  Section section(const std::string& name) const;  // empty where the file does not have it

 private:
  std::string name_;
  nlohmann::json root_;
};

}  // namespace selvedge::files
