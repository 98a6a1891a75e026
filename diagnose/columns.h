// The columns of a linearisation: what a model may have, and how much of it is negligible.
#pragma once

#include "diagnose/linearisation.h"

namespace selvedge::diagnose {

// Columns and ways of all that a model may have; what they do is not known yet.
void list_columns(const Study& study, Linearisation& out);

// What is negligible of each effect, by its scale, by what another form of a law shows as it, and by what a unit of it
// leaves beyond a refit of the base. Of starts that add up that alone counts, shared among them: a scale of one leaves
// ten times what it does of another.
void set_negligible(const Study& study, Linearisation& out);

// An effect of several parameters has directions that hardly show: a projector's shift along its rows is one across
// them by a hair. What leaves a trace of negligible_mm along one of these is negligible, too, however far it is: a
// column of its own, that is in every model.
void add_weak_directions(const Study& study, Linearisation& out);

// Smooth forces, a column each: the last of all.
void add_forces(const Eigen::MatrixXd& changes, Linearisation& out);

}  // namespace selvedge::diagnose
