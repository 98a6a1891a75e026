// A running arm's daemon for each test.
#pragma once

#include <gtest/gtest.h>

#include "hardware_sim/running_arm/running_arm.h"

namespace selvedge::tests {

class ArmFixture : public testing::Test, protected hardware_sim::RunningArm {
 protected:
  ArmFixture() : RunningArm(SELVEDGE_SOURCE_DIR "/data/arms/ur5e.toml") {}
};

}  // namespace selvedge::tests
