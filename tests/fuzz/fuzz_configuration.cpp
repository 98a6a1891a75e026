// The files in TOML that have a reader of their own: the first byte says which.
#include "capture/session/session_plan.h"
#include "fuzz.h"
#include "rig/arm/daemon.h"
#include "rig/arm/model.h"
#include "rig/projector/flash_table.h"
#include "station/session_file.h"

using namespace selvedge;
namespace fs = std::filesystem;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size < 1) return 0;
  static const fs::path folder = [] {
    for (const char* name : {"demo-rig.toml", "demo-world.toml"})
      fs::copy_file(fs::path(SELVEDGE_SOURCE_DIR) / "examples" / name, fuzz::memory_folder() / name,
                    fs::copy_options::overwrite_existing);
    return fuzz::memory_folder();
  }();
  const fs::path file = folder / "fuzz.toml";
  const std::string text(fuzz::text_of(data + 1, size - 1));
  fuzz::put(file, text);
  fuzz::or_refused([&] {
    switch (data[0] % 5) {
      case 0: session::read_session_plan(rig::Configuration::parse(text, file)); break;
      case 1: projector::read_flash_table(file); break;
      case 2: arm::ArmModel::read(file); break;
      case 3: station::read_session_file(file); break;
      default: {
        const rig::Configuration rig = rig::Configuration::load(file);
        rig.bus();
        arm::read_configuration(rig.section("arm"));
      }
    }
  });
  return 0;
}
