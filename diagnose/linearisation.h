// How what the windows leave changes with everything that a model may have: the base's parameters, every effect, the
// smooth forces that stand for what no law has, and a finer grid.
//
// No rig and no fabric is without a little of everything: grips are a tenth of a millimetre off, strain has another
// form. An effect is said to be there where it is larger than that. So every effect that is not in a set is in its
// model all the same, with a size up to Protocol::negligible_share of its scale, or as which another form of a law
// shows (Effect::form), or what leaves a trace of negligible_mm in the windows, along whichever of its directions; in a
// set its size is free. Derivatives are therefore taken where the base and those small sizes are likeliest, not at
// neutral.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "diagnose/columns.h"
#include "diagnose/evidence.h"
#include "diagnose/study.h"

namespace selvedge::diagnose {

// On which grid something is simulated (Study::coarse, Study::simulation, Study::fine).
enum class On : char { coarse, usual, fine };

// Coordinates of an effect whose columns, which have units, are at d: the sum of their first parameters, the others in
// the mean weighted by these. deviation: of the sum, from the columns' posterior.
Eigen::VectorXd effect_at(const Study& study, const Way& way, const Eigen::VectorXd& d);
double deviation_at(const Study& study, const Way& way, const Posterior& posterior);

// The prior of a column about a model that stands at x, where model error is s times its usual size.
Prior prior_of(const Study& study, const Column& column, const Eigen::VectorXd& x, Size size, double s);
// Of the columns that have a size.
std::vector<Prior> priors_of(const Study& study, const std::vector<Column>& columns, const Eigen::VectorXd& x,
                             const std::vector<Size>& sizes, double s);

// Those that the recordings show, of fabric at x: the nearest to them, or these (Simulation::rematch).
model::State branches_at(const Study& study, model::State these, const Eigen::VectorXd& x);

// About x: derivatives are those of the coarse grid, what is left that of the usual one and what a finer one adds.
// forces: what smooth ones do (responses_to_forces).
Linearisation linearise(Study& study, const Windows& windows, const model::State& branches, const Eigen::VectorXd& x,
                        const Eigen::MatrixXd& forces);

// The same with derivatives by the base and by these effects. Those by others, and what smooth forces do, stay what
// they were in `before`.
Linearisation linearise_again(Study& study, const Windows& windows, const model::State& branches,
                              const Eigen::VectorXd& x, const Linearisation& before,
                              const std::vector<size_t>& effects);

// What smooth forces of usual size do where the study begins, on the coarse grid: of what they stand for hardly more
// than the size is known.
Eigen::MatrixXd responses_to_forces(Study& study, const Windows& windows);

// Residuals. branches: on the usual grid.
Eigen::MatrixXd simulated(Study& study, const Windows& windows, const model::State& branches,
                          const Eigen::MatrixXd& sets, On on = On::usual);

// How much of what a finer grid changes a model has: once, and beyond that what mesh_resolution gives it.
double grid_share(const Study& study, const Eigen::VectorXd& x);

}  // namespace selvedge::diagnose
