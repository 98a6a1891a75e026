#include "rig/arm/model.h"

#include <numbers>

#include <kdl/chain.hpp>
#include <kdl/chainfksolverpos_recursive.hpp>
#include <kdl/chainiksolvervel_wdls.hpp>

#include "files/bad_input.h"
#include "files/shared_files.h"
#include "files/toml_text.h"

namespace selvedge::arm {

namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kPosition_m = 1e-6, kAngle_rad = 1e-6;
constexpr int kIterations = 50;
constexpr double kDamping = 1e-4;

// Reads keys of one table and remembers them; the rest is refused by name.
class Keys {
 public:
  Keys(std::string where, const toml::table& table) : where_(std::move(where)), table_(table) {}
  double number(const char* key, std::optional<double> fallback = std::nullopt) {
    read_.emplace_back(key);
    const auto value = table_[key].value<double>();
    if (!value && (table_.contains(key) || !fallback)) refuse(where_ + " " + key, "a number expected");
    if (value && !std::isfinite(*value)) refuse(where_ + " " + key, "found {}, a finite number expected", *value);
    return value ? *value : *fallback;
  }
  double positive(const char* key) {
    const double value = number(key);
    if (value <= 0) refuse(where_ + " " + key, "found {}, expected above 0", value);
    return value;
  }
  std::string text(const char* key) {
    read_.emplace_back(key);
    const auto value = table_[key].value<std::string>();
    if (!value) refuse(where_ + " " + key, "a text expected");
    return *value;
  }
  Eigen::VectorXd numbers(const char* key, size_t count) {
    read_.emplace_back(key);
    const auto* list = table_[key].as_array();
    if (list == nullptr || list->size() != count) refuse(where_ + " " + key, "{} numbers expected", count);
    Eigen::VectorXd values(static_cast<long>(count));
    for (size_t i = 0; i < count; ++i) {
      const auto value = list->get(i)->value<double>();
      if (!value || !std::isfinite(*value)) refuse(where_ + " " + key, "{} numbers expected", count);
      values[static_cast<long>(i)] = *value;
    }
    return values;
  }
  void skip(const char* key) { read_.emplace_back(key); }
  void finish() const {
    for (const auto& [key, value] : table_)
      if (std::find(read_.begin(), read_.end(), key.str()) == read_.end())
        refuse(where_ + " " + std::string(key.str()), "unknown key");
  }

 private:
  std::string where_;
  const toml::table& table_;
  std::vector<std::string> read_;
};

KDL::JntArray to_kdl(const Eigen::VectorXd& q_rad) {
  KDL::JntArray result(static_cast<unsigned>(q_rad.size()));
  result.data = q_rad;
  return result;
}

KDL::Frame to_kdl(const Eigen::Isometry3d& pose) {
  const Eigen::Matrix3d r = pose.linear();
  return {KDL::Rotation(r(0, 0), r(0, 1), r(0, 2), r(1, 0), r(1, 1), r(1, 2), r(2, 0), r(2, 1), r(2, 2)),
          KDL::Vector(pose.translation().x(), pose.translation().y(), pose.translation().z())};
}

Eigen::Isometry3d to_eigen(const KDL::Frame& frame) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) pose.linear()(row, column) = frame.M(row, column);
    pose.translation()[row] = frame.p[row];
  }
  return pose;
}

// A joint about z, then the fixed step to the next joint's frame.
struct Link {
  double a_m, alpha_rad, d_m;
};

KDL::Chain build_chain(const std::vector<Link>& links, bool modified, const KDL::Frame& tool) {
  KDL::Chain chain;
  const KDL::Joint none(KDL::Joint::None), turn(KDL::Joint::RotZ);
  for (size_t i = 0; i < links.size(); ++i) {
    const auto& [a, alpha, d] = links[i];
    const KDL::Frame end = i + 1 == links.size() ? tool : KDL::Frame::Identity();
    if (modified) {
      chain.addSegment(KDL::Segment(none, KDL::Frame::DH_Craig1989(a, alpha, 0, 0)));
      chain.addSegment(KDL::Segment(turn, KDL::Frame(KDL::Vector(0, 0, d)) * end));
    } else {
      chain.addSegment(KDL::Segment(turn, KDL::Frame::DH(a, alpha, d, 0) * end));
    }
  }
  return chain;
}

}  // namespace

