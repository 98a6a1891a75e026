// The processes of one MPI job (`mpirun -n N ./selvedge fit …`) that share out a fit's evaluations.
//
// All ranks run the same program on the same input, and as it is deterministic they come to the same batches in the
// same order. The first rank cuts a batch into shares, computes some, and hands each other rank the next one as soon as
// its last result is back (MPI_Send, MPI_Iprobe, MPI_Recv); then all get the whole answer. What is asked is computed
// the same way wherever that happens, so that results do not depend on the number of ranks. Only the first rank prints,
// writes and keeps the journal. A rank that dies ends the job: the launcher sees to it, and the fit goes on from its
// journal when it is started again. MPI is loaded where a launcher started the process, and not otherwise.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

struct SelvedgeMpiCalls;

namespace selvedge::model {

class Ranks {
 public:
  // What a share asks for, to what it gives; both are bytes.
  using Compute = std::function<std::string(const std::string& share)>;

  // Null where no launcher started this process, or started it alone. Throws std::runtime_error where MPI cannot be
  // loaded or begun.
  static std::shared_ptr<Ranks> join();

  // Without end() before, the first rank tells the others that it gave up.
  ~Ranks();
  Ranks(const Ranks&) = delete;
  Ranks& operator=(const Ranks&) = delete;

  bool is_first() const { return rank_ == 0; }
  int count() const { return size_; }
  bool is_busy() const { return busy_; }  // computing a share: what that calls must not be shared out in turn

  // Into how many shares a batch of so many units is best cut, where a core computes per_core of them at once: one a
  // rank, and up to four where each still fills a host's cores.
  size_t parts_of(size_t units, size_t per_core) const;

  // On the first rank: computes the shares on all of them, and returns what each gives. Throws std::runtime_error where
  // another rank gave up.
  std::vector<std::string> share_out(const std::vector<std::string>& shares, const Compute& compute);
  // On the first rank, after any number of share_out: what the batch came to, for all others.
  void answer(const std::string& bytes);
  // On another rank: computes shares until the answer comes, and returns it. Throws std::runtime_error where the first
  // gave up.
  std::string follow(const Compute& compute);

  // On another rank that cannot go on: tells the first why, and waits for the launcher to end the job once the first
  // has said so, ten seconds at most.
  void give_up(const std::string& why);
  // On all ranks, when nothing is left to be shared: MPI is over.
  void end();

 private:
  struct Message {
    int from = 0, tag = 0;
    std::string bytes;
  };
  Ranks(const SelvedgeMpiCalls& mpi, int rank, int size) : mpi_(mpi), rank_(rank), size_(size) {}
  std::string computed(const std::string& share, const Compute& compute);
  void send(int to, int tag, const std::string& bytes);
  std::optional<Message> received();

  const SelvedgeMpiCalls& mpi_;
  const int rank_, size_;
  std::atomic<bool> busy_ = false;
  bool ended_ = false, first_gave_up_ = false;
};

}  // namespace selvedge::model
