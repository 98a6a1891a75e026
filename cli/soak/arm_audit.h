// Whether the arm moves while it may not, from the joints of the simulated controller alone.
//
// It may move from a status that says armed until one that says it is not, or the daemon is killed. From then on it brakes, whatever that takes; once it has rested for kRest_s, any motion before it is armed
// again is a motion after a stop. So is one that never comes to rest. Looked at kBehind_s late, so that messages of that
// moment have arrived. Host times, s.
#pragma once

#include <map>
#include <mutex>

namespace selvedge::cli {

class ArmAudit {
 public:
  static constexpr double kBehind_s = 1, kRest_s = 0.3, kLongestBraking_s = 10;
  static constexpr double kResting_rad_s = 0.005, kMoving_rad_s = 0.02;

  // From any thread.
  void may_move(double host_s) { note(host_s, true); }
  void must_stop(double host_s) { note(host_s, false); }

  // Largest joint speed at host_s, which rises from call to call.
  void look(double host_s, double speed_rad_s);

  int stops() const { return stops_; }
  int motions_after_stop() const { return motions_; }
  double longest_braking_s() const { return longest_braking_s_; }

 private:
  void note(double host_s, bool allowed);
  void begin_stop(double host_s);

  enum class State { allowed, braking, resting, reported };
  std::mutex mutex_;
  std::map<double, bool> notes_;      // guarded
  State state_ = State::resting;
  double stopped_s_ = 0, quiet_since_s_ = -1;
  int stops_ = 0, motions_ = 0;
  double longest_braking_s_ = 0;
};

}  // namespace selvedge::cli
