// A model's columns: all in which it may differ from where it stands, and how much of that is negligible.
#pragma once

#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Core>

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

// The coordinate of an effect's parameter where the effect is not there.
double neutral_of(const model::Parameter& p);

// Columns and ways of all that a model may have; what they do is not known yet.
void list_columns(const Study& study, Linearisation& out);

// What is negligible of each effect, by its scale, by what another form of a law shows as it, and by what a unit of it
// leaves beyond a refit of the base; of a mass, which leaves nothing there, by its scale alone. Of starts that add up
// that alone counts, shared among them: a scale of one leaves ten times what it does of another.
void set_negligible(const Study& study, Linearisation& out);

// An effect of several parameters has directions that hardly show: a projector's shift along its rows is one across
// them by a hair. What leaves a trace of negligible_mm along one of these is negligible, too, however far it is: a
// column of its own, that is in every model.
void add_weak_directions(const Study& study, Linearisation& out);

// Smooth forces, a column each: the last of all.
void add_forces(const Eigen::MatrixXd& changes, Linearisation& out);

}  // namespace selvedge::diagnose
