#include "model/ranks/ranks.h"

#include <algorithm>
#include <chrono>
#include <climits>
#include <cstdlib>
#include <filesystem>
#include <future>
#include <stdexcept>
#include <thread>

#include <dlfcn.h>
#include <fmt/format.h>

#include "model/ranks/bytes.h"
#include "model/ranks/mpi_calls.h"

namespace selvedge::model {

namespace {

constexpr int kShare = 1, kResult = 2, kAnswer = 3, kGaveUp = 4;
// Between two looks for a message: MPI's own waiting keeps a core busy, which others here have a use for.
constexpr std::chrono::microseconds kLook{200};
constexpr std::chrono::seconds kPatience{10};

int launched_size() {
  for (const char* name : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "MPI_LOCALNRANKS"})
    if (const char* value = std::getenv(name)) return std::atoi(value);
  return 1;
}

void check(int error, const char* call) {
  if (error != 0) throw std::runtime_error(fmt::format("ranks: {}: MPI error {}", call, error));
}

// Beside the binary in a build folder, in lib/selvedge where it is installed.
const SelvedgeMpiCalls& loaded_mpi() {
  const std::filesystem::path folder = std::filesystem::read_symlink("/proc/self/exe").parent_path();
  std::filesystem::path library = folder / "libselvedge_mpi.so";
  if (!std::filesystem::exists(library)) library = folder.parent_path() / "lib" / "selvedge" / "libselvedge_mpi.so";
  void* const handle = ::dlopen(library.c_str(), RTLD_NOW | RTLD_GLOBAL);
  const void* const table = handle ? ::dlsym(handle, SELVEDGE_MPI_CALLS) : nullptr;
  if (!table)
    throw std::runtime_error(
        fmt::format("ranks: an MPI launcher started this process, but MPI cannot be loaded: {}", ::dlerror()));
  return *static_cast<const SelvedgeMpiCalls*>(table);
}

}  // namespace

std::shared_ptr<Ranks> Ranks::join() {
  if (launched_size() <= 1) return nullptr;
  const SelvedgeMpiCalls& mpi = loaded_mpi();
  int rank = 0, size = 1;
  check(mpi.begin(&rank, &size), "MPI_Init_thread");
  if (size > 1) return std::shared_ptr<Ranks>(new Ranks(mpi, rank, size));
  check(mpi.end(), "MPI_Finalize");
  return nullptr;
}

Ranks::~Ranks() {
  if (ended_ || !is_first()) return;
  for (int rank = 1; rank < size_; ++rank) mpi_.send("", 0, rank, kGaveUp);
}

void Ranks::end() {
  ended_ = true;
  check(mpi_.end(), "MPI_Finalize");
}

void Ranks::send(int to, int tag, const std::string& bytes) {
  if (bytes.size() > INT_MAX) throw std::runtime_error("ranks: a share is too large for one message of MPI");
  check(mpi_.send(bytes.data(), static_cast<int>(bytes.size()), to, tag), "MPI_Send");
}

std::optional<Ranks::Message> Ranks::received() {
  Message message;
  int there = 0, count = 0;
  check(mpi_.look(&there, &message.from, &message.tag, &count), "MPI_Iprobe");
  if (!there) return std::nullopt;
  message.bytes.resize(static_cast<size_t>(count));
  check(mpi_.receive(message.bytes.data(), count, message.from, message.tag), "MPI_Recv");
  first_gave_up_ = message.tag == kGaveUp && message.from == 0;
  if (message.tag == kGaveUp)
    throw std::runtime_error(is_first() ? fmt::format("ranks: rank {} gave up: {}", message.from, message.bytes)
                                        : "ranks: the first rank gave up");
  return message;
}

void Ranks::give_up(const std::string& why) {
  if (!first_gave_up_) send(0, kGaveUp, why);
  const auto until = std::chrono::steady_clock::now() + kPatience;
  for (; std::chrono::steady_clock::now() < until; std::this_thread::sleep_for(kLook)) {
    int there = 0, from = 0, tag = 0, count = 0;
    mpi_.look(&there, &from, &tag, &count);  // MPI gets on with what was sent while it is asked for something
  }
}

std::string Ranks::computed(const std::string& share, const Compute& compute) {
  struct Busy {
    explicit Busy(std::atomic<bool>& flag) : flag_(flag) { flag_ = true; }
    ~Busy() { flag_ = false; }
    std::atomic<bool>& flag_;
  } busy(busy_);
  return compute(share);
}

size_t Ranks::parts_of(size_t units, size_t per_core) const {
  const auto ranks = static_cast<size_t>(size_);
  const size_t filling = per_core * std::max(1u, std::thread::hardware_concurrency());
  return std::clamp(units / filling, std::min(ranks, units), 4 * ranks);
}

std::vector<std::string> Ranks::share_out(const std::vector<std::string>& shares, const Compute& compute) {
  std::vector<std::string> results(shares.size());
  std::vector<size_t> share_of(static_cast<size_t>(size_), 0);  // a rank
  size_t next = 0, done = 0;
  const auto hand_out = [&](int rank) {
    if (next >= shares.size()) return;
    send(rank, kShare, shares[next]);
    share_of[static_cast<size_t>(rank)] = next++;
  };
  // The first rank computes beside its messages, so that no other waits for it.
  std::future<std::string> own;
  const auto begin_own = [&] {
    if (next >= shares.size()) return;
    share_of[0] = next++;
    own = std::async(std::launch::async, [&, share = share_of[0]] { return computed(shares[share], compute); });
  };
  begin_own();
  for (int rank = 1; rank < size_; ++rank) hand_out(rank);
  while (done < shares.size()) {
    if (auto message = received()) {
      results[share_of[static_cast<size_t>(message->from)]] = std::move(message->bytes);
      ++done;
      hand_out(message->from);
    } else if (!own.valid()) {
      std::this_thread::sleep_for(kLook);
    } else if (own.wait_for(kLook) == std::future_status::ready) {
      results[share_of[0]] = own.get();
      ++done;
      begin_own();
    }
  }
  return results;
}

void Ranks::answer(const std::string& bytes) {
  for (int rank = 1; rank < size_; ++rank) send(rank, kAnswer, bytes);
}

std::string Ranks::follow(const Compute& compute) {
  for (;; std::this_thread::sleep_for(kLook)) {
    auto message = received();
    if (!message) continue;
    if (message->tag == kAnswer) return std::move(message->bytes);
    send(0, kResult, computed(message->bytes, compute));
  }
}

}  // namespace selvedge::model
