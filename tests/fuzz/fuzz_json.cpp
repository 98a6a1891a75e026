// JSON as every file of a trial, fit or garment is read: parsed, copied, shown, and each key asked for as everything
// that it may be.
#include "files/json_reader.h"
#include "files/whole_file.h"
#include "fuzz.h"

using namespace selvedge;
using files::JsonReader;
using fuzz::or_refused;

namespace {

void ask(const JsonReader& json) {
  for (const auto& entry : json.object().items()) {
    const std::string& key = entry.key();
    or_refused([&] { json.number(key); });
    or_refused([&] { json.positive_whole(key); });
    or_refused([&] { json.not_negative_or(key, 0); });
    or_refused([&] { json.truth_or(key, false); });
    or_refused([&] { json.text(key); });
    or_refused([&] { json.numbers(key, 3); });
    or_refused([&] { json.texts(key); });
    or_refused([&] { json.choice(key, {"a", "b"}); });
    or_refused([&] { ask(json.child(key)); });
    or_refused([&] {
      for (const JsonReader& child : json.children(key)) ask(child);
    });
  }
  or_refused([&] { json.allow_only({"a"}); });
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  or_refused([&] {
    const std::string text(fuzz::text_of(data, size));
    const nlohmann::json value = files::parse_json(text, "fuzz.json");
    // What was read can be written, and reads back.
    if (files::parse_json(value.dump(2), "again") != value) std::abort();
    const auto file = fuzz::memory_folder() / "fuzz.json";
    fuzz::put(file, text);
    ask(JsonReader(file));
  });
  return 0;
}
