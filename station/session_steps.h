// Runs the steps of a session one by one, so that none is done twice and a killed session goes on where it was.
//
//   calibrate → of each fabric: record every trial → of each fabric: fit → diagnose → (follow-up experiments, or a
//   second session and confirm) → summary
//
// People are needed at the rig for the recording alone; what follows needs only the files. What a step does is behind
// SessionSteps; here is the order, the journal, and what happens when a step fails.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "report/progress.h"
#include "station/diagnosis_folder.h"
#include "station/journal.h"
#include "station/session_file.h"

namespace selvedge::station {

struct Step {
  std::string kind;        // calibrate, record, fit, diagnose, confirm
  size_t fabric = 0;       // into SessionFile::fabrics
  std::string trial;       // record alone
  int round = 0;           // follow-up: 1, 2 …
  double expected_s = 10;  // for the progress
  bool second = false;     // record: of the second session, which is to confirm a diagnosis

  // "linen/record/waving-1", "linen/fit", "linen/fit-2" in the second round, "calibrate" or "linen/calibrate",
  // "linen/second/waving-1".
  std::string id(const SessionFile& file) const;
};

inline constexpr double kFit_s = 90, kDiagnosis_s = 300, kConfirm_s = 60,
                        kSecondTrial_s = 12;  // expected, of a usual campaign

// Nothing can go on: a step failed for good, or the operator said so. The session can be run again and goes on there.
class SessionStopped : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class SessionSteps {
 public:
  virtual ~SessionSteps() = default;
  // Does the step from its beginning. Returns what the journal keeps of it. Throws where it fails.
  virtual nlohmann::json run(const Step& step, const report::ProgressCallback& progress) = 0;
  // Keeps aside what an attempt left that failed or was cut off.
  virtual void set_aside(const Step& step) = 0;
  // Steps that follow from what the diagnosis of a fabric proposes.
  virtual std::vector<Step> follow_up(const Step& diagnosed) = 0;
  // The second session, and what it confirms; none where the diagnosis names no effect.
  virtual std::vector<Step> second_session(const Step& diagnosed) = 0;
};

enum class Answer { repeat, skip, stop };
using AskOperator = std::function<Answer(const std::string& question)>;

std::vector<Step> planned_steps(const SessionFile& file);

// Throws SessionStopped. A step that fails with BadInput is not repeated, for no repetition mends it.
void run_steps(const SessionFile& file, Journal& journal, SessionSteps& steps, const AskOperator& ask,
               const report::ProgressCallback& progress);

}  // namespace selvedge::station
