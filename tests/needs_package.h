// A test that cannot run for want of a Debian package: skipped on a person's machine, failed in CI (CI=true), where
// packages.txt is installed and a skip would hide that it lacks one.
#pragma once

#include <cstdlib>
#include <string>

#include <gtest/gtest.h>

namespace selvedge {

inline bool in_ci() {
  const char* ci = std::getenv("CI");
  return ci && std::string(ci) == "true";
}

}  // namespace selvedge

// In a test's own body or SetUp. there: whether what is needed is here; package: as packages.txt names it; untried:
// what is then not tested.
#define SELVEDGE_NEEDS(there, package, untried)                                                           \
  if (there) {                                                                                            \
  } else if (selvedge::in_ci())                                                                           \
    GTEST_FAIL() << "package " << (package) << " is not here, packages.txt has to name it: " << (untried) \
                 << ": NOT tried";                                                                        \
  else GTEST_SKIP() << "SKIPPED: package " << (package) << " is not installed; " << (untried) << ": NOT tried"
