// A session whose fits and diagnoses run as tasks of a Slurm job array; everything at the rig stays where the session
// is.
//
// The first fit or diagnosis that is due hands all planned ones to Slurm, the fits in one array and the diagnoses in
// another whose tasks wait each for its fabric's fit, from which a diagnosis begins; one that follows later (a
// follow-up, another attempt) is an array of one. Each task is `PROGRAM session run FILE --out FOLDER --step ID` and
// leaves FOLDER/slurm/STEP.json: {"result": …}, or {"failed": "why", "bad_input": true}. The session takes it from
// there, so that its journal has one writer. Slurm cancels a diagnosis whose fit failed; it is submitted again when its
// turn comes, after another attempt at the fit or without one.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <set>
#include <string>

#include "station/job_array.h"
#include "station/station_steps.h"

namespace selvedge::station {

class SlurmSteps : public SessionSteps {
 public:
  SlurmSteps(StationSteps& station, const SessionFile& file, const Journal& journal,
             const std::filesystem::path& folder, const SlurmOptions& options);

  nlohmann::json run(const Step& step, const report::ProgressCallback& progress) override;
  void set_aside(const Step& step) override { station_.set_aside(step); }
  std::vector<Step> follow_up(const Step& diagnosed) override { return station_.follow_up(diagnosed); }
  std::vector<Step> second_session(const Step& diagnosed) override { return station_.second_session(diagnosed); }

 private:
  std::vector<Step> due_with(const Step& step) const;
  void submit(const Step& step);
  void submit_alike(const std::vector<Step>& steps, JobArray::Submit which);
  std::string array_before(const Step& step) const;
  bool fit_has_failed(const Step& diagnosis) const;
  void forget_diagnosis_of(const Step& fit);
  size_t index_of(const Step& step) const;
  nlohmann::json taken(const Step& step, const std::shared_ptr<const JobArray>& array);

  StationSteps& station_;
  const SessionFile& file_;
  const Journal& journal_;
  const std::filesystem::path folder_;
  const SlurmOptions options_;
  std::map<std::string, std::shared_ptr<const JobArray>> arrays_;  // by step, where its answer was not taken yet
  std::set<std::string> failed_;                                   // steps that did, and were not done again
  bool planned_are_submitted_ = false;
};

// The task: that step alone, its answer into the session's folder. Returns the exit status. Throws BadInput where the
// file has no such fit or diagnosis.
int run_array_task(const SessionFile& file, const std::filesystem::path& folder, const std::string& step);

}  // namespace selvedge::station
