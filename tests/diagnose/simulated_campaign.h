// A small marker campaign simulated by the model itself on nine cells, for tests of the diagnosis.
#pragma once

#include <string>
#include <utility>

#include "model/parameter.h"
#include "cli/verify/proofs/simulated_trial.h"

namespace selvedge::diagnose {

// record: a trial of a motion, with a name and a seed.
template <class Record>
trial::Campaign campaign_of(const Record& record) {
  const auto recorded = [&](const std::string& name, double amplitude_m, double frequency_hz, unsigned seed) {
    return record(SimulatedMotion{.half_apart_m = 0.125,
                                  .amplitude_m = amplitude_m,
                                  .frequency_hz = frequency_hz,
                                  .samples = amplitude_m > 0 ? 96 : 12},
                  name, seed);
  };
  trial::Campaign campaign;
  campaign.folder = "simulated";
  campaign.fabric = "test knit";
  campaign.trials = {recorded("static-1", 0, 0, 1), recorded("waving-1", 0.09, 1.4, 2),
                     recorded("waving-2", 0.06, 2.0, 3)};
  return campaign;
}

inline trial::Campaign simulated_campaign(const SimulatedSwatch& c) {
  return campaign_of([&](const SimulatedMotion& motion, const std::string& name, unsigned seed) {
    return simulated_trial(c, motion, name, seed);
  });
}

inline SimulatedSwatch usual_fabric() {
  SimulatedSwatch c;
  c.material.stretch = 90;
  c.material.shear = 45;
  c.material.bend = 6e-5;
  return c;
}

// Coordinates of the base model that made a swatch, but for what is given.
inline Eigen::VectorXd base_of(const SimulatedSwatch& c, double stretch, double shear) {
  const std::vector<model::Parameter> base = model::base_parameters();
  Eigen::VectorXd x = model::usual_coordinates(base);
  for (size_t k = 0; k < base.size(); ++k)
    for (const auto& [name, value] : {std::pair{"stretch", stretch}, {"shear", shear}, {"bend", c.material.bend}})
      if (base[k].name == name) x(static_cast<Eigen::Index>(k)) = model::to_coordinate(base[k], value);
  return x;
}

}  // namespace selvedge::diagnose
