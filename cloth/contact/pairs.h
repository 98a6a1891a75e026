// Pairs of features of one fabric that are near each other, kept over many steps.
//
// `travel` is the sum over steps of the fastest vertex's displacement, in the frame that moves with the fabric's
// mean velocity: no distance changes by more than twice its growth. A pair listed at distance d sleeps until
// 2 (travel − travel then) could have brought it within the thickness; this rejects nearly all pairs by one
// comparison. The list holds every pair within its reach when it was made.
#pragma once

#include <array>
#include <vector>

#include "cloth/contact/closest.h"
#include "cloth/contact/hierarchy.h"

namespace selvedge::cloth::contact {

// Two features and how they lie now.
struct NearPair {
  Kind kind;
  std::array<int, 4> vertex;
  Closest at;
};

class PairList {
 public:
  explicit PairList(const Surface& surface) : surface_(surface) {}

  // tree: updated to these positions.
  void rebuild(Hierarchy& tree, const Eigen::Matrix3Xd& position, double reach_m, double travel_m);

  // Fills `near` with the pairs that may come within thickness_m before travel reaches travel_end_m.
  void collect(const Eigen::Matrix3Xd& position, double thickness_m, double travel_m, double travel_end_m,
               std::vector<NearPair>& near);

  size_t size() const { return pairs_.size(); }

 private:
  struct Pair {
    double wake_m;  // travel at which it has to be looked at again
    std::array<int, 4> vertex;
    Kind kind;
  };
  void add_features(int one, int two, const Eigen::Matrix3Xd& position, double reach_m, double travel_m,
                    std::vector<Pair>& found) const;

  const Surface& surface_;
  std::vector<Pair> pairs_;
  std::vector<std::array<int, 2>> triangles_;  // scratch
  std::vector<std::vector<Pair>> parts_;       // scratch
};

inline Four columns(const Eigen::Matrix3Xd& all, const std::array<int, 4>& which) {
  return {all.col(which[0]), all.col(which[1]), all.col(which[2]), all.col(which[3])};
}

}  // namespace selvedge::cloth::contact
