#include "rig/bus_key.h"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <string>

#include <fcntl.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include "files/bad_input.h"

namespace selvedge::rig {

namespace {

namespace fs = std::filesystem;

class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor() {
    if (number_ >= 0) ::close(number_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  operator int() const { return number_; }

 private:
  int number_;
};

BusKey random_key() {
  BusKey key{};
  // Up to 256 bytes come whole, says the manual, once the kernel's pool is ready.
  if (::getrandom(key.data(), key.size(), 0) != static_cast<ssize_t>(key.size()))
    refuse("bus", "the kernel gives no random bytes for a key: {}", std::strerror(errno));
  return key;
}

// Written beside its place and linked into it: nobody meets half a key, and the second of two finds the first's.
void make_key(const fs::path& file) {
  const BusKey key = random_key();
  std::string beside = file.string() + ".XXXXXX";
  const Descriptor made(::mkostemp(beside.data(), O_CLOEXEC));  // O_EXCL, mode 600
  if (made < 0) refuse(file, "the bus's key cannot be made: {}", std::strerror(errno));
  const bool linked = ::write(made, key.data(), key.size()) == static_cast<ssize_t>(key.size()) && ::fsync(made) == 0 &&
                      (::link(beside.c_str(), file.c_str()) == 0 || errno == EEXIST);
  const int error = errno;
  ::unlink(beside.c_str());
  if (!linked) refuse(file, "the bus's key cannot be made: {}", std::strerror(error));
}

// What the descriptor shows is what is read: a name could be given to another file in between.
BusKey read_key(int descriptor, const fs::path& file) {
  struct stat found {};
  if (::fstat(descriptor, &found) != 0) refuse(file, "the bus's key: {}", std::strerror(errno));
  if (!S_ISREG(found.st_mode)) refuse(file, "the bus's key is no plain file");
  if (found.st_uid != ::geteuid())
    refuse(file, "the bus's key belongs to user {}, expected user {}: all processes of a rig are of one user",
           found.st_uid, ::geteuid());
  if ((found.st_mode & (S_IRWXG | S_IRWXO)) != 0)
    refuse(file, "the bus's key has mode {:o}, expected 600: others know it by now, so delete it and start all anew",
           found.st_mode & 07777);
  BusKey key{};
  if (found.st_size != static_cast<off_t>(key.size()) ||
      ::read(descriptor, key.data(), key.size()) != static_cast<ssize_t>(key.size()))
    refuse(file, "the bus's key has {} bytes, expected {}", found.st_size, key.size());
  return key;
}

}  // namespace

BusKey shared_bus_key(const fs::path& file) {
  for (bool made = false;; made = true) {
    // O_NONBLOCK: a pipe under that name must not hold the process up.
    const Descriptor descriptor(::open(file.c_str(), O_RDONLY | O_NOFOLLOW | O_CLOEXEC | O_NONBLOCK));
    if (descriptor >= 0) return read_key(descriptor, file);
    if (errno == ELOOP) refuse(file, "the bus's key is a link, expected a file of mode 600");
    if (errno != ENOENT || made) refuse(file, "the bus's key cannot be read: {}", std::strerror(errno));
    make_key(file);
  }
}

}  // namespace selvedge::rig
