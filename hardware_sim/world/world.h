// The world that all simulated devices share: a fabric hung between a stand and a hand (or the arm), a marker
// board, and what camera and tracker see of them at any recent moment.
//
// The fabric is simulated on the host's own clock, 1/480 s at a time, as soon as that time has come; its states
// of the last seconds are kept, and what is asked for between two of them is interpolated (cubic, with
// velocities). Whoever asks for a moment that is not simulated yet waits. A slow host falls behind and catches
// up; nothing is skipped.
// A person at the rig obeys the session's prompts: shows the board, changes the swatch, hangs the fabric and steadies
// it with a hand, waves a corner, clips the corner to the arm, stands back. He may also run into a device before some
// trial. Thread-safe. Host clock: CLOCK_MONOTONIC, s. Motion-capture frame, m.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <future>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "hardware_sim/world/world_configuration.h"
#include "rig/projector/pattern.h"

namespace selvedge::hardware_sim {

// What the session asks of the person; rig/messages/operator_prompt_t.lcm.
struct Prompt {
  std::string step;
  int index = 0;
  double amplitude_m = 0, frequency_hz = 0, separation_m = 0, duration_s = 0;
};

struct SeenMarker {
  std::string subject, name;  // "fabric": "left", "right"; "grid": "g<row>_<column>"
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
};

enum class Clockwork { host, by_hand };  // by_hand: only advance_to moves the world, for tests

class World {
 public:
  explicit World(const WorldConfiguration& configuration, double start_s, Clockwork clockwork = Clockwork::host);
  ~World();

  // What the projector shows at a host time, and where the arm's tool point is (arm base frame; nullopt without
  // an arm). Set before the devices start.
  void set_pattern_source(std::function<projector::Pattern(double host_time_s)> pattern_at);
  void set_tool_source(std::function<std::optional<Eigen::Vector3d>(double host_time_s)> tool_at);

  void on_prompt(const Prompt& prompt, double host_time_s);
  void advance_to(double host_time_s);

  // Fills width × height bytes. False where the moment is older than what is kept, or did not come within 5 s.
  bool image_at(double host_time_s, unsigned char* pixels);
  std::vector<SeenMarker> markers_at(double host_time_s);

  // For tests: the fabric's nodes.
  Eigen::Matrix3Xd fabric_at(double host_time_s);
  const LatticeSheet& sheet() const { return sheet_; }
  const WorldConfiguration& configuration() const { return configuration_; }

 private:
  enum class Stage { empty, board, fabric };
  struct StageChange {
    double since_s = 0;
    Stage stage = Stage::empty;
    int pose = 0;
  };
  struct Moment {
    double time_s = 0;
    Eigen::Matrix3Xf position, velocity;
  };
  enum class Holder { hand, tool };

  void run();
  void advance_one();
  void begin_hanging(const Eigen::Vector3d& place, double at_s);
  void change_swatch(size_t index, double at_s);
  void settle(const Eigen::Vector3d& left, const Eigen::Vector3d& right);
  void obey(const Prompt& prompt, double at_s);
  Eigen::Vector3d right_corner(double t);
  StageChange stage_at(double t) const;
  bool wait_for(std::unique_lock<std::mutex>& lock, double t);
  Eigen::Matrix3Xd interpolated(double t) const;
  void board_image(int pose, bool after_knock, double host_time_s, unsigned char* pixels);
  void add_noise(const std::vector<float>& grey, unsigned char* pixels);

  WorldConfiguration configuration_;
  Clockwork clockwork_;
  LatticeSheet sheet_;
  std::vector<std::array<int, 3>> triangles_;
  std::function<projector::Pattern(double)> pattern_at_;
  std::function<std::optional<Eigen::Vector3d>(double)> tool_at_;

  std::mutex mutex_;  // of all below up to the picture
  std::condition_variable advanced_;
  double now_s_;  // simulated so far
  HandPath left_, right_;
  Holder holder_ = Holder::hand;
  double steady_until_s_ = 0;
  double clipped_s_ = 0;
  Eigen::Vector3d clipped_from_ = Eigen::Vector3d::Zero();
  std::deque<std::pair<double, Prompt>> prompts_;
  std::vector<StageChange> stages_;
  std::deque<Moment> moments_;
  bool hung_ = false;          // else the sheet lies aside and only time passes
  std::future<void> hanging_;  // the person hangs it; prompts wait
  double hangs_from_s_ = 0;
  int trials_ = 0;  // hung so far
  double knocked_from_s_ = std::numeric_limits<double>::infinity();
  bool stopping_ = false;

  std::mutex picture_mutex_;
  FabricPicture picture_;
  std::unique_ptr<FabricPicture> knocked_picture_;
  struct Board;
  std::unique_ptr<Board> board_;
  std::vector<float> noise_;
  std::mt19937 random_;

  std::thread thread_;
};

}  // namespace selvedge::hardware_sim
