// Diagnosing a campaign: where the gap between recording and base model lies, what it is fixed to, which effects close
// it, how far, and what to record next.
//
//   1. base      take the base model as it was fitted, or fit it (base_fit.h)
//   2. windows   predictions a short time ahead (windows.h), and how they change with everything that a model may have
//                (linearisation.h)
//   3. weigh     none, every effect, pairs and threes, each with and without something unknown (effect_sets.h); again
//                about the likeliest of them
//   4. budget    what each effect of the likeliest set takes of the gap (budget.h), and the force that is still missing
//                (missing_force.h)
//   5. where     what the base leaves, split by region, time, frequency, regime and image row (where.h)
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "capture/trial/trial.h"
#include "diagnose/diagnosis_result.h"

namespace selvedge::diagnose {

struct DiagnosisOptions {
  StudyOptions study;
  std::function<void(const BaseFit&)> on_base_fit;  // called once it is there
  std::string input;                                // input_of() all this, where it is known already
  std::optional<FittedSimulator> other;             // a program whose gap is told as well (other_simulator.h)
};

// The hash of what a diagnosis rests on: recordings, settings, code.
std::string input_of(const DiagnosisOptions& options, const trial::Campaign& campaign);

// Sets options.input. Goes on from the base fit that `file` holds of this campaign, these settings and this code, and
// keeps it there once it is found.
void keep_base_fit(DiagnosisOptions& options, const std::filesystem::path& file, const trial::Campaign& campaign);

// Begins with the parameters of the campaign's fit.json, where one of the folders has one of this very campaign and
// drag law. Returns its path, or nothing.
std::optional<std::filesystem::path> begin_with_fit(DiagnosisOptions& options, const trial::Campaign& campaign,
                                                    const std::vector<std::filesystem::path>& folders);

Diagnosis diagnose(const trial::Campaign& campaign, const std::vector<Effect>& effects,
                   const DiagnosisOptions& options = {});

}  // namespace selvedge::diagnose
