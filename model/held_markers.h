// Markers that no physics can move: those on held points of the fabric follow the grips' path.
//
// What they show beside it is measurement. Over the held edge a frame's departure is a line, a + b s at the share s of
// the way from the left grip to the right one: shift, scale and tilt of a tracked outline (Jump). A frame's line less
// the mean over frames is its jump; what a line leaves is noise. The time by which the path has to be shifted until
// the markers follow it is the camera's delay.
#pragma once

#include <string>
#include <vector>

#include "model/observed_trial.h"

namespace selvedge::model {

struct HeldMarker {
  size_t marker = 0;
  double along = 0;  // share of the way from the left grip to the right one
};

std::vector<HeldMarker> held_markers(const ObservedTrial& trial);

// Whether markers lie on all four edges: nodes of a grid inside a seen outline rather than dots on the fabric.
bool is_outline_grid(const ObservedTrial& trial);

// a + b s.
struct Jump {
  Eigen::Vector3d left = Eigen::Vector3d::Zero(), along = Eigen::Vector3d::Zero();  // m
  Eigen::Vector3d at(double s) const { return left + s * along; }
};

// The jump of each time of a trial's markers against a path: m. A held marker's own is told by the others, so that its
// noise is not taken for a jump.
class Jumps {
 public:
  Jumps(const ObservedTrial& trial, const cloth::HeldPath& path);

  bool empty() const { return of_all_.empty(); }
  // Of any marker by its place along the held edge.
  Eigen::Vector3d at(size_t time, double along) const { return of_all_[time].at(along); }
  // Of marker k.
  Eigen::Vector3d of(size_t time, size_t k, double along) const;
  // Root mean square over times and axes: of the edge's middle, and of its ends against the middle.
  double middle_m() const;
  double ends_m() const;
  // Root mean square distance of held markers from the path, m.
  double distance_m() const { return distance_m_; }
  // Of a held marker and axis beside its frame's line; 0 where fewer than three are held.
  double noise_m() const { return noise_m_; }

 private:
  std::vector<Jump> of_all_;  // one a time
  std::vector<HeldMarker> held_;
  std::vector<std::vector<Jump>> others_;  // a held marker, a time: told by the others
  double noise_m_ = 0, distance_m_ = 0;
};

// By how much the stamps of all trials' markers lag the path, s, within ±most_s; nothing where no held point that moves
// was seen. The deviation is over trials.
struct HeldDelay {
  double delay_s = 0, sd_s = 0;
};
std::optional<HeldDelay> held_delay(const std::vector<ObservedTrial>& trials, double most_s);
// "the clock of the markers is late by 6.6 ms (5.0 to 8.2) against the path of the grips", with 90 %.
std::string in_words(const HeldDelay& delay);

// Standard deviation of an axis of each marker, m, as the recording shows it. Of nodes of a grid inside an outline:
// what a frame's line leaves of the held edge, and jumps, which the opposite edge has as well and for itself. Else, and
// at least, what trial.json says.
std::vector<double> marker_noise_m(const ObservedTrial& trial);

}  // namespace selvedge::model
