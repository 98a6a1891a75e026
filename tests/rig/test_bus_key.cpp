// The key that one user's processes share: made once, whole, and never taken from where others reach.
#include "rig/bus_key.h"

#include <algorithm>
#include <fstream>
#include <iterator>

#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "files/whole_file.h"
#include "tests/refusal.h"
#include "tests/rig/temporary_folder.h"

namespace selvedge::rig {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

class BusKeyTest : public ::testing::Test {
 protected:
  std::string refusal() const {
    return refusal_of([&] { shared_bus_key(file_); });
  }
  TemporaryFolder folder_;
  const fs::path file_ = folder_.path() / "bus.key";
};

TEST_F(BusKeyTest, IsMadeOnceForTheUserAlone) {
  const BusKey first = shared_bus_key(file_);
  EXPECT_EQ(shared_bus_key(file_), first);
  struct stat found {};
  ASSERT_EQ(::stat(file_.c_str(), &found), 0);
  EXPECT_EQ(found.st_mode & 07777, 0600u);
  EXPECT_EQ(found.st_size, 32);
  const std::string bytes = files::read_whole(file_);
  EXPECT_TRUE(std::equal(first.begin(), first.end(), bytes.begin(), bytes.end(),
                         [](uint8_t a, char b) { return a == static_cast<uint8_t>(b); }));
  EXPECT_NE(shared_bus_key(folder_.path() / "other.key"), first);
}

TEST_F(BusKeyTest, ThatOthersCouldReadIsRefused) {
  shared_bus_key(file_);
  for (const mode_t mode : {0644u, 0640u, 0604u, 0620u, 0601u}) {
    ASSERT_EQ(::chmod(file_.c_str(), mode), 0);
    EXPECT_THAT(refusal(), AllOf(HasSubstr(file_.string()), HasSubstr(fmt::format("mode {:o}, expected 600", mode))));
  }
  ASSERT_EQ(::chmod(file_.c_str(), 0400), 0);
  EXPECT_EQ(refusal(), "");
}

// Root gives a key away; anybody else points at a file of root's.
TEST_F(BusKeyTest, OfAnotherUserIsRefused) {
  shared_bus_key(file_);
  fs::path foreign = "/etc/passwd";
  if (::geteuid() == 0) {
    foreign = file_;
    ASSERT_EQ(::chown(file_.c_str(), 65534, 65534), 0);
  }
  EXPECT_THAT(refusal_of([&] { shared_bus_key(foreign); }),
              AllOf(HasSubstr(foreign.string()), HasSubstr("belongs to user")));
}

TEST_F(BusKeyTest, OfAnotherSizeOrKindIsRefused) {
  for (const size_t size : {0u, 31u, 33u}) {
    std::ofstream(file_) << std::string(size, 'x');
    ASSERT_EQ(::chmod(file_.c_str(), 0600), 0);
    EXPECT_THAT(refusal(), AllOf(HasSubstr(file_.string()), HasSubstr(fmt::format("{} bytes, expected 32", size))));
  }
  fs::remove(file_);
  shared_bus_key(folder_.path() / "true.key");
  fs::create_symlink(folder_.path() / "true.key", file_);
  EXPECT_THAT(refusal(), AllOf(HasSubstr(file_.string()), HasSubstr("is a link")));
  fs::remove(file_);
  ASSERT_EQ(::mkfifo(file_.c_str(), 0600), 0);
  EXPECT_THAT(refusal(), AllOf(HasSubstr(file_.string()), HasSubstr("no plain file")));
  EXPECT_THAT(refusal_of([&] { shared_bus_key(folder_.path() / "missing" / "bus.key"); }),
              AllOf(HasSubstr("missing/bus.key"), HasSubstr("cannot be made")));
}

// A process that writes the key it got into `out`, as soon as `start` is closed at its other end.
pid_t key_process(const fs::path& file, int start, int not_mine, int out) {
  const pid_t child = ::fork();
  if (child != 0) return child;
  ::close(not_mine);
  char none;
  [[maybe_unused]] const ssize_t end = ::read(start, &none, 1);
  BusKey key{};
  if (!refusal_of([&] { key = shared_bus_key(file); }).empty()) ::_exit(1);
  ::_exit(::write(out, key.data(), key.size()) == static_cast<ssize_t>(key.size()) ? 0 : 1);
}

TEST_F(BusKeyTest, OfTwoProcessesAtOnceIsOne) {
  for (int round = 0; round < 100; ++round) {
    const fs::path file = folder_.path() / fmt::format("{}.key", round);
    int start[2], out[2];
    ASSERT_EQ(::pipe(start), 0);
    ASSERT_EQ(::pipe(out), 0);
    const pid_t processes[] = {key_process(file, start[0], start[1], out[1]),
                               key_process(file, start[0], start[1], out[1])};
    ::close(start[0]);
    ::close(start[1]);
    ::close(out[1]);
    BusKey keys[2] = {};
    for (BusKey& key : keys) EXPECT_EQ(::read(out[0], key.data(), key.size()), static_cast<ssize_t>(key.size()));
    ::close(out[0]);
    for (const pid_t process : processes) {
      int status = 0;
      ASSERT_EQ(::waitpid(process, &status, 0), process);
      EXPECT_EQ(status, 0) << "round " << round;
    }
    EXPECT_EQ(keys[0], keys[1]) << "round " << round;
    EXPECT_EQ(shared_bus_key(file), keys[0]) << "round " << round;
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_.path()), {}), 100) << "something lies beside the keys";
}

}  // namespace
}  // namespace selvedge::rig
