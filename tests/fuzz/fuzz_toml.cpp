// TOML as every configuration file is read: parsed, then each key asked for as everything that it may be.
#include "files/toml_file.h"
#include "fuzz.h"

using namespace selvedge;
using fuzz::or_refused;

namespace {

void ask(files::Section section) {
  for (const std::string& key : section.keys()) {
    or_refused([&] { section.number(key, std::nullopt, -1e9, 1e9, "m"); });
    or_refused([&] { section.integer(key, std::nullopt, -1000, 1000); });
    or_refused([&] { section.flag(key, std::nullopt); });
    or_refused([&] { section.text(key, std::nullopt); });
    or_refused([&] { section.choice(key, std::nullopt, {"a", "b"}); });
    or_refused([&] { section.numbers(key, std::nullopt, 0, -1e9, 1e9, "m"); });
    or_refused([&] { section.texts(key, std::nullopt); });
    or_refused([&] { ask(section.section(key)); });
  }
  or_refused([&] { section.finish(); });
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  or_refused([&] {
    const auto file = files::TomlFile::parse(std::string(fuzz::text_of(data, size)), "fuzz.toml", {});
    for (const char* name : {"a", "b", "bus", "camera", "session", "fabric", "none"}) ask(file.section(name));
  });
  return 0;
}
