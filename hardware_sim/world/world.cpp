#include "hardware_sim/world/world.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "geometry/cubic.h"
#include "hardware_sim/synthetic_grid/synthetic_images.h"
#include "hardware_sim/world/smooth_step.h"
#include "rig/clock.h"

namespace selvedge::hardware_sim {

namespace {

constexpr double kChunkS = 1.0 / 480;
constexpr double kKeptS = 3;        // of the past
constexpr double kReactionS = 0.3;  // of the person, to a prompt
constexpr double kBoardUpS = 1.2;   // until the board stands still
constexpr double kHangS = 1.0;      // until the fabric hangs
constexpr double kSteadyS =
    2.5;  // that the person steadies the fabric with a hand, once it hangs; less if told to stand back
constexpr double kHandBrake = 8;  // 1/s, of every node's velocity under that hand
constexpr size_t kNoiseTable = 1 << 18;

bool is(const Prompt& prompt, const char* step) { return prompt.step == step; }

}  // namespace

// The board as the camera sees it in the pose shown last; taking it in is slow, lighting it is not.
struct World::Board {
  int pose = -1;
  bool after_knock = false;
  BoardLook look;
  BoardView view;
};

World::World(const WorldConfiguration& configuration, double start_s, Clockwork clockwork)
    : configuration_(configuration), clockwork_(clockwork), sheet_(configuration.fabric, configuration.lattice),
      triangles_(sheet_.triangles()), now_s_(start_s), left_(configuration.left_m, configuration.hand),
      right_(configuration.left_m + configuration.separation_m * Eigen::Vector3d::UnitX(), configuration.hand),
      picture_(configuration.camera, configuration.projector, configuration.picture), board_(std::make_unique<Board>()),
      random_(configuration.seed) {
  std::normal_distribution<float> normal(0, float(configuration.noise_grey));
  noise_.resize(kNoiseTable);
  for (float& value : noise_) value = configuration.noise_grey > 0 ? normal(random_) : 0;
  stages_.push_back({start_s, Stage::empty, 0});
  if (!configuration.swatches.empty()) change_swatch(0, start_s);
  if (clockwork == Clockwork::host) thread_ = std::thread([this] { run(); });
}

World::~World() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  advanced_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void World::set_pattern_source(std::function<projector::Pattern(double)> pattern_at) {
  const std::lock_guard lock(picture_mutex_);
  pattern_at_ = std::move(pattern_at);
}

void World::set_tool_source(std::function<std::optional<Eigen::Vector3d>(double)> tool_at) {
  const std::lock_guard lock(mutex_);
  tool_at_ = std::move(tool_at);
}

void World::on_prompt(const Prompt& prompt, double host_time_s) {
  const std::lock_guard lock(mutex_);
  prompts_.push_back({host_time_s + kReactionS, prompt});
}

void World::run() {
  while (true) {
    {
      std::unique_lock lock(mutex_);
      if (stopping_) return;
      const double early_s = now_s_ + kChunkS - rig::host_now_s();
      if (early_s > 0) {
        advanced_.wait_for(lock, std::chrono::duration<double>(early_s), [this] { return stopping_; });
        continue;
      }
    }
    advance_one();
    advanced_.notify_all();
  }
}

void World::advance_to(double host_time_s) {
  while (now_s_ < host_time_s) advance_one();
}

void World::advance_one() {
  std::unique_lock lock(mutex_);
  if (hanging_.valid() &&
      (clockwork_ == Clockwork::by_hand || hanging_.wait_for(std::chrono::seconds(0)) == std::future_status::ready)) {
    hanging_.get();
    hung_ = true;
    stages_.push_back({std::max(now_s_ + kChunkS, hangs_from_s_), Stage::fabric, 0});
  }
  while (!hanging_.valid() && !prompts_.empty() && prompts_.front().first <= now_s_) {
    const Prompt prompt = prompts_.front().second;
    prompts_.pop_front();
    obey(prompt, now_s_);
  }
  const double next_s = now_s_ + kChunkS;
  if (!hung_) {
    now_s_ = next_s;
    return;
  }
  const Eigen::Vector3d left = left_.at(next_s), right = right_corner(next_s);
  const double brake = next_s < steady_until_s_ ? kHandBrake : 0;
  lock.unlock();
  sheet_.advance(kChunkS, left, right, brake);
  Moment moment{next_s, sheet_.position().cast<float>(), sheet_.velocity().cast<float>()};
  lock.lock();
  now_s_ = next_s;
  moments_.push_back(std::move(moment));
  while (moments_.front().time_s < next_s - kKeptS) moments_.pop_front();
}

void World::begin_hanging(const Eigen::Vector3d& place, double at_s) {
  left_ = HandPath(configuration_.left_m, configuration_.hand);
  right_ = HandPath(place, configuration_.hand);
  holder_ = Holder::hand;
  moments_.clear();
  stages_.push_back({at_s, Stage::empty, 0});
  hangs_from_s_ = at_s + kHangS;
  // Beside the world's clock, so that camera and tracker go on meanwhile.
  hanging_ = std::async(std::launch::async, [this, place] { settle(configuration_.left_m, place); });
}

// The old one is taken down; the new one hangs once a prompt asks for it.
void World::change_swatch(size_t index, double at_s) {
  if (index >= configuration_.swatches.size()) return;  // the person has no such swatch
  const Swatch& swatch = configuration_.swatches[index];
  configuration_.separation_m *= swatch.fabric.width_m / configuration_.fabric.width_m;
  configuration_.fabric = swatch.fabric;
  sheet_ = LatticeSheet(swatch.fabric, configuration_.lattice);
  if (swatch.extra) sheet_.add_extra(swatch.extra, swatch.step_share);
  hung_ = false;
  stages_.push_back({at_s, Stage::empty, 0});
}

// To the equilibrium of the branch that bulges to the configured side: viscous braking first, then stopping the
// sheet at each peak of its kinetic energy.
void World::settle(const Eigen::Vector3d& left, const Eigen::Vector3d& right) {
  const Eigen::Vector3d away = Eigen::Vector3d(0.5 * (left + right) - geometry::centre(configuration_.camera));
  sheet_.hang(left, right, configuration_.sag_side * Eigen::Vector3d(away.x(), away.y(), 0));
  const double step = 4 * kChunkS;
  for (double t = 0; t < 1.5; t += step) sheet_.advance(step, left, right, 8);
  double last = 0, before = 0;
  for (double t = 0; t < 3.0; t += step) {
    sheet_.advance(step, left, right);
    const double kinetic = sheet_.kinetic_energy();
    if (kinetic < last && last >= before) {
      sheet_.set_velocity(Eigen::Matrix3Xd::Zero(3, sheet_.count()));
      last = before = 0;
    } else {
      before = last;
      last = kinetic;
    }
  }
}

void World::obey(const Prompt& prompt, double at_s) {
  if (is(prompt, "show_grid_pose")) {
    hung_ = false;
    stages_.push_back({at_s, Stage::empty, 0});
    stages_.push_back({at_s + kBoardUpS, Stage::board, prompt.index});
    return;
  }
  if (is(prompt, "change_swatch")) return change_swatch(static_cast<size_t>(prompt.index), at_s);
  if ((is(prompt, "hang_still") || is(prompt, "robot_path")) && ++trials_ == configuration_.knock.before_trial)
    knocked_from_s_ = at_s;
  if (is(prompt, "stand_back") || is(prompt, "done") || is(prompt, "wave_right_corner") ||
      is(prompt, "wave_left_corner"))
    steady_until_s_ = at_s;  // the hand lets go of the fabric
  if (is(prompt, "stand_back") || is(prompt, "done") || is(prompt, "ask")) return;

  const double separation = prompt.separation_m > 0
                                ? std::min(prompt.separation_m, 0.99 * configuration_.fabric.width_m)
                                : configuration_.separation_m;
  const Eigen::Vector3d place = configuration_.left_m + separation * Eigen::Vector3d::UnitX();
  if (!hung_) {
    begin_hanging(place, at_s);
    // What was asked for beyond hanging comes once it hangs.
    if (is(prompt, "hang_still")) return;
    if (is(prompt, "robot_path")) --trials_;  // counted when it comes again
    prompts_.push_front({at_s, prompt});
    return;
  }
  const auto back_to_hand = [&] {
    if (holder_ != Holder::tool) return;
    right_ = HandPath(right_corner(at_s), configuration_.hand);
    holder_ = Holder::hand;
  };
  // A drape that was waved swings on for a minute; nobody waits for that.
  if (is(prompt, "hang_still") || is(prompt, "robot_path"))
    steady_until_s_ = at_s + configuration_.hand.carry_s + kSteadyS;
  if (is(prompt, "hang_still")) {
    back_to_hand();
    left_.carry(at_s, configuration_.left_m);
    right_.carry(at_s, place);
  } else if (is(prompt, "wave_right_corner")) {
    back_to_hand();
    right_.wave(at_s, left_.at(at_s), prompt.amplitude_m, prompt.frequency_hz, prompt.duration_s);
  } else if (is(prompt, "wave_left_corner")) {
    back_to_hand();
    left_.wave(at_s, right_.at(at_s), prompt.amplitude_m, prompt.frequency_hz, prompt.duration_s);
  } else if (is(prompt, "robot_path")) {
    clipped_from_ = right_corner(at_s);
    clipped_s_ = at_s;
    holder_ = Holder::tool;
  }
}

Eigen::Vector3d World::right_corner(double t) {
  if (holder_ == Holder::hand || !tool_at_) return right_.at(t);
  const auto tool = tool_at_(t);
  if (!tool) return clipped_from_;
  const double share = smooth_step((t - clipped_s_) / configuration_.hand.carry_s);
  return (1 - share) * clipped_from_ + share * (configuration_.world_from_arm * *tool);
}

World::StageChange World::stage_at(double t) const {
  StageChange found = stages_.front();
  for (const StageChange& change : stages_)
    if (change.since_s <= t) found = change;
  return found;
}

bool World::wait_for(std::unique_lock<std::mutex>& lock, double t) {
  if (clockwork_ == Clockwork::host)
    advanced_.wait_for(lock, std::chrono::seconds(5), [&] { return stopping_ || now_s_ >= t; });
  return now_s_ >= t && t >= now_s_ - kKeptS;
}

Eigen::Matrix3Xd World::interpolated(double t) const {
  if (moments_.empty()) return {};
  const auto after =
      std::lower_bound(moments_.begin(), moments_.end(), t, [](const Moment& m, double s) { return m.time_s < s; });
  if (after == moments_.end()) return moments_.back().position.cast<double>();
  if (after == moments_.begin()) return after->position.cast<double>();
  const Moment &a = *(after - 1), &b = *after;
  const auto number = [](const auto& values) -> Eigen::Matrix3Xd { return values.template cast<double>(); };
  const double h = b.time_s - a.time_s;
  return geometry::hermite((t - a.time_s) / h, h, number(a.position), number(a.velocity), number(b.position),
                           number(b.velocity));
}

Eigen::Matrix3Xd World::fabric_at(double host_time_s) {
  std::unique_lock lock(mutex_);
  if (!wait_for(lock, host_time_s)) return {};
  return interpolated(host_time_s);
}

std::vector<SeenMarker> World::markers_at(double host_time_s) {
  std::unique_lock lock(mutex_);
  if (!wait_for(lock, host_time_s)) return {};
  const StageChange stage = stage_at(host_time_s);
  std::vector<SeenMarker> markers;
  if (stage.stage == Stage::fabric) {
    const Eigen::Matrix3Xd nodes = interpolated(host_time_s);
    if (nodes.cols() == 0) return markers;  // taken down since
    markers.push_back({"fabric", "left", sheet_.held_left(nodes)});
    markers.push_back({"fabric", "right", sheet_.held_right(nodes)});
  } else if (stage.stage == Stage::board) {
    const Eigen::Isometry3d pose =
        board_pose(configuration_.board, geometry::centre(configuration_.camera), stage.pose);
    const auto points = calib::marker_positions(configuration_.grid);
    for (int i = 0; i < int(points.size()); ++i)
      markers.push_back({"grid",
                         "g" + std::to_string(i / configuration_.grid.columns) + "_" +
                             std::to_string(i % configuration_.grid.columns),
                         pose * points[i]});
  }
  return markers;
}

bool World::image_at(double host_time_s, unsigned char* pixels) {
  StageChange stage;
  Eigen::Matrix3Xd nodes;
  bool after_knock = false;
  {
    std::unique_lock lock(mutex_);
    if (!wait_for(lock, host_time_s)) return false;
    stage = stage_at(host_time_s);
    if (stage.stage == Stage::fabric) nodes = interpolated(host_time_s);
    if (nodes.cols() > 0) nodes = sheet_.seen(nodes);
    if (nodes.cols() == 0 && stage.stage == Stage::fabric) stage.stage = Stage::empty;  // taken down since
    after_knock = host_time_s >= knocked_from_s_;
  }
  const std::lock_guard lock(picture_mutex_);
  if (stage.stage == Stage::board) {
    board_image(stage.pose, after_knock, host_time_s, pixels);
    return true;
  }
  if (stage.stage == Stage::fabric) {
    if (after_knock && !knocked_picture_) {
      const WorldConfiguration stands = knocked(configuration_);
      knocked_picture_ = std::make_unique<FabricPicture>(stands.camera, stands.projector, stands.picture);
    }
    add_noise((after_knock ? *knocked_picture_ : picture_)
                  .take(nodes, triangles_, pattern_at_ ? pattern_at_(host_time_s) : projector::Pattern{}),
              pixels);
    return true;
  }
  const size_t count = size_t(configuration_.camera.width_px) * configuration_.camera.height_px;
  add_noise(std::vector<float>(count, float(configuration_.picture.background_grey)), pixels);
  return true;
}

// The light beside the lens, which makes the retro-reflective discs shine, is on while the projector is dark.
void World::board_image(int pose, bool after_knock, double t, unsigned char* pixels) {
  if (board_->pose != pose || board_->after_knock != after_knock) {
    const WorldConfiguration stands = after_knock ? knocked(configuration_) : configuration_;
    board_->view = view_board(configuration_.grid, board_->look,
                              board_pose(configuration_.board, geometry::centre(configuration_.camera), pose),
                              stands.camera, stands.projector);
    board_->look.noise_grey = configuration_.noise_grey;
    board_->pose = pose;
    board_->after_knock = after_knock;
  }
  const projector::Pattern pattern = pattern_at_ ? pattern_at_(t) : projector::Pattern{};
  const bool rows = pattern.orientation == projector::Orientation::horizontal;
  constexpr int per_mirror = 4;
  const auto profile =
      blurred_profile(pattern, rows ? configuration_.projector.height_px : configuration_.projector.width_px,
                      per_mirror, configuration_.picture.projector_blur_px);
  board_->look.seed = unsigned(random_());
  const auto image = shade_board(
      board_->view, board_->look,
      [&](double column, double row) {
    const double at = ((rows ? row : column) + 0.5) * per_mirror - 0.5;
    const int i = std::clamp(int(std::floor(at)), 0, int(profile.size()) - 2);
    const double share = std::clamp(at - i, 0.0, 1.0);
    return (1 - share) * profile[i] + share * profile[i + 1];
      },
      pattern.kind == projector::PatternKind::off);
  std::copy_n(image.data(), image.size(), pixels);
}

void World::add_noise(const std::vector<float>& grey, unsigned char* pixels) {
  // A table read from a random place a row: a frame's noise must not cost more than its picture.
  const int width = configuration_.camera.width_px;
  std::uniform_int_distribution<size_t> place(0, kNoiseTable - width);
  for (size_t row = 0; row * width < grey.size(); ++row) {
    const float* noise = noise_.data() + place(random_);
    for (int x = 0; x < width; ++x) {
      const float value = grey[row * width + x] + noise[x] + 0.5f;
      pixels[row * width + x] = static_cast<unsigned char>(value < 0 ? 0 : value > 255 ? 255 : value);
    }
  }
}

}  // namespace selvedge::hardware_sim
