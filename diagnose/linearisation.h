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

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "diagnose/evidence.h"
#include "diagnose/study.h"

namespace selvedge::diagnose {

// One way in which a model may differ from where it stands.
struct Column {
  Eigen::Index coordinate = -1;  // of study.parameters that moves with it; -1: none does, as a start's or
                                 // a weak direction's
  size_t effect = 0;             // of study.effects; none for the base's
  bool is_base = false;
  bool is_force = false;                              // a smooth force that stays the same in all windows
  double neutral = 0, lower = -1e300, upper = 1e300;  // in units of the column
  double scales = 1;                                  // of the effect's scale in a unit
  double sd = 1;                                      // where its effect is in a set, or of the base
  double negligible_sd = 1;                           // where it is not
};

// On which grid something is simulated (Study::coarse, Study::simulation).
enum class On : char { coarse, usual };

// How large the effect of a column may be.
enum class Size : char { negligible, free, neutral };

// An effect that has starts may be there in the way of any one of them: its first parameter from neutral, the others as
// in that start. One whose starts add up (Effect::starts_add) is there in one way, as a sum of them.
struct Way {
  size_t effect = 0;
  std::vector<Eigen::Index> columns;
  std::vector<Eigen::VectorXd> units;  // of each column: the effect's coordinates where it is 1; empty: the columns are
                                       // its coordinates
};

// Coordinates of an effect whose columns, which have units, are at d: the sum of their first parameters, the others in
// the mean weighted by these. deviation: of the sum, from the columns' posterior.
Eigen::VectorXd effect_at(const Study& study, const Way& way, const Eigen::VectorXd& d);
double deviation_at(const Study& study, const Way& way, const Posterior& posterior);

struct Linearisation {
  Eigen::VectorXd x;         // all coordinates where derivatives were taken
  model::State branches;     // of equilibrium there: in a draught a sheet hangs elsewhere than without
  Eigen::VectorXd residual;  // mm, with what the finer grid adds
  Eigen::VectorXd grid;      // what that adds
  Eigen::MatrixXd changes;   // mm per unit of each column
  Eigen::MatrixXd second;    // half the second derivatives by the base's coordinates, mm
  std::vector<Column> columns;
  std::vector<Way> ways;
  std::vector<char> can_tell;  // of each effect: whether it can be larger than what is negligible
};

// What a refit of the base leaves of changes.
class BeyondBase {
 public:
  explicit BeyondBase(Eigen::MatrixXd base);  // rows × base coordinates
  Eigen::MatrixXd of(const Eigen::MatrixXd& changes) const;

 private:
  Eigen::MatrixXd base_;
  Eigen::LDLT<Eigen::MatrixXd> normal_;
};

// The prior of a column about a model that stands at x, where model error is s times its usual size.
Prior prior_of(const Study& study, const Column& column, const Eigen::VectorXd& x, Size size, double s);

// Those that the recordings show, of fabric at x: the nearest to them, or these (Simulation::rematch).
model::State branches_at(const Study& study, model::State these, const Eigen::VectorXd& x);

// About x, with derivatives of one grid; what it leaves is always of the usual one and what a finer one adds. forces:
// what smooth ones do (responses_to_forces).
Linearisation linearise(Study& study, const Windows& windows, const model::State& branches, const Eigen::VectorXd& x,
                        const Eigen::MatrixXd& forces, On on = On::usual);

// About x on the usual grid, with derivatives by the base and by these effects. Those by others, and what smooth forces
// do, stay what they were in `before`.
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
