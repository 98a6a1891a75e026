// The faults of `./selvedge soak`, and how they are drawn: all kinds in a random order, then all of them anew, so that
// none is left out of a short run. s.
#pragma once

#include <array>
#include <random>
#include <vector>

namespace selvedge::cli {

enum class FaultKind {
  packet_loss,   // of the camera's stream, amount up to 0.05
  camera_stall,  // a frame in ten waits for `amount` s
  camera_unplugged,
  camera_clock_jump,  // by `amount` s
  tracker_stall,
  tracker_cut,  // in the middle of a packet
  occlusion,    // of every marker
  projector_hang,
  projector_cut,
  arm_cut,  // both connections
  arm_protective_stop,
  full_disk,
  kill_camera,  // kill -9, here and below
  kill_tracker,
  kill_projector,
  kill_arm,
  kill_recorder,
  operator_stop,  // of people (people.h), here and below
  stop_in_flood,
  second_sender,
  kill_console,
  stolen_script
};
inline constexpr int kFaultKinds = static_cast<int>(FaultKind::stolen_script) + 1;
inline bool of_people(FaultKind kind) { return kind >= FaultKind::operator_stop; }

const char* to_text(FaultKind kind);

struct Fault {
  FaultKind kind = FaultKind::packet_loss;
  double amount = 0;
  double duration_s = 0;
  bool in_motion = false;  // of people: it waits for the arm to move
};

class FaultDeck {
 public:
  FaultDeck(unsigned seed, double mean_gap_s) : random_(seed), gap_s_(1 / mean_gap_s) {}
  Fault draw();
  double gap_s() { return gap_s_(random_); }  // until the next

 private:
  double between(double least, double most) { return std::uniform_real_distribution<double>(least, most)(random_); }
  std::mt19937 random_;
  std::exponential_distribution<double> gap_s_;
  std::vector<FaultKind> left_;
};

using FaultCounts = std::array<int, kFaultKinds>;

}  // namespace selvedge::cli
