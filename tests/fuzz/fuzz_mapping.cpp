// Mappings of recordings of others, beside tables and pictures that they may name.
#include "capture/trial/grey_png.h"
#include "fuzz.h"
#include "station/exchange/import_mapping.h"

using namespace selvedge;
namespace fs = std::filesystem;

namespace {

const fs::path& recording() {
  static const fs::path folder = [] {
    const fs::path& at = fuzz::memory_folder();
    fs::create_directories(at / "pictures");
    fuzz::put(at / "corners.csv", "t,lx,ly,lz,rx,ry,rz\n0,0,0,1,0.3,0,1\n0.1,0,0,1,,,\n0.2,0,0,1,0.3,0,1\n");
    fuzz::put(at / "dots.csv", "t,id,x,y,z,u,v\n0,0,0,0,1,0,0\n0,4,0.3,0,1,0.3,0\n0.1,0,0,0,1,0,0\n");
    const trial::GreyImage grey = trial::GreyImage::Constant(4, 8, 128);
    for (const char* name : {"0.png", "1.png"})
      fuzz::put(at / "pictures" / name, trial::encode_grey_png(grey.data(), 8, 4, 1));
    return at;
  }();
  return folder;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const fs::path mapping = recording() / "mapping.toml";
  fuzz::put(mapping, fuzz::text_of(data, size));
  fuzz::or_refused([&] { station::read_recording(mapping); });
  return 0;
}
