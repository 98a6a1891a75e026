// The processes of one job (`mpirun -n N ./selvedge fit …`) that share out a fit's evaluations.
//
// All ranks run the same program on the same input, and as it is deterministic they come to the same batches in the
// same order. The first rank splits a batch, the others compute their shares, and all get the whole answer. What is
// asked is computed the same way wherever that happens, so that results do not depend on the number of ranks. Only the
// first rank prints and writes. MPI is used for one thing, to tell all ranks where the first one listens; then they
// speak over TCP, and a rank that is killed is to the first a connection that closed: it computes that share itself and
// goes on without. (Open MPI ends the whole job with a rank unless it is started with --enable-recovery.) libmpi is
// loaded where a launcher started the process, and not otherwise.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "estimate/optimisers/search.h"

namespace selvedge::fit {

class Ranks {
 public:
  // What a share asks for, to what it gives; both are bytes.
  using Compute = std::function<std::string(const std::string& share)>;

  // Null where no launcher started this process, or started it alone. Throws std::runtime_error where there is one and
  // the ranks cannot meet.
  static std::shared_ptr<Ranks> join();

  // One of `connections` a living rank, in the order of their numbers; on another rank than the first, that to the
  // first. Takes them over.
  Ranks(bool first, std::vector<int> connections) : first_(first), connections_(std::move(connections)) {}
  ~Ranks();
  Ranks(const Ranks&) = delete;
  Ranks& operator=(const Ranks&) = delete;

  bool is_first() const { return first_; }
  int alive() const { return 1 + static_cast<int>(connections_.size()); }  // as the first rank knows
  bool is_busy() const { return busy_; }  // computing a share: what that calls must not be shared out in turn

  // On the first rank: computes the shares, at most one a living rank, and returns what each gives.
  std::vector<std::string> share_out(const std::vector<std::string>& shares, const Compute& compute);
  // On the first rank, after any number of share_out: what the batch came to, for all others.
  void answer(const std::string& bytes);
  // On another rank: computes shares until the answer comes, and returns it. Throws std::runtime_error where the first
  // is gone.
  std::string follow(const Compute& compute);

 private:
  std::string computed(const std::string& share, const Compute& compute);

  bool first_;
  std::vector<int> connections_;
  bool busy_ = false;
};

// Costs of which every rank computes a share. `remembered` (a journal's, say) stands around them on the first rank
// alone. Without ranks: remembered(costs).
estimate::BatchCosts spread(const std::shared_ptr<Ranks>& ranks, const estimate::BatchCosts& costs,
                            const std::function<estimate::BatchCosts(estimate::BatchCosts)>& remembered);

}  // namespace selvedge::fit
