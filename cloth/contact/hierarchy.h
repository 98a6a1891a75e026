// Which triangles of a moving fabric are near each other: a tree of boxes over the flat panels.
//
// Update is hybrid (T. Larsson & T. Akenine-Möller, Collision detection for continuously deforming bodies,
// Eurographics 2001): boxes above the middle level are joined from below at once, the tree below a middle node
// only when a search first enters it.
//
// Curvature criterion (P. Volino & N. Magnenat-Thalmann, Eurographics 1994): a region that hardly bends and
// whose contour does not cross itself cannot touch itself. Both conditions in one bound: where the flat region
// is convex and the deformation gradient J = ∂x/∂(u,v) differs nowhere by more than ε from a mean W, then along
// the straight flat segment between any two of its points
//   |x(p) − x(q)| = |∫ J (p − q)| ≥ (σ_min(W) − ε) |p − q|.
// Features that share no vertex lie at least the least height of a flat triangle apart in the flat state, so a
// region with (σ_min − ε) · height ≥ reach holds no pair within reach and is passed over. ε counts the triangles
// around each leaf as well, because a region's outline is jagged.
#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

#include "cloth/contact/surface.h"

namespace selvedge::cloth::contact {

struct Box {
  Eigen::Vector3d low = Eigen::Vector3d::Zero(), high = Eigen::Vector3d::Zero();  // m
};

class Hierarchy {
 public:
  // The surface must outlive the tree.
  explicit Hierarchy(const Surface& surface);

  // position: 3×N, m; read again by the searches until the next update.
  void update(const Eigen::Matrix3Xd& position);

  // Appends pairs of triangles that may hold features within reach_m that share no vertex, each pair once.
  void near_itself(double reach_m, std::vector<std::array<int, 2>>& pairs);

  // Appends the triangles whose boxes come within reach_m of the segment.
  void near_segment(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double reach_m,
                    std::vector<int>& triangles);

  // Turns the curvature criterion off, to measure and to prove it.
  void set_culling(bool on) { culling_ = on; }

 private:
  struct Node {
    int first = 0, last = 0;    // range in order_
    int left = -1, right = -1;  // children; −1 at a leaf
    int depth = 0;
    bool convex = false;  // its flat region, of one panel
    double area = 0;      // m², flat
    unsigned fresh = 0;   // update at which box and subtree were computed
    Box box;
    Eigen::Vector3d along_u = Eigen::Vector3d::Zero(), along_v = Eigen::Vector3d::Zero();  // W
    double deviation = 0;                                                                  // ε
  };

  int build(int first, int last, int depth);
  void add_rings();
  bool is_convex(const Node& node) const;
  void refit_range(Node& node) const;
  void refit_subtree(int index);
  void update_flatness();
  bool is_flat(const Node& node, double reach_m) const;
  void enter(int index);
  void within(int index, double reach_m, std::vector<std::array<int, 2>>& pairs);
  void between(int a, int b, double reach_m, std::vector<std::array<int, 2>>& pairs);

  const Surface& surface_;
  const Eigen::Matrix3Xd* position_ = nullptr;
  std::vector<Node> nodes_;               // parents before children
  std::vector<int> order_;                // triangles, leaf by leaf
  std::vector<Eigen::Matrix2d> inverse_;  // of the flat sides, per triangle
  std::vector<double> area_;              // flat, per triangle
  std::vector<std::vector<int>> ring_;    // of a leaf node: its triangles and those around, of the same panel
  std::vector<Box> triangle_box_;
  std::vector<Eigen::Vector3d> along_u_, along_v_;  // J per triangle
  int middle_ = 0;
  unsigned update_ = 0;
  bool culling_ = true;
};

// True where the boxes come within reach_m along every axis.
inline bool within_reach(const Box& a, const Box& b, double reach_m) {
  return ((a.low - b.high).array() <= reach_m).all() && ((b.low - a.high).array() <= reach_m).all();
}

}  // namespace selvedge::cloth::contact
