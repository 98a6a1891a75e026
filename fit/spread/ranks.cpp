#include "fit/spread/ranks.h"

#include <algorithm>
#include <cerrno>

#include <sys/socket.h>
#include <unistd.h>

#include "fit/spread/bytes.h"

namespace selvedge::fit {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr std::uint64_t kShare = 1, kResult = 2, kAnswer = 3;

bool send_all(int connection, const std::string& bytes) {
  for (size_t at = 0; at < bytes.size();) {
    const ssize_t sent = ::send(connection, bytes.data() + at, bytes.size() - at, MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent <= 0) return false;
    at += static_cast<size_t>(sent);
  }
  return true;
}

bool receive_all(int connection, std::string& bytes, size_t count) {
  bytes.resize(count);
  for (size_t at = 0; at < count;) {
    const ssize_t received = ::recv(connection, bytes.data() + at, count - at, 0);
    if (received < 0 && errno == EINTR) continue;
    if (received <= 0) return false;
    at += static_cast<size_t>(received);
  }
  return true;
}

// A message: what it is, its length, its bytes.
bool send_message(int connection, std::uint64_t what, const std::string& bytes) {
  std::string head;
  put(head, what);
  put(head, bytes.size());
  return send_all(connection, head) && send_all(connection, bytes);
}

bool receive_message(int connection, std::uint64_t& what, std::string& bytes) {
  std::string head;
  if (!receive_all(connection, head, 2 * sizeof(std::uint64_t))) return false;
  TakenBytes in(head);
  what = in.number();
  const std::uint64_t length = in.number();
  constexpr std::uint64_t kMost = std::uint64_t{1} << 34;
  return length <= kMost && receive_all(connection, bytes, length);
}

std::string to_bytes(const MatrixXd& points) {
  std::string bytes;
  put(bytes, static_cast<std::uint64_t>(Batch::costs));
  put(bytes, static_cast<std::uint64_t>(points.cols()));
  put(bytes, points.data(), points.size());
  return bytes;
}

std::string costs_of_share(const std::string& share, const estimate::BatchCosts& costs) {
  TakenBytes in(share);
  require(in, Batch::costs);
  const auto columns = static_cast<Index>(in.number());
  const Eigen::VectorXd values = in.numbers();
  const std::vector<double> found = costs(Eigen::Map<const MatrixXd>(values.data(), values.size() / columns, columns));
  std::string bytes;
  put(bytes, found.data(), static_cast<Index>(found.size()));
  return bytes;
}

void append_costs(const std::string& bytes, std::vector<double>& costs) {
  const Eigen::VectorXd values = TakenBytes(bytes).numbers();
  costs.insert(costs.end(), values.begin(), values.end());
}

}  // namespace

Ranks::~Ranks() {
  for (const int c : connections_) ::close(c);
}

std::string Ranks::computed(const std::string& share, const Compute& compute) {
  struct Busy {
    explicit Busy(bool& flag) : flag_(flag) { flag_ = true; }
    ~Busy() { flag_ = false; }
    bool& flag_;
  } busy(busy_);
  return compute(share);
}

std::vector<std::string> Ranks::share_out(const std::vector<std::string>& shares, const Compute& compute) {
  if (shares.size() > static_cast<size_t>(alive())) throw std::logic_error("Ranks: at most one share a living rank");
  std::vector<std::string> results(shares.size());
  std::vector<char> lost(connections_.size(), 0);
  for (size_t k = 1; k < shares.size(); ++k) lost[k - 1] = !send_message(connections_[k - 1], kShare, shares[k]);
  if (!shares.empty()) results[0] = computed(shares[0], compute);
  for (size_t k = 1; k < shares.size(); ++k) {
    std::uint64_t what = 0;
    if (!lost[k - 1] && receive_message(connections_[k - 1], what, results[k]) && what == kResult) continue;
    lost[k - 1] = 1;
    results[k] = computed(shares[k], compute);
  }
  std::vector<int> left;
  for (size_t k = 0; k < connections_.size(); ++k) {
    if (lost[k]) ::close(connections_[k]);
    else left.push_back(connections_[k]);
  }
  connections_ = std::move(left);
  return results;
}

void Ranks::answer(const std::string& bytes) {
  std::vector<int> left;
  for (const int c : connections_) {
    if (send_message(c, kAnswer, bytes)) left.push_back(c);
    else ::close(c);
  }
  connections_ = std::move(left);
}

std::string Ranks::follow(const Compute& compute) {
  for (;;) {
    std::uint64_t what = 0;
    std::string bytes;
    if (!receive_message(connections_.front(), what, bytes)) throw std::runtime_error("ranks: the first rank is gone");
    if (what == kAnswer) return bytes;
    if (what != kShare || !send_message(connections_.front(), kResult, computed(bytes, compute)))
      throw std::runtime_error("ranks: the first rank is gone");
  }
}

estimate::BatchCosts spread(const std::shared_ptr<Ranks>& ranks, const estimate::BatchCosts& costs,
                            const std::function<estimate::BatchCosts(estimate::BatchCosts)>& remembered) {
  if (!ranks) return remembered(costs);
  const Ranks::Compute compute = [costs](const std::string& share) { return costs_of_share(share, costs); };
  if (!ranks->is_first())
    return [ranks, compute](const MatrixXd&) {
      std::vector<double> all;
      append_costs(ranks->follow(compute), all);
      return all;
    };
  const estimate::BatchCosts known_first = remembered([ranks, compute](const MatrixXd& points) {
    const Index parts = std::min<Index>(ranks->alive(), points.cols());
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

}  // namespace selvedge::fit
