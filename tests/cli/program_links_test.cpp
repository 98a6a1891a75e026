// What each program holds, by its symbols: a lab's knows no simulated world, no peer and no proof.
#include <cstdio>
#include <string>

#include <gtest/gtest.h>

namespace selvedge::cli {
namespace {

// nm's list, names as the compiler mangles them.
std::string symbols_of(const std::string& program) {
  std::string text;
  FILE* pipe = ::popen(("nm '" + program + "'").c_str(), "r");
  for (char part[65536]; size_t n = std::fread(part, 1, sizeof part, pipe);) text.append(part, n);
  EXPECT_EQ(::pclose(pipe), 0) << "nm " << program;
  return text;
}

// Of namespaces selvedge::hardware_sim and selvedge::sim; of functions of mrcal; of proofs and timings.
const std::string kWorld = "8selvedge12hardware_sim", kDevice = "8selvedge3sim", kPeer = " mrcal_",
                  kProof = "8selvedge3cli12prove_format", kBench = "8selvedge3cli9bench_fit";

bool holds(const std::string& symbols, const std::string& part) { return symbols.find(part) != std::string::npos; }

TEST(ProgramLinks, TheLabsHoldsNoWorldNoPeerAndNoProof) {
  const std::string lab = symbols_of(SELVEDGE_BINARY);
  for (const std::string& part : {kWorld, kDevice, kPeer, kProof, kBench}) EXPECT_FALSE(holds(lab, part)) << part;
  EXPECT_TRUE(holds(lab, "8selvedge3cli7add_fit"));  // so that a stripped program is no proof
}

TEST(ProgramLinks, TheSimulatedRigHoldsNoPeerAndNoProof) {
  const std::string simulation = symbols_of(SELVEDGE_BINARY "-sim");
  for (const std::string& part : {kPeer, kProof, kBench}) EXPECT_FALSE(holds(simulation, part)) << part;
  for (const std::string& part : {kWorld, kDevice}) EXPECT_TRUE(holds(simulation, part)) << part;
}

TEST(ProgramLinks, WhatIsLookedForIsThereWhereItBelongs) {
  const std::string verify = symbols_of(SELVEDGE_BINARY "-verify");
  for (const std::string& part : {kWorld, kDevice, kPeer, kProof, kBench}) EXPECT_TRUE(holds(verify, part)) << part;
}

}  // namespace
}  // namespace selvedge::cli
