// Mass beside the fabric's own, of each node of a simulated sheet: one spot, or the rim.
#pragma once

#include <functional>
#include <utility>

#include "hardware_sim/world/lattice_sheet.h"

namespace selvedge::hardware_sim {

class AddedWeights : public LatticeExtra {
 public:
  using Kg = std::function<double(int row, int column, const LatticeView&)>;
  explicit AddedWeights(Kg kg) : kg_(std::move(kg)) {}
  void begin(const LatticeView& s) override {
    for (int i = 0; i < s.columns * s.rows; ++i) s.mass[i] += kg_(i / s.columns, i % s.columns, s);
  }
  void add(const LatticeView&, double) override {}

 private:
  Kg kg_;
};

}  // namespace selvedge::hardware_sim
