// What a simulator of a user's says over simulator/1: its first line, and the heads of its answers.
#include "fuzz.h"
#include "station/simulator/protocol.h"

using namespace selvedge;

namespace {

const station::SimulatorTrial& asked() {
  static const station::SimulatorTrial trial = [] {
    station::SimulatorTrial t;
    t.points = {{0, 0}, {0.3, 0.3}};
    t.time_s = {0, 0.1};
    return t;
  }();
  return trial;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string line(fuzz::text_of(data, size));
  fuzz::or_refused([&] { station::hello_from(line, "simulator"); });
  fuzz::or_refused([&] { station::answer_from(line, "simulator", asked()); });
  return 0;
}
