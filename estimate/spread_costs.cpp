#include "estimate/spread_costs.h"

#include "model/ranks/bytes.h"

namespace selvedge::estimate {

using Eigen::Index;
using Eigen::MatrixXd;
using model::put;
using model::Ranks;

namespace {

std::string to_bytes(const MatrixXd& points) {
  std::string bytes;
  put(bytes, static_cast<std::uint64_t>(model::Batch::costs));
  put(bytes, static_cast<std::uint64_t>(points.cols()));
  put(bytes, points.data(), points.size());
  return bytes;
}

std::string costs_of_share(const std::string& share, const BatchCosts& costs) {
  model::TakenBytes in(share);
  require(in, model::Batch::costs);
  const auto columns = static_cast<Index>(in.number());
  const Eigen::VectorXd values = in.numbers();
  const std::vector<double> found = costs(Eigen::Map<const MatrixXd>(values.data(), values.size() / columns, columns));
  std::string bytes;
  put(bytes, found.data(), static_cast<Index>(found.size()));
  return bytes;
}

void append_costs(const std::string& bytes, std::vector<double>& costs) {
  const Eigen::VectorXd values = model::TakenBytes(bytes).numbers();
  costs.insert(costs.end(), values.begin(), values.end());
}

}  // namespace

BatchCosts spread_costs(const std::shared_ptr<Ranks>& ranks, const BatchCosts& costs,
                        const std::function<BatchCosts(BatchCosts)>& remembered) {
  if (!ranks) return remembered(costs);
  const Ranks::Compute compute = [costs](const std::string& share) { return costs_of_share(share, costs); };
  if (!ranks->is_first())
    return [ranks, compute](const MatrixXd&) {
      std::vector<double> all;
      append_costs(ranks->follow(compute), all);
      return all;
    };
  const BatchCosts known_first = remembered([ranks, compute](const MatrixXd& points) {
    constexpr size_t kLanes = 8;  // points that a core simulates at once
    const auto parts = static_cast<Index>(ranks->parts_of(static_cast<size_t>(points.cols()), kLanes));
    std::vector<std::string> shares;
    for (Index k = 0; k < parts; ++k) {
      const Index from = points.cols() * k / parts, to = points.cols() * (k + 1) / parts;
      shares.push_back(to_bytes(points.middleCols(from, to - from)));
    }
    std::vector<double> all;
    for (const std::string& bytes : ranks->share_out(shares, compute)) append_costs(bytes, all);
    return all;
  });
  return [ranks, known_first](const MatrixXd& points) {
    const std::vector<double> all = known_first(points);
    std::string bytes;
    put(bytes, all.data(), static_cast<Index>(all.size()));
    ranks->answer(bytes);
    return all;
  };
}

}  // namespace selvedge::estimate