struct ArmModel::Chain {
  KDL::Chain chain;
};

ArmModel ArmModel::read(const std::filesystem::path& named) {
  const std::filesystem::path path = files::or_shared(named);
  const toml::table root = files::read_toml(path);
  ArmModel model;
  Keys keys(path.string(), root);
  model.name_ = keys.text("name");
  const std::string convention = keys.text("convention");
  if (convention != "standard" && convention != "modified")
    refuse(path.string() + " convention", "found \"{}\", expected \"standard\" or \"modified\"", convention);
  const Eigen::Vector3d tool_m = keys.numbers("tool_m", 3);
  keys.skip("joint");
  const auto* joints = root["joint"].as_array();
  if (joints == nullptr || joints->empty() || joints->size() > 8) refuse(path.string(), "1 to 8 [[joint]] expected");
  std::vector<Link> links;
  for (size_t i = 0; i < joints->size(); ++i) {
    const std::string where = fmt::format("{} [[joint]] {}", path.string(), i + 1);
    const auto* table = joints->get(i)->as_table();
    if (table == nullptr) refuse(where, "a table expected");
    Keys joint(where, *table);
    links.push_back({joint.number("a_m", 0), joint.number("alpha_deg", 0) * kDegree, joint.number("d_m", 0)});
    JointLimits limits{joint.number("lower_deg") * kDegree, joint.number("upper_deg") * kDegree,
                       joint.positive("speed_deg_s") * kDegree, joint.positive("acceleration_deg_s2") * kDegree};
    if (limits.lower_rad >= limits.upper_rad) refuse(where, "lower_deg must lie below upper_deg");
    model.limits_.push_back(limits);
    joint.finish();
  }
  model.home_rad_ = keys.numbers("home_deg", links.size()) * kDegree;
  keys.finish();
  const KDL::Frame tool(KDL::Vector(tool_m.x(), tool_m.y(), tool_m.z()));
  model.chain_ = std::make_shared<Chain>(Chain{build_chain(links, convention == "modified", tool)});
  return model;
}

Eigen::Isometry3d ArmModel::base_from_tool(const Eigen::VectorXd& q_rad) const {
  KDL::ChainFkSolverPos_recursive solver(chain_->chain);
  KDL::Frame frame;
  solver.JntToCart(to_kdl(q_rad), frame);
  return to_eigen(frame);
}

std::vector<Eigen::Vector3d> ArmModel::link_points(const Eigen::VectorXd& q_rad) const {
  KDL::ChainFkSolverPos_recursive solver(chain_->chain);
  std::vector<Eigen::Vector3d> points = {Eigen::Vector3d::Zero()};
  for (unsigned segment = 1; segment <= chain_->chain.getNrOfSegments(); ++segment) {
    KDL::Frame frame;
    solver.JntToCart(to_kdl(q_rad), frame, static_cast<int>(segment));
    points.push_back(to_eigen(frame).translation());
  }
  return points;
}

std::optional<Eigen::VectorXd> ArmModel::inverse(const Eigen::Isometry3d& base_from_tool,
                                                 const Eigen::VectorXd& start_rad) const {
  KDL::ChainFkSolverPos_recursive forward(chain_->chain);
  KDL::ChainIkSolverVel_wdls step(chain_->chain, 1e-9);
  step.setLambda(kDamping);
  const KDL::Frame wanted = to_kdl(base_from_tool);
  KDL::JntArray q = to_kdl(start_rad), change(q.rows());
  for (int i = 0; i < kIterations; ++i) {
    KDL::Frame reached;
    forward.JntToCart(q, reached);
    const KDL::Twist left = KDL::diff(reached, wanted);
    if (left.vel.Norm() < kPosition_m && left.rot.Norm() < kAngle_rad) return q.data;
    if (step.CartToJnt(q, left, change) < 0) return std::nullopt;
    q.data += change.data;
  }
  return std::nullopt;
}

}  // namespace selvedge::arm
