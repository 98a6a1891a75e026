// What `prove` and `bench` print: figures beside their reference.
//
// A proof is a named set of figures, each with a reference and the relation in which it must stand to it;
// it exits 1 where one falls short. A benchmark prints timings as medians and ratios within one run.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "geometry/order_statistics.h"
#include "report/progress.h"

namespace selvedge::cli {

enum class Relation { at_most, at_least, shown };  // shown: printed beside its reference, never judged

struct Figure {
  std::string what;  // "cantilever tip against the elastica, 33×33"
  double measured = 0;
  double reference = 0;  // the bound, or the peer's figure
  std::string unit;
  Relation relation = Relation::at_most;
  std::string source;  // where the reference comes from
};

struct FigureOptions {
  bool quick = false;  // the short version that the tests run
  unsigned seed = 1;
  report::ProgressCallback progress = [](double, const std::string&) {};
  std::function<void(const std::string&)> tell = [](const std::string&) {};  // a part's result at once, one line
};

struct FigureSet {
  std::string name;  // as in `./selvedge prove NAME`
  std::string summary;
  std::function<std::vector<Figure>(const FigureOptions&)> run;
};

// The lists that `prove` and `bench` offer, one function a name in proofs/NAME.cpp and benches/NAME.cpp.
const std::vector<FigureSet>& proofs();
const std::vector<FigureSet>& benches();

using geometry::median;

bool holds(const Figure& figure);
void print(const std::vector<Figure>& figures);
nlohmann::json to_json(const std::string& name, const std::vector<Figure>& figures);

}  // namespace selvedge::cli
