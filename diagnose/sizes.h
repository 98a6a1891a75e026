// How large effects are, and how large one may be of which nothing is said.
#pragma once

#include <string>
#include <vector>

#include "diagnose/columns.h"
#include "diagnose/evidence.h"

namespace selvedge::diagnose {

struct SizedParameter {
  std::string name, unit;
  double value = 0, low = 0, high = 0;  // 90 %: of the evidence, and Protocol::rig_size_share or fabric_size_share
};

// Of an effect that is free in these sizes of columns about x, given what data say of them: the evidence's interval,
// joined with what a model of another form than nature's is usually off by.
std::vector<SizedParameter> size_of(const Study& study, const Linearisation& about, const std::vector<Size>& sizes,
                                    const Eigen::VectorXd& x, const Posterior& posterior, size_t effect);

// Of each effect how large it may be if it is not named: what is negligible, and to where its interval ends if it alone
// were there beside a set, in its likeliest way, where that set was weighed; at this s. Of starts their first
// parameter. Empty of the set's own, and where data do not show an effect however large it is.
std::vector<std::vector<SizedParameter>> sizes_at_most(const Study& study, const Evidence& evidence,
                                                       const Linearisation& about,
                                                       const std::vector<const Way*>& beside, size_t scale);

}  // namespace selvedge::diagnose
