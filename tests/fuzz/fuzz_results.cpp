// What fits, diagnoses and sessions left, as `compare` and the console read it: the first byte says which file.
#include "fuzz.h"
#include "station/comparison.h"
#include "station/motion_file.h"

using namespace selvedge;
namespace fs = std::filesystem;

namespace {

constexpr const char* kFit = R"({"format": "fit/1", "campaign": "a", "parameters": {"stretch": {"value": 1.0,
    "interval": [0.5, 2.0], "unit": "N/m"}}, "held_out": {"error": 1.5}, "trials": {"waving": {"error_end": 1.0}}})";
constexpr const char* kDiagnosis = R"({"format": "diagnosis/1", "cause": "drag", "side": "model",
    "probabilities": {"drag": 0.7}, "gap": {"value_mm": 1.0}, "where": []})";

fs::path result(const char* name) {
  const fs::path folder = fuzz::memory_folder() / name;
  fs::create_directories(folder / "linen" / "diagnosis");
  fs::create_directories(folder / "simulated");
  for (const fs::path& at : {folder, folder / "linen"}) {
    fuzz::put(at / "fit.json", kFit);
    fuzz::put(at / "diagnosis.json", kDiagnosis);
  }
  fuzz::put(folder / "simulated" / "waving.f32", std::string(3 * 3 * 2 * sizeof(float), '\0'));
  return folder;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size < 1) return 0;
  static const fs::path a = result("a"), b = result("b");
  static const char* const files[] = {"fit.json", "diagnosis.json", "session.json", "simulated/waving.json"};
  const size_t which = data[0] % 4;
  const fs::path file = a / files[which];
  fuzz::put(file, fuzz::text_of(data + 1, size - 1));
  fuzz::or_refused([&] {
    if (which == 3) station::read_simulated_motion(a, "waving");
    else station::to_json(station::read_comparison(a, b)).dump();
  });
  if (which == 0) fuzz::put(file, kFit);
  else if (which == 1) fuzz::put(file, kDiagnosis);
  else fs::remove(file);
  return 0;
}
