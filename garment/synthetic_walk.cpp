#include "garment/synthetic_walk.h"

#include <cmath>
#include <numbers>

#include <fmt/format.h>

namespace selvedge::garment {

namespace {

std::string leg(const std::string& side, double out_cm) {
  return fmt::format(
      "  JOINT {0}UpLeg\n  {{\n    OFFSET {1} -4 0\n    CHANNELS 3 Zrotation Xrotation Yrotation\n"
      "    JOINT {0}Leg\n    {{\n      OFFSET 0 -42 0\n      CHANNELS 1 Xrotation\n"
      "      JOINT {0}Foot\n      {{\n        OFFSET 0 -41 0\n        CHANNELS 1 Xrotation\n"
      "        End Site\n        {{\n          OFFSET 0 -5 15\n        }}\n      }}\n    }}\n  }}\n",
      side, out_cm);
}

}  // namespace

std::string synthetic_walk(double duration_s, double frames_per_s) {
  std::string text =
      "HIERARCHY\nROOT Hips\n{\n  OFFSET 0 0 0\n  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation "
      "Yrotation\n"
      "  JOINT Spine\n  {\n    OFFSET 0 12 0\n    CHANNELS 1 Yrotation\n    End Site\n    {\n      OFFSET 0 40 0\n    "
      "}\n  }\n";
  text += leg("Left", 9) + leg("Right", -9) + "}\n";
  const int frames = static_cast<int>(std::lround(duration_s * frames_per_s)) + 1;
  text += fmt::format("MOTION\nFrames: {}\nFrame Time: {:.7f}\n", frames, 1 / frames_per_s);
  for (int f = 0; f < frames; ++f) {
    const double t = f / frames_per_s, phase = 2 * std::numbers::pi * 0.9 * t;
    text += fmt::format("{:.2f} {:.2f} {:.2f} 0 4 {:.2f} {:.2f}", 1.0 * std::sin(phase), 92 + 2 * std::cos(2 * phase),
                        110 * t, 6 * std::cos(phase), -6 * std::cos(phase));
    for (const double side : {0.0, std::numbers::pi}) {
      const double hip = -25 * std::sin(phase + side), swing = std::max(0.0, std::cos(phase + side));
      text += fmt::format(" 0 {:.2f} 0 {:.2f} {:.2f}", hip, 5 + 45 * swing * swing, -10 * swing);
    }
    text += "\n";
  }
  return text;
}

std::vector<Limb> walker_limbs() {
  return {{"Hips", "Spine", 0.1},          {"Spine", "Spine-end", 0.105},      {"LeftUpLeg", "RightUpLeg", 0.085},
          {"LeftUpLeg", "LeftLeg", 0.07},  {"RightUpLeg", "RightLeg", 0.07},   {"LeftLeg", "LeftFoot", 0.05},
          {"RightLeg", "RightFoot", 0.05}, {"LeftFoot", "LeftFoot-end", 0.04}, {"RightFoot", "RightFoot-end", 0.04}};
}

}  // namespace selvedge::garment
