// Another program as the simulator of a fit, over `simulator/1` (protocol.h).
//
// It is started as often as it likes and as there are threads; each process serves many runs. Where it breaks the
// protocol (hangs, exits, answers not-a-number, too little, too much or nonsense), the first to notice throws BadInput,
// and all its processes end with this object.
#pragma once

#include <condition_variable>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "model/simulator.h"
#include "station/simulator/protocol.h"
#include "station/talking_process.h"

namespace selvedge::station {

struct ForeignOptions {
  std::filesystem::path log;  // its standard error goes there
  double run_limit_s = 60;    // for a run, and for what it says first
  int processes = 0;          // at most; 0: as many as there are threads
};

// Places of the points, one 3 × points a time; or why there are none.
struct ForeignPositions {
  std::vector<double> numbers;  // for each time, in it for each point: x, y, z
  std::string error;
};

// One process of it. A thread at a time.
class ForeignProcess {
 public:
  ForeignProcess(std::string name, const std::string& command, const ForeignOptions& options);

  const SimulatorHello& hello();  // waits for it
  // Runs of these trials, in order; Run::trial is an index into trials, which keep their meaning from call to call.
  // Throws BadInput.
  std::vector<ForeignPositions> run(const std::vector<std::shared_ptr<const SimulatorTrial>>& trials,
                                    std::vector<SimulatorRun> runs);
  bool ends_when_told(double wait_s) { return talk_.ends_when_told(wait_s); }

 private:
  ForeignPositions answer_to(const SimulatorRun& run, const SimulatorTrial& trial, TalkDeadline deadline);

  std::string name_;
  TalkingProcess talk_;
  double limit_s_;
  std::unique_ptr<SimulatorHello> hello_;
  std::vector<std::shared_ptr<const SimulatorTrial>> told_;  // by their numbers
  int next_run_ = 1;
};

class ForeignSimulator : public model::Simulator {
 public:
  // command: a line for the shell. Call it from a thread that outlives the simulator. Throws BadInput where it does not
  // say what it can do.
  ForeignSimulator(const std::string& command, const ForeignOptions& options);
  ~ForeignSimulator() override;

  const SimulatorHello& hello() const { return hello_; }

  std::string name() const override;
  std::string identity() const override;
  std::vector<model::Parameter> parameters() const override;
  bool begins_at_shapes() const override { return hello_.start_shape; }
  std::vector<cloth::Trajectory> simulate(const cloth::spline::SplineSheet& sheet,
                                          const std::vector<cloth::Experiment>& lanes) const override;
  std::string last_divergence() const override;

 private:
  int number_of(SimulatorTrial trial) const;
  SimulatorRun run_of(const cloth::spline::SplineSheet& sheet, const cloth::Experiment& lane) const;
  std::vector<ForeignPositions> run_on_a_process(std::vector<SimulatorRun> runs) const;

  std::string command_;
  SimulatorHello hello_;
  mutable std::mutex mutex_;  // of all below
  mutable std::condition_variable freed_;
  std::vector<std::unique_ptr<ForeignProcess>> processes_;
  mutable std::vector<ForeignProcess*> free_;
  mutable std::vector<std::shared_ptr<const SimulatorTrial>> trials_;
  mutable size_t next_trial_ = 0;
  mutable std::string last_divergence_;
};

// What is asked of a simulator for an experiment on a sheet: places of its greville_points at the samples.
SimulatorTrial simulator_trial(const cloth::spline::SplineSheet& sheet, const cloth::Experiment& experiment);

}  // namespace selvedge::station
