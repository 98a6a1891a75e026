// Where processes of one user meet, and what is no such place.
#include "rig/runtime_folder.h"

#include <cstdlib>
#include <fstream>
#include <string>

#include <sched.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/refusal.h"
#include "tests/rig/temporary_folder.h"

namespace selvedge::rig {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

class RuntimeFolder : public ::testing::Test {
 protected:
  void SetUp() override {
    ::unsetenv("RUNTIME_DIRECTORY");
    ::unsetenv("XDG_RUNTIME_DIR");
  }
  static mode_t mode(const fs::path& path) {
    struct stat found {};
    return ::stat(path.c_str(), &found) == 0 ? found.st_mode & 07777 : 0;
  }
  TemporaryFolder folder_;
  const fs::path top_ = folder_.path();
};

TEST_F(RuntimeFolder, IsTheUnitsThenTheLoginsThenTheUsersOwn) {
  EXPECT_EQ(runtime_folder(), fmt::format("/tmp/selvedge-{}", ::geteuid()));
  ::setenv("XDG_RUNTIME_DIR", top_.c_str(), 1);
  EXPECT_EQ(runtime_folder(), top_ / "selvedge");
  EXPECT_EQ(mode(top_ / "selvedge"), 0700u);
  ::setenv("RUNTIME_DIRECTORY", ((top_ / "unit").string() + ":" + (top_ / "second").string()).c_str(), 1);
  EXPECT_EQ(runtime_folder(), top_ / "unit");
  EXPECT_FALSE(fs::exists(top_ / "second"));
  EXPECT_EQ(runtime_folder(), top_ / "unit");  // once more, now that it is there
}

TEST_F(RuntimeFolder, MayBeReadByOthersAsSystemdMakesIt) {
  const fs::path folder = top_ / "unit";
  ::setenv("RUNTIME_DIRECTORY", folder.c_str(), 1);
  fs::create_directory(folder);
  ASSERT_EQ(::chmod(folder.c_str(), 0755), 0);
  EXPECT_EQ(runtime_folder(), folder);
}

TEST_F(RuntimeFolder, IsRefusedByNameWhereOthersReach) {
  const fs::path folder = top_ / "unit";
  ::setenv("RUNTIME_DIRECTORY", folder.c_str(), 1);
  const auto refusal = [] { return refusal_of([] { runtime_folder(); }); };
  fs::create_directory(folder);
  for (const mode_t open_to_others : {0770u, 0707u, 0777u}) {
    ASSERT_EQ(::chmod(folder.c_str(), open_to_others), 0);
    EXPECT_THAT(refusal(), AllOf(HasSubstr(folder.string()), HasSubstr("others may write"), HasSubstr("expected 700")));
  }
  fs::remove(folder);
  fs::create_directory(top_ / "own");
  fs::create_directory_symlink(top_ / "own", folder);
  EXPECT_THAT(refusal(), AllOf(HasSubstr(folder.string()), HasSubstr("is a link")));
  fs::remove(folder);
  std::ofstream(folder) << "a file";
  EXPECT_THAT(refusal(), AllOf(HasSubstr(folder.string()), HasSubstr("expected a folder")));
  ::setenv("RUNTIME_DIRECTORY", (top_ / "missing" / "unit").c_str(), 1);
  EXPECT_THAT(refusal(), AllOf(HasSubstr("missing/unit"), HasSubstr("No such file")));
  ::setenv("RUNTIME_DIRECTORY", "unit", 1);
  EXPECT_THAT(refusal(), HasSubstr("relative"));
}

// Root gives a folder away; anybody else points at one of root's.
TEST_F(RuntimeFolder, OfAnotherUserIsRefused) {
  fs::path folder = "/etc";
  if (::geteuid() == 0) {
    folder = top_ / "given-away";
    fs::create_directory(folder);
    ASSERT_EQ(::chown(folder.c_str(), 65534, 65534), 0);
  }
  ::setenv("RUNTIME_DIRECTORY", folder.c_str(), 1);
  EXPECT_THAT(refusal_of([] { runtime_folder(); }), AllOf(HasSubstr(folder.string()), HasSubstr("belongs to user")));
}

// The network namespaces of the simulated rig come with a user namespace, in which the user has another number.
TEST_F(RuntimeFolder, StaysTheUsersInAUserNamespace) {
  const fs::path before = runtime_folder();
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    const std::string map = fmt::format("1234 {} 1", ::geteuid());
    if (::unshare(CLONE_NEWUSER) != 0) ::_exit(2);
    std::ofstream("/proc/self/uid_map") << map;
    if (::geteuid() != 1234) ::_exit(3);
    ::_exit(refusal_of([&] {
              if (runtime_folder() != before) refuse("test", "another folder");
            }).empty()
                ? 0
                : 1);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0) << "2: no user namespace to be had, 3: no number in it, 1: another folder or none";
}

}  // namespace
}  // namespace selvedge::rig
