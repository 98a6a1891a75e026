#include "hardware_sim/rtde_controller/rtde_controller.h"

#include <poll.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <map>
#include <mutex>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "hardware_sim/rtde_controller/script_client.h"
#include "hardware_sim/simulated_joints/simulated_joints.h"
#include "rig/clock.h"
#include "rig/wire/bytes.h"
#include "rig/wire/socket.h"

namespace selvedge::hardware_sim {

namespace {

using wire::BigReader;
using wire::BigWriter;

constexpr double kTick_s = 0.002;  // a UR's own 500 Hz

struct Field {
  std::string name, type;
};

// One RTDE client.
struct Client {
  wire::Socket socket;
  std::vector<std::uint8_t> received;
  std::vector<Field> outputs;
  double rate_hz = 0;
  bool started = false;
  std::int64_t next = 0;  // number of the next data package since the start
  double start_s = 0;
};

// Those that a client may ask for, of the many of the RTDE guide: what describes the arm's motion, and the recipe of
// the maker's own client. What is not of the motion stays at rest.
using Types = std::map<std::string, std::string>;

const Types& outputs() {
  static const Types types = {{"timestamp", "DOUBLE"},
                              {"actual_q", "VECTOR6D"},
                              {"actual_qd", "VECTOR6D"},
                              {"target_q", "VECTOR6D"},
                              {"actual_TCP_pose", "VECTOR6D"},
                              {"actual_TCP_force", "VECTOR6D"},
                              {"actual_current", "VECTOR6D"},
                              {"tcp_offset", "VECTOR6D"},
                              {"speed_scaling", "DOUBLE"},
                              {"target_speed_fraction", "DOUBLE"},
                              {"robot_mode", "INT32"},
                              {"safety_mode", "INT32"},
                              {"runtime_state", "UINT32"},
                              {"robot_status_bits", "UINT32"},
                              {"safety_status_bits", "UINT32"},
                              {"actual_digital_input_bits", "UINT64"},
                              {"actual_digital_output_bits", "UINT64"},
                              {"standard_analog_input0", "DOUBLE"},
                              {"standard_analog_input1", "DOUBLE"},
                              {"standard_analog_output0", "DOUBLE"},
                              {"standard_analog_output1", "DOUBLE"},
                              {"analog_io_types", "UINT32"},
                              {"tool_mode", "UINT32"},
                              {"tool_analog_input_types", "UINT32"},
                              {"tool_analog_input0", "DOUBLE"},
                              {"tool_analog_input1", "DOUBLE"},
                              {"tool_output_voltage", "INT32"},
                              {"tool_output_current", "DOUBLE"},
                              {"tool_temperature", "DOUBLE"}};
  return types;
}

const Types& inputs() {
  static const Types types = {{"speed_slider_mask", "UINT32"},
                              {"speed_slider_fraction", "DOUBLE"},
                              {"standard_digital_output_mask", "UINT8"},
                              {"standard_digital_output", "UINT8"},
                              {"configurable_digital_output_mask", "UINT8"},
                              {"configurable_digital_output", "UINT8"},
                              {"tool_digital_output_mask", "UINT8"},
                              {"tool_digital_output", "UINT8"},
                              {"standard_analog_output_mask", "UINT8"},
                              {"standard_analog_output_type", "UINT8"},
                              {"standard_analog_output_0", "DOUBLE"},
                              {"standard_analog_output_1", "DOUBLE"}};
  return types;
}

// A list of names, with the types of those that are known.
struct Recipe {
  std::vector<Field> fields;
  std::string types;  // as the reply has them
  bool complete = true;
};

Recipe recipe_of(const std::string& names, const Types& known) {
  Recipe recipe;
  for (size_t at = 0; at <= names.size();) {
    const size_t comma = std::min(names.find(',', at), names.size());
    const std::string name = names.substr(at, comma - at);
    const auto found = known.find(name);
    const std::string type = found == known.end() ? "NOT_FOUND" : found->second;
    recipe.fields.push_back({name, type});
    recipe.types += (recipe.types.empty() ? "" : ",") + type;
    recipe.complete = recipe.complete && found != known.end();
    at = comma + 1;
  }
  return recipe;
}

}  // namespace

class RtdeController::Loop {
 public:
  Loop(const RtdeControllerOptions& options, const arm::ArmModel& model)
      : options_(options), model_(model), listener_(wire::listen_tcp(options.address, options.port)),
        script_(options.script_host, options.script_port, options.script_reconnect_s),
        joints(model, options.lag_s, rig::host_now_s()), random_(options.seed), start_s_(rig::host_now_s()),
        thread_([this] { run(); }) {}
  ~Loop() {
    stopping_ = true;
    thread_.join();
  }

