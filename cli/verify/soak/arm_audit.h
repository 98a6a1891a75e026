// Whether the arm moves while it may not, from the joints of the simulated controller alone.
//
// It may move while its daemon says that it is armed, unless an operator's stop holds: from the moment in which that
// was sent until a person's word lifts it, whatever the daemon says. When it may move no more it brakes; once it has
// rested for kRest_s, any motion before it may move again is a motion after a stop. So is one that does not rest within
// kLongestBraking_s: a path that runs to its end is no stop. Looked at kBehind_s late, so that messages of that moment
// have arrived. Host times, s.
#pragma once

#include <map>
#include <mutex>

namespace selvedge::cli {

class ArmAudit {
 public:
  static constexpr double kBehind_s = 1, kRest_s = 0.3, kLongestBraking_s = 2;
  static constexpr double kResting_rad_s = 0.005, kMoving_rad_s = 0.02;

  // From any thread: what the daemon says, and what an operator did.
  void armed(double host_s) { note(host_s, Event::armed); }
  void not_armed(double host_s) { note(host_s, Event::not_armed); }
  void operator_stopped(double host_s) { note(host_s, Event::stopped); }
  void operator_reset(double host_s) { note(host_s, Event::reset); }

  // Largest joint speed at host_s, which rises from call to call.
  void look(double host_s, double speed_rad_s);

  int stops() const { return stops_; }                    // of an arm that might move
  int operator_stops() const { return operator_stops_; }  // in whatever state
  int stops_in_motion() const { return stops_in_motion_; }
  int motions_after_stop() const { return motions_; }
  double longest_time_to_rest_s() const { return longest_s_; }  // of all
  double longest_after_operator_s() const { return longest_operator_s_; }

 private:
  enum class Event { armed, not_armed, stopped, reset };
  void note(double host_s, Event event);
  void apply(double host_s, Event event);
  void begin_stop(double host_s, bool by_operator);

  enum class State { allowed, braking, resting, reported };
  std::mutex mutex_;
  std::multimap<double, Event> notes_;  // guarded
  bool armed_ = false, held_ = false, by_operator_ = false;
  State state_ = State::resting;
  double stopped_s_ = 0, quiet_since_s_ = -1, speed_rad_s_ = 0;
  int stops_ = 0, operator_stops_ = 0, stops_in_motion_ = 0, motions_ = 0;
  double longest_s_ = 0, longest_operator_s_ = 0;
};

}  // namespace selvedge::cli
