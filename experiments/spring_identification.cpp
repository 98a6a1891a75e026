#include "experiments/spring_identification.h"

#include <cmath>

#include <tbb/parallel_for.h>

namespace selvedge::experiments {

namespace {

using cloth::State;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kSoftest = 0.2, kStiffest = 20;  // K, N/m
constexpr double kLeastTau = 0.02, kLargestTau = 1;

size_t first_compared(const SpringRecording& recording, SpringCost cost) {
  return cost == SpringCost::last_frame ? recording.frames.size() - 1 : 0;
}

// Of structural, shear and flexion springs over the frames that the cost compares, m.
struct ObservedLengths {
  Vector3d average = Vector3d::Zero(), longest = Vector3d::Zero();
};

ObservedLengths observed_lengths(const SpringRecording& recording, SpringCost cost) {
  const ProvotSheet sheet(recording.scene);
  ObservedLengths seen;
  Vector3d count = Vector3d::Zero();
  for (size_t k = first_compared(recording, cost); k < recording.frames.size(); ++k)
    for (const ProvotSheet::Spring& s : sheet.springs()) {
      const Eigen::Matrix3Xd& p = recording.frames[k].at.position;
      const double length = (p.col(s.second) - p.col(s.first)).norm();
      seen.average(s.kind / 2) += length;
      seen.longest(s.kind / 2) = std::max(seen.longest(s.kind / 2), length);
      count(s.kind / 2) += 1;
    }
  seen.average = seen.average.cwiseQuotient(count);
  return seen;
}

}  // namespace

SpringRecording record_springs(const ProvotScene& scene, const IsotropicFabric& reference, int frames,
                               int steps_a_frame) {
  SpringRecording recording{scene, {}};
  const ProvotSheet sheet(scene);
  const ProvotFabric fabric = fabric_of(reference);
  State now = level_start(scene);
  for (int k = 0; k < frames; ++k) {
    for (int i = 1; i < steps_a_frame; ++i) sheet.advance(fabric, now);
    recording.frames.push_back({now, now});
    sheet.advance(fabric, now);
    recording.frames.back().at = now;
  }
  return recording;
}

double spring_cost(const SpringRecording& recording, const ProvotSheet& sheet, const IsotropicFabric& fabric,
                   SpringCost cost) {
  const ProvotFabric kinds = fabric_of(fabric);
  const double step2 = recording.scene.step_s * recording.scene.step_s;
  double sum = 0;
  for (size_t k = first_compared(recording, cost); k < recording.frames.size(); ++k) {
    State predicted = recording.frames[k].before;
    sheet.advance(kinds, predicted);
    const State& seen = recording.frames[k].at;
    sum +=
        (predicted.position - seen.position).squaredNorm() + step2 * (predicted.velocity - seen.velocity).squaredNorm();
  }
  return sum;
}

double share_at_critical(const SpringRecording& recording, const IsotropicFabric& reference) {
  const ProvotSheet sheet(recording.scene);
  const ProvotFabric fabric = fabric_of(reference);
  const Eigen::Matrix3Xd& p = recording.frames.back().at.position;
  double count = 0;
  for (const ProvotSheet::Spring& s : sheet.springs()) {
    const SpringKind& kind = fabric[static_cast<size_t>(s.kind)];
    count += (p.col(s.second) - p.col(s.first)).norm() > 0.99 * kind.length_m * (1 + kind.critical_elongation);
  }
  return count / static_cast<double>(sheet.springs().size());
}

VectorXd to_coordinates(const IsotropicFabric& f, SpringCoordinates coordinates) {
  VectorXd x(5);
  if (coordinates == SpringCoordinates::lengths) {
    x << f.structural_m, f.shear_m, f.flexion_m, f.stiffness_n_m, f.critical_elongation;
  } else {
    const double longest = 1 + f.critical_elongation;
    x << std::log(f.structural_m * longest), std::log(f.shear_m * longest), std::log(f.flexion_m * longest),
        std::log(f.stiffness_n_m), std::log(longest);
  }
  return x;
}

IsotropicFabric to_fabric(const VectorXd& x, SpringCoordinates coordinates) {
  if (coordinates == SpringCoordinates::lengths) return {x(0), x(1), x(2), x(3), x(4)};
  const double longest = std::exp(x(4));
  return {std::exp(x(0)) / longest, std::exp(x(1)) / longest, std::exp(x(2)) / longest, std::exp(x(3)), longest - 1};
}

estimate::SearchProblem spring_problem(const SpringRecording& recording, SpringCost cost,
                                       SpringCoordinates coordinates) {
  const estimate::EvolutionOptions first = spring_evolution(recording, cost, coordinates);
  estimate::SearchProblem problem;
  if (coordinates == SpringCoordinates::lengths) {
    problem.lower = 0.5 * first.first_lower;
    problem.upper = 2 * first.first_upper;
  } else {
    problem.lower = first.first_lower.array() - std::log(2.0);
    problem.upper = first.first_upper.array() + std::log(2.0);
    problem.lower(4) = 0;
  }
  problem.start = 0.5 * (problem.lower + problem.upper);
  problem.costs = [&recording, sheet = ProvotSheet(recording.scene), cost, coordinates](const Eigen::MatrixXd& points) {
    std::vector<double> costs(static_cast<size_t>(points.cols()));
    tbb::parallel_for(size_t{0}, costs.size(), [&](size_t i) {
      costs[i] = spring_cost(recording, sheet, to_fabric(points.col(static_cast<Eigen::Index>(i)), coordinates), cost);
    });
    return costs;
  };
  return problem;
}

estimate::EvolutionOptions spring_evolution(const SpringRecording& recording, SpringCost cost,
                                            SpringCoordinates coordinates) {
  const ObservedLengths seen = observed_lengths(recording, cost);
  estimate::EvolutionOptions options;
  options.first_lower.resize(5);
  options.first_upper.resize(5);
  if (coordinates == SpringCoordinates::lengths) {
    options.first_lower << 0.6 * seen.average, kSoftest, kLeastTau;
    options.first_upper << 1.1 * seen.average, kStiffest, kLargestTau;
  } else {
    options.first_lower << seen.average.array().log(), std::log(kSoftest), std::log1p(kLeastTau);
    options.first_upper << (1.1 * seen.longest).array().log(), std::log(kStiffest), std::log1p(kLargestTau);
  }
  return options;
}

}  // namespace selvedge::experiments