  int port() const { return wire::local_port(listener_); }
  RtdeControllerCounts counts() const {
    const std::lock_guard lock(mutex_);
    return counts_;
  }

 private:
  void run() {
    for (std::int64_t tick = 1; !stopping_; ++tick) {
      const double left_s = start_s_ + kTick_s * static_cast<double>(tick) - rig::host_now_s();
      if (left_s > 0) std::this_thread::sleep_for(std::chrono::duration<double>(left_s));
      if (cut.exchange(false)) cut_all();
      const double now_s = rig::host_now_s();
      joints.advance(target(now_s), now_s);
      while (auto socket = wire::accept(listener_, 0)) {
        Client client;
        client.socket = std::move(*socket);
        clients_.push_back(std::move(client));
        count(&RtdeControllerCounts::clients);
      }
      for (auto& client : clients_) serve(client, now_s);
      std::erase_if(clients_, [](const Client& client) { return !client.socket.is_open(); });
    }
  }

  // What the script passes to servoj; a violation of the limits is a protective stop.
  std::optional<Eigen::VectorXd> target(double now_s) {
    auto wanted = script_.servo_target(now_s, model_.joints());
    {
      const std::lock_guard lock(mutex_);
      counts_.set_points = script_.set_points();
      counts_.scripts_timed_out = script_.timed_out();
    }
    constexpr double kSpeedFactor = 1.5;
    if (wanted && !protective && joints.violates(*wanted, kSpeedFactor)) {
      protective = true;
      count(&RtdeControllerCounts::protective_stops);
    }
    if (protective) {
      script_.stop();
      wanted.reset();
    }
    return wanted;
  }

  void cut_all() {
    script_.stop();
    for (auto& client : clients_) client.socket.close();
    clients_.clear();
  }

  void serve(Client& client, double now_s) {
    try {
      while (client.socket.readable(0)) {
        std::array<std::uint8_t, 4096> part;
        const size_t got = client.socket.receive(part);
        client.received.insert(client.received.end(), part.begin(), part.begin() + static_cast<long>(got));
      }
      while (take_request(client, now_s)) {}
      if (client.started && now_s >= client.start_s + static_cast<double>(client.next) / client.rate_hz) {
        // A real controller skips what it could not send in time.
        client.next = static_cast<std::int64_t>((now_s - client.start_s) * client.rate_hz) + 1;
        send(client, 'U', data(client, now_s));
      }
    } catch (const std::runtime_error&) { client.socket.close(); }
  }

  bool take_request(Client& client, double now_s) {
    if (client.received.size() < 3) return false;
    BigReader reader(client.received);
    const size_t size = reader.number<std::uint16_t>();
    if (size < 3) throw wire::WireError("package too short");
    if (client.received.size() < size) return false;
    const char type = static_cast<char>(reader.number<std::uint8_t>());
    BigReader payload = reader.part(size - 3);
    answer(client, type, payload, now_s);
    client.received.erase(client.received.begin(), client.received.begin() + static_cast<long>(size));
    return true;
  }

  void answer(Client& client, char type, BigReader& request, double now_s) {
    BigWriter reply;
    switch (type) {
      case 'V': reply.number<std::uint8_t>(request.number<std::uint16_t>() == 2 ? 1 : 0); break;
      case 'v':
        for (const std::uint32_t part : {5U, 12U, 0U, 0U}) reply.number<std::uint32_t>(part);
        break;
      case 'O': reply = set_outputs(client, request); break;
      case 'I': {  // inputs are taken note of, and none of them moves the arm
        const Recipe recipe = recipe_of(names_of(request), inputs());
        reply.number<std::uint8_t>(recipe.complete ? 1 : 0).text(recipe.types);
        break;
      }
      case 'S':
        client.started = !client.outputs.empty();
        client.start_s = now_s;
        client.next = 0;
        reply.number<std::uint8_t>(client.started ? 1 : 0);
        break;
      case 'P':
        client.started = false;
        reply.number<std::uint8_t>(1);
        break;
      case 'U': return;
      default: throw wire::WireError("unknown package");
    }
    send(client, type, reply);
  }

