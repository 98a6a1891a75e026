// What a page may send to the console: bodies, parameters, headers, paths. The first byte says which.
#include "console/gate.h"
#include "console/requests.h"
#include "fuzz.h"

using namespace selvedge;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size < 1) return 0;
  static const console::Gate gate({"127.0.0.1:8080"}, "0123456789abcdef");
  static const auto root = [] {
    fuzz::put(fuzz::memory_folder() / "page.html", "page");
    return fuzz::memory_folder();
  }();
  const std::string text(fuzz::text_of(data + 1, size - 1));
  fuzz::or_refused([&] {
    switch (data[0] % 4) {
      case 0: console::trial_of(console::read_body(text)); break;
      case 1: console::prompt_answer_of(console::read_body(text)); break;
      case 2: console::frame_index_of(text); break;
      default:
        // Nobody without the token, and no path out of the folder.
        if (!gate.refusal({"POST", "/api/arm", "127.0.0.1:8080", text, text})) std::abort();
        if (const auto file = console::file_below(root, text); file && !file->string().starts_with(root.string()))
          std::abort();
        console::folder_below(root, text);
    }
  });
  return 0;
}
