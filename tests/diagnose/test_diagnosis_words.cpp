// What a diagnosis says in words, and that what cannot be told is not given as a number.
#include "diagnose/diagnosis_words.h"

#include <cmath>

#include <gtest/gtest.h>

#include "diagnose/diagnosis_verdict.h"

namespace selvedge::diagnose {
namespace {

Diagnosis of_groups(size_t groups, double half) {
  Diagnosis d;
  d.groups = groups;
  d.gap_mm = 0.11;
  d.low_mm = 0.11 - half;
  d.high_mm = 0.11 + half;
  d.p_value = 0.02;
  return d;
}

TEST(DiagnosisWords, AnIntervalThatCannotBeToldIsNotGiven) {
  const std::string one = gap_in_words(of_groups(1, std::nan("")));
  EXPECT_NE(one.find("cannot be told"), std::string::npos) << one;
  for (const char* wrong : {"nan", "90 %", "0.11 to 0.11", "(p)"}) EXPECT_EQ(one.find(wrong), std::string::npos) << one;
  const std::string three = gap_in_words(of_groups(3, 0.05));
  EXPECT_NE(three.find("(90 %: 0.06 to 0.16 mm), a rough guess from 3 motions"), std::string::npos) << three;
  const std::string five = gap_in_words(of_groups(5, 0.05));
  EXPECT_EQ(five.find("rough"), std::string::npos) << five;
  EXPECT_NE(five.find("is 0.02 (p)"), std::string::npos) << five;
  EXPECT_EQ(interval_in_words(0.11, 0.11, 2), "");
}

TEST(DiagnosisWords, ADelayIsAClockThatIsLateOrEarly) {
  EXPECT_EQ(in_words({"delay", "s", 0.0066, 0.005, 0.0082}), "the camera's clock is late by 6.6 ms (5.0 to 8.2)");
  EXPECT_EQ(in_words({"delay", "s", -0.0066, -0.0082, -0.005}), "the camera's clock is early by 6.6 ms (5.0 to 8.2)");
  EXPECT_EQ(in_words({"air_y", "m/s", 0.217, 0.19, 0.25}), "air y 0.217 m/s (0.19 to 0.25)");
  EXPECT_EQ(in_words({"left_x", "m", -0.00045, -0.0006, 0.0002}), "left x -0.45 mm (-0.6 to 0.2)");
  EXPECT_EQ(in_words({"local_u", "m", 0.05, 0.02, 0.11}), "local u 0.05 m (0.02 to 0.11)");
  EXPECT_EQ(in_words({"local_mass", "kg", 2e-4, 1e-4, 3e-4}), "local mass 0.2 g (0.1 to 0.3)");
  EXPECT_EQ(in_words({"jitter_share", "", 1, 0.5, 2}), "jitter share 1 (0.5 to 2)");
}

TEST(DiagnosisWords, SaysHowLargeMayBeWhatIsNotNamed) {
  EffectFinding f;
  EXPECT_EQ(unseen_in_words(f), "any");
  f.at_most = {{"marker_du", "m", 0.0013, -0.0006, 0.0039}, {"share", "", 1, 0.5, 2}};
  EXPECT_EQ(unseen_in_words(f), "marker du -0.6 to 3.9 mm; share 0.5 to 2");
  EXPECT_EQ(in_words(f.at_most), "marker du 1.3 mm (-0.6 to 3.9); share 1 (0.5 to 2)");
}

TEST(DiagnosisWords, NoneSaysWhichEffectsTheTrialsCouldNotShow) {
  Diagnosis d = of_groups(3, 0.05);
  d.cause = "none";
  d.probability["none"] = 0.89;
  d.p_value = 0.9;
  EXPECT_EQ(verdict_of(d).sentence.find("could not show"), std::string::npos);
  d.cannot_tell = {"anisotropy", "mass_error"};
  const report::Verdict told = verdict_of(d);
  EXPECT_NE(told.sentence.find("could not show anisotropy, mass_error."), std::string::npos) << told.sentence;
  EXPECT_EQ(told.trust, report::Trust::full);
}

}  // namespace
}  // namespace selvedge::diagnose
