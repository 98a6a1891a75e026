// A person at a terminal, played by the other end of a pseudo terminal.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <cstdlib>
#include <unistd.h>

#include <string>

#include "capture/session/terminal.h"

namespace selvedge::session {
namespace {

class AtTheTerminal : public testing::Test {
 protected:
  void SetUp() override {
    person_ = ::posix_openpt(O_RDWR | O_NOCTTY);
    ASSERT_GE(person_, 0);
    ASSERT_EQ(::grantpt(person_), 0);
    ASSERT_EQ(::unlockpt(person_), 0);
    const int line = ::open(::ptsname(person_), O_RDWR | O_NOCTTY);
    ASSERT_GE(line, 0);
    before_ = ::dup(0);
    ASSERT_EQ(::dup2(line, 0), 0);
    ::close(line);
  }
  void TearDown() override {
    if (before_ >= 0) ::dup2(before_, 0);
    ::close(before_);
    ::close(person_);
  }
  void type(const std::string& text) {
    ASSERT_EQ(::write(person_, text.data(), text.size()), static_cast<ssize_t>(text.size()));
  }
  int person_ = -1, before_ = -1;
};

TEST_F(AtTheTerminal, AnAnswerIsALine) {
  Terminal terminal;
  ASSERT_TRUE(terminal.there());
  terminal.say("reset?");
  type("reset\n");
  EXPECT_EQ(terminal.line(2000), "reset");
  EXPECT_EQ(terminal.line(0), "");
}

// A word that lies there from before the stop lifts nothing.
TEST_F(AtTheTerminal, WhatWasTypedBeforeTheQuestionIsNoAnswer) {
  Terminal terminal;
  type("reset\nreset\n");
  terminal.say("reset?");
  EXPECT_EQ(terminal.line(100), "");
  type("reset\n");
  EXPECT_EQ(terminal.line(2000), "reset");
}

}  // namespace
}  // namespace selvedge::session
