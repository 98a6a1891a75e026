// What must hold of a stopped robot trial on any machine, however slow: `prove arm` on a simulated rig. Its times are
// the proof's own.
#include <sstream>

#include <gtest/gtest.h>

#include "cli/verify/proofs/damaged_trials.h"
#include "tests/cli/run_binary.h"

namespace selvedge::cli {
namespace {

TEST(ArmProof, AStoppedTrialSendsNothingAsksAndGoesOnAfterTheWord) {
  const ScratchFolder scratch;
  std::filesystem::create_directory(scratch.path() / "work");
  const Ran proof = run_binary("prove arm --quick", scratch.path() / "work");
  std::istringstream lines(proof.out);
  int silent = 0, asked = 0;
  for (std::string line; std::getline(lines, line);) {
    const bool holds = line.find("holds") != std::string::npos;
    silent += holds && line.find(": set-points in the") != std::string::npos;
    asked += holds && line.find(": the session asks, and goes on after the word") != std::string::npos;
  }
  EXPECT_EQ(silent, 3) << proof.out << proof.err;
  EXPECT_EQ(asked, 3) << proof.out << proof.err;
}

}  // namespace
}  // namespace selvedge::cli
