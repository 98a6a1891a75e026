// The base fit of a campaign: from its trials to a Study at the fitted parameters.
//
// Whatever comes after begins with what a BaseFit holds and nothing else. So an answer does not depend on whether the
// fit was made just now or read from a file.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "capture/trial/trial.h"
#include "diagnose/study.h"
#include "report/progress.h"

namespace selvedge::diagnose {

// Where a base fit ended: parameters alone, or with the branches that it found.
struct BaseFit {
  Eigen::VectorXd coordinates;
  long cells = 0;                        // of the usual grid, along the width; 0: to be chosen
  std::vector<Eigen::Matrix3Xd> branch;  // of each trial on the usual grid; empty: to be found, or fitted on a coarser
  // What the sensors' clock was fitted to beside them, by name: its delay and how that grows; empty: it was not.
  std::map<std::string, double> clock = {};
};

// input: the hash of what the fit rests on (estimate/kept_input.h).
void write_base_fit(const std::filesystem::path& file, const BaseFit& fit, const std::string& input);
// Nothing where there is no such file, or where it is of another form, or rests on another input.
std::optional<BaseFit> read_base_fit(const std::filesystem::path& file, const std::string& input);

struct StudyOptions {
  model::Drag drag = model::Drag::nonlinear;
  Protocol protocol;
  std::optional<Eigen::VectorXd> fitted;  // coordinates of the base that a fit without a clock found: it begins there
  std::optional<BaseFit> base_fit;        // found before: it is taken as it is
  // Replaces what was seen of the trials by something else that moved so; empty: nothing does.
  std::function<void(std::vector<model::ObservedTrial>&)> seen_instead;
  report::ProgressCallback progress = [](double, const std::string&) {};
  cloth::StopFlag stop;  // a diagnosis then throws cloth::Stopped
};

struct FittedStudy {
  Study study;
  BaseFit base_fit;
};

// Takes the base as it was found before, or fits it with the sensors' clock; effects that the campaign cannot show are
// left out.
FittedStudy make_study(const trial::Campaign& campaign, const std::vector<Effect>& effects,
                       const StudyOptions& options);

}  // namespace selvedge::diagnose
