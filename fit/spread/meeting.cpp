// How the ranks meet: the first listens, MPI tells the others where, they connect.
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <random>
#include <sstream>
#include <stdexcept>

#include <arpa/inet.h>
#include <dlfcn.h>
#include <fmt/format.h>
#include <ifaddrs.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "fit/spread/ranks.h"

namespace selvedge::fit {

namespace {

constexpr size_t kTokenLength = 32, kHelloLength = kTokenLength + 8;
constexpr int kMeeting_s = 60;

int launched_size() {
  for (const char* name : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "MPI_LOCALNRANKS"})
    if (const char* value = std::getenv(name)) return std::atoi(value);
  return 1;
}

// MPI behind a library that is loaded for the meeting alone.
class Mpi {
 public:
  Mpi() {
    // Beside the binary in a build folder, in lib/selvedge where it is installed.
    const std::filesystem::path folder = std::filesystem::read_symlink("/proc/self/exe").parent_path();
    std::filesystem::path module = folder / "libselvedge_mpi.so";
    if (!std::filesystem::exists(module)) module = folder.parent_path() / "lib" / "selvedge" / "libselvedge_mpi.so";
    library_ = ::dlopen(module.c_str(), RTLD_NOW | RTLD_GLOBAL);
    if (!library_)
      throw std::runtime_error(
          fmt::format("ranks: an MPI launcher started this process, but MPI cannot be loaded: {}", ::dlerror()));
    check(function<int (*)(int*, int*, int*)>("selvedge_mpi_begin")(&rank, &size, &one_host));
  }
  std::string tell(std::string text) {
    text.resize(4096);
    check(function<int (*)(char*, int)>("selvedge_mpi_tell")(text.data(), static_cast<int>(text.size())));
    return text.c_str();
  }
  void end() { check(function<int (*)()>("selvedge_mpi_end")()); }

  int rank = 0, size = 1, one_host = 0;