  static BigWriter set_outputs(Client& client, BigReader& request) {
    const double rate_hz = request.number<double>();
    if (!(rate_hz > 0 && rate_hz <= 500)) throw wire::WireError("a rate that no controller has");
    client.rate_hz = rate_hz;
    Recipe recipe = recipe_of(names_of(request), outputs());
    client.outputs.clear();
    if (recipe.complete) client.outputs = std::move(recipe.fields);
    BigWriter reply;
    reply.number<std::uint8_t>(recipe.complete ? 1 : 0).text(recipe.types);
    return reply;
  }

  static std::string names_of(BigReader& request) {
    if (request.left() > 2048) throw wire::WireError("too many names");
    return request.text(request.left());
  }

  BigWriter data(const Client& client, double now_s) {
    BigWriter out;
    out.number<std::uint8_t>(1);
    std::normal_distribution<double> noise(0, options_.encoder_noise_rad);
    const Eigen::VectorXd q = joints.joints_at(now_s), qd = joints.speeds();
    const Eigen::Vector3d tool_m = model_.base_from_tool(q).translation();
    for (const auto& [name, type] : client.outputs) {
      if (name == "timestamp") {
        out.number<double>((now_s - start_s_) * (1 + 1e-6 * options_.clock_drift_ppm) + options_.clock_offset_s);
      } else if (type == "VECTOR6D") {
        for (int i = 0; i < 6; ++i) {
          double value = name == "actual_TCP_pose" && i < 3 ? tool_m[i] : 0;
          if (name == "actual_q") value = q[i] + noise(random_);
          if (name == "target_q") value = q[i];
          if (name == "actual_qd") value = qd[i];
          out.number<double>(value);
        }
      } else if (type == "DOUBLE") {
        out.number<double>(name == "speed_scaling" || name == "target_speed_fraction" ? 1 : 0);
      } else if (type == "UINT64") {
        out.number<std::uint64_t>(0);
      } else if (name == "robot_mode") {
        out.number<std::int32_t>(7);
      } else if (name == "safety_mode") {
        out.number<std::int32_t>(protective ? 3 : 1);
      } else if (type == "INT32") {
        out.number<std::int32_t>(0);
      } else if (name == "runtime_state" || name == "robot_status_bits" || name == "safety_status_bits") {
        out.number<std::uint32_t>(script_.running() ? 2 : 1);
      } else {
        out.number<std::uint32_t>(0);
      }
    }
    return out;
  }

  static void send(Client& client, char type, const BigWriter& payload) {
    BigWriter package;
    package.number<std::uint16_t>(static_cast<std::uint16_t>(3 + payload.size()));
    package.number<std::uint8_t>(static_cast<std::uint8_t>(type)).raw(payload.bytes());
    client.socket.send(package.bytes(), 0.02);
  }

  void count(std::int64_t RtdeControllerCounts::*what) {
    const std::lock_guard lock(mutex_);
    ++(counts_.*what);
  }

  const RtdeControllerOptions options_;
  const arm::ArmModel model_;
  const wire::Socket listener_;
  ScriptClient script_;
  std::vector<Client> clients_;
  mutable std::mutex mutex_;
  RtdeControllerCounts counts_;

 public:
  SimulatedJoints joints;
  std::atomic<bool> protective = false, cut = false;

 private:
  std::mt19937 random_;
  const double start_s_;
  std::atomic<bool> stopping_ = false;
  std::thread thread_;
};

RtdeController::RtdeController(const RtdeControllerOptions& options, const arm::ArmModel& model)
    : loop_(std::make_unique<Loop>(options, model)) {}
RtdeController::~RtdeController() = default;
int RtdeController::port() const { return loop_->port(); }
RtdeControllerCounts RtdeController::counts() const { return loop_->counts(); }
Eigen::VectorXd RtdeController::joints_at(double host_time_s) const { return loop_->joints.joints_at(host_time_s); }
Eigen::Vector3d RtdeController::tool_at(double host_time_s) const { return loop_->joints.tool_at(host_time_s); }
double RtdeController::fastest_since(double host_time_s) const { return loop_->joints.fastest_since(host_time_s); }
void RtdeController::protective_stop() { loop_->protective = true; }
void RtdeController::clear_protective_stop() { loop_->protective = false; }
void RtdeController::cut_connections() { loop_->cut = true; }
void RtdeController::block_joint(int joint, bool blocked) { loop_->joints.block(joint, blocked); }

}  // namespace selvedge::hardware_sim
