// Our own sheet of splines behind `simulator/1` (protocol.h): what other simulators are compared with, and an example
// of one that is set to shapes and answers many runs at once.
//
// Where the points asked for are the greville_points of an even grid it simulates on that grid, and takes start shapes
// there; other points it answers from a grid of `cells`.
#pragma once

#include "model/parameter.h"

namespace selvedge::station {

struct ServeOptions {
  model::Drag drag = model::Drag::nonlinear;
  int cells = 16;  // along the width
};

// Says what it can do on file `out`, then answers what comes on file `in` until that ends. Throws BadInput where what
// comes is no `simulator/1`, std::runtime_error where nobody takes the answers.
void serve_simulator(int in, int out, const ServeOptions& options);

}  // namespace selvedge::station