 private:
  template <class Function>
  Function function(const char* name) {
    return reinterpret_cast<Function>(::dlsym(library_, name));
  }
  static void check(int error) {
    if (error != 0) throw std::runtime_error(fmt::format("ranks: MPI error {}", error));
  }
  void* library_ = nullptr;
};

[[noreturn]] void fail(const char* step) {
  throw std::runtime_error(fmt::format("ranks: {}: {}", step, std::strerror(errno)));
}

// A machine that vanishes closes no connection; after about a minute without a sign of life it counts as gone.
void keep_watch(int connection) {
  const auto set = [&](int level, int name, int value) { ::setsockopt(connection, level, name, &value, sizeof value); };
  set(IPPROTO_TCP, TCP_NODELAY, 1);
  set(SOL_SOCKET, SO_KEEPALIVE, 1);
  set(IPPROTO_TCP, TCP_KEEPIDLE, 30);
  set(IPPROTO_TCP, TCP_KEEPINTVL, 10);
  set(IPPROTO_TCP, TCP_KEEPCNT, 3);
}

std::string random_token() {
  std::random_device device;  // a secret between the ranks, nothing that a result depends on
  std::string token;
  while (token.size() < kTokenLength) token += fmt::format("{:08x}", device());
  return token;
}

std::string own_addresses() {
  std::string all;
  ifaddrs* list = nullptr;
  if (::getifaddrs(&list) != 0) fail("getifaddrs");
  for (const ifaddrs* i = list; i; i = i->ifa_next) {
    if (!i->ifa_addr || i->ifa_addr->sa_family != AF_INET) continue;
    std::array<char, INET_ADDRSTRLEN> text{};
    ::inet_ntop(AF_INET, &reinterpret_cast<const sockaddr_in*>(i->ifa_addr)->sin_addr, text.data(), text.size());
    if (std::string(text.data()).rfind("127.", 0) != 0) all += std::string(" ") + text.data();
  }
  ::freeifaddrs(list);
  return all;
}

sockaddr_in address_of(in_addr_t host, int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = host;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  return address;
}

int listen_anywhere(bool one_host, int& port) {
  const int listener = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (listener < 0) fail("socket");
  sockaddr_in address = address_of(htonl(one_host ? INADDR_LOOPBACK : INADDR_ANY), 0);
  if (::bind(listener, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0 || ::listen(listener, 1024) != 0)
    fail("listen");
  socklen_t length = sizeof address;
  if (::getsockname(listener, reinterpret_cast<sockaddr*>(&address), &length) != 0) fail("getsockname");
  port = ntohs(address.sin_port);
  return listener;
}

// The rank that a fresh connection names with the right token, or −1.
int greeted(int connection, const std::string& token, int size) {
  timeval limit{5, 0};
  ::setsockopt(connection, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
  std::string hello(kHelloLength, '\0');
  const bool whole = ::recv(connection, hello.data(), hello.size(), MSG_WAITALL) == static_cast<ssize_t>(hello.size());
  limit = {0, 0};
  ::setsockopt(connection, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
  if (!whole || hello.compare(0, kTokenLength, token) != 0) return -1;
  const int rank = std::atoi(hello.c_str() + kTokenLength);
  return rank > 0 && rank < size ? rank : -1;
}

// Connections of all ranks that came within a minute, in the order of their numbers.
std::vector<int> gather(int listener, const std::string& token, int size) {
  std::vector<int> of_rank(static_cast<size_t>(size), -1);
  int missing = size - 1;
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(kMeeting_s);
  while (missing > 0) {
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(end - std::chrono::steady_clock::now()).count();
    pollfd waiting{listener, POLLIN, 0};
    if (left <= 0 || ::poll(&waiting, 1, static_cast<int>(left)) <= 0) break;
    const int connection = ::accept4(listener, nullptr, nullptr, SOCK_CLOEXEC);
    if (connection < 0) continue;
    const int rank = greeted(connection, token, size);
    if (rank < 0 || of_rank[static_cast<size_t>(rank)] >= 0) {
      ::close(connection);
      continue;
    }
    keep_watch(connection);
    of_rank[static_cast<size_t>(rank)] = connection;
    --missing;
  }
  ::close(listener);
  std::erase(of_rank, -1);
  return of_rank;
}

int connect_to(const std::string& host, int port) {
  sockaddr_in address = address_of(0, port);
  if (::inet_pton(AF_INET, host.c_str(), &address.sin_addr) != 1) return -1;
  const int connection = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const timeval limit{10, 0};  // of connecting: the host may not be reachable under every address that it has
  ::setsockopt(connection, SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof limit);
  if (::connect(connection, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) {
    ::close(connection);
    return -1;
  }
  const timeval none{0, 0};
  ::setsockopt(connection, SOL_SOCKET, SO_SNDTIMEO, &none, sizeof none);
  keep_watch(connection);
  return connection;
}

// told: "TOKEN PORT ADDRESS …".
int connect_to_first(const std::string& told, int rank) {
  std::istringstream in(told);
  std::string token, host;
  int port = 0;
  in >> token >> port;
  while (in >> host) {
    const int connection = connect_to(host, port);
    if (connection < 0) continue;
    const std::string hello = fmt::format("{}{:08}", token, rank);
    if (::send(connection, hello.data(), hello.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(hello.size()))
      return connection;
    ::close(connection);
  }
  throw std::runtime_error("ranks: the first rank cannot be reached at any of its addresses");
}

}  // namespace

std::shared_ptr<Ranks> Ranks::join() {
  if (launched_size() <= 1) return nullptr;
  Mpi mpi;
  if (mpi.size <= 1) {
    mpi.end();
    return nullptr;
  }
  if (mpi.rank > 0) {
    const std::string told = mpi.tell("");
    mpi.end();
    return std::make_shared<Ranks>(false, std::vector<int>{connect_to_first(told, mpi.rank)});
  }
  int port = 0;
  const int listener = listen_anywhere(mpi.one_host != 0, port);
  const std::string token = random_token();
  mpi.tell(fmt::format("{} {}{}", token, port, mpi.one_host != 0 ? " 127.0.0.1" : own_addresses()));
  mpi.end();
  return std::make_shared<Ranks>(true, gather(listener, token, mpi.size));
}

}  // namespace selvedge::fit
