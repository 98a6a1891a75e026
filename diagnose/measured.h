// Measurement first: what recordings show of their own sensors before any physics.
//
// Held points follow the grips' path (model/held_markers.h). By how much the markers' stamps lag it is found over ±
// Protocol::most_delay_s and is where derivatives begin, for no derivative reaches so far. How a tracked outline jumps
// from frame to frame is seen at its held edge; its opposite edge jumps as much, unseen, so that a frame's markers err
// together (FrameNoise). Where a frame is missing though no stamp is (observe/lost_frames.h), delays grow at such
// frames alone. What neither shows is the markers' noise, which stands in the place of trial.json's where it is larger.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "diagnose/protocol.h"
#include "diagnose/windows.h"
#include "model/held_markers.h"

namespace selvedge::diagnose {

struct Measured {
  std::optional<model::HeldDelay> delay;
  double held_m = 0;  // root mean square distance of held markers from the grips' path, the delay taken off
  // Of each trial, root mean square of an axis: how the held edge jumps, m; 0 where it is not a grid's.
  std::vector<double> middle_m, ends_m;
  std::vector<std::string> lost;  // in words, of each trial that lost frames without a gap in its stamps
};

// Also puts the noise that is found into the trials' markers, and into trials what a lost frame counts.
Measured measure(std::vector<model::ObservedTrial>& trials, const Protocol& protocol);

// What errs together in a frame of markers: shift, scale and tilt of the edge that nothing holds, each of unit
// variance.
struct FrameNoise {
  Eigen::MatrixXd shapes;  // rows × shapes, mm; no columns: nothing does
  std::vector<int> frame;  // of each row; frames of a window are different
};
FrameNoise frame_noise(const Measured& measured, const model::Simulation& simulation, const Windows& windows);

}  // namespace selvedge::diagnose
