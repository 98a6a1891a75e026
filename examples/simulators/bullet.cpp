// Bullet's soft body as a simulator that speaks simulator/1 (docs/simulator.md).
//   g++ -std=c++20 -O2 bullet.cpp $(pkg-config --cflags --libs bullet) -o bullet    (libbullet-dev, nlohmann-json3-dev)
#include <algorithm>
#include <cmath>
#include <iostream>
#include <map>
#include <memory>
#include <vector>

#include <BulletSoftBody/btSoftBody.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>
#include <btBulletDynamicsCommon.h>
#include <nlohmann/json.hpp>

using nlohmann::json;
constexpr int N = 17, kIterations = 8;              // nodes along a side; of positions, a step
constexpr double kStep_s = 1 / 240.0, kHang_s = 4;  // for so long it is left to hang, well damped
constexpr float kAir_kg_m3 = 1.2f;

btVector3 vector(const json& v) { return {v[0].get<float>(), v[1].get<float>(), v[2].get<float>()}; }

btVector3 grip(const json& trial, const char* side, double t) {  // linear between the times, at rest outside
  const json &times = trial["grip_times"], &path = trial[side];
  const auto k = static_cast<size_t>(std::lower_bound(times.begin(), times.end(), t) - times.begin());
  if (k == 0 || k == times.size()) return vector(path[k == 0 ? 0 : k - 1]);
  const double a = times[k - 1], b = times[k];
  return vector(path[k - 1]).lerp(vector(path[k]), static_cast<float>((t - a) / (b - a)));
}

struct World {
  btSoftBodyRigidBodyCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btSoftRigidDynamicsWorld world{&dispatcher, &broadphase, &solver, &configuration};
};

// Links along the grid, both diagonals of each cell, and links across two cells against bending (0: none).
btSoftBody* make_cloth(btSoftBodyWorldInfo& info, float width, float height, const json& parameters) {
  btSoftBody* cloth = btSoftBodyHelpers::CreatePatch(info, {0, 0, 0}, {width, 0, 0}, {0, 0, height}, {width, 0, height},
                                                     N, N, 0, false);
  const auto material = [&](const char* name) {
    btSoftBody::Material* made = cloth->appendMaterial();
    made->m_kLST = parameters[name];
    return made;
  };
  cloth->m_materials[0]->m_kLST = parameters["sides"];
  btSoftBody::Material* diagonals = material("diagonals");
  for (int i = 0; i < N * N - N; ++i)
    if (i % N < N - 1) {
      cloth->appendLink(i, i + N + 1, diagonals);
      cloth->appendLink(i + 1, i + N, diagonals);
    }
  if (parameters["bending"] > 0) cloth->generateBendingConstraints(2, material("bending"));
  cloth->m_cfg.piterations = kIterations;
  cloth->m_cfg.collisions = 0;
  cloth->m_cfg.aeromodel = btSoftBody::eAeroModel::V_TwoSidedLiftDrag;
  cloth->m_cfg.kLF = 0;
  cloth->m_cfg.kDG = parameters["drag"];
  return cloth;
}

std::vector<float> simulate(const json& trial, const json& parameters) {
  World w;
  const btVector3 gravity = vector(trial["gravity"]), down = gravity.normalized();
  w.world.setGravity(gravity);
  w.world.getWorldInfo().m_gravity = gravity;
  w.world.getWorldInfo().air_density = kAir_kg_m3;
  const float width = trial["width"], height = trial["height"];
  const double start = trial["start"];
  const auto held = [&](double t, int column) {
    return grip(trial, "left", t).lerp(grip(trial, "right", t), float(column) / (N - 1));
  };
  btSoftBody* cloth = make_cloth(w.world.getWorldInfo(), width, height, parameters);
  cloth->setTotalMass(trial["mass"].get<float>());
  std::vector<int> fixed;
  for (int i = 0; i < N; ++i)
    if (trial["hold"] != "corners" || i == 0 || i == N - 1) fixed.push_back(i);
  for (const int i : fixed) cloth->setMass(i, 0);
  // Lengths are taken of it while it lies flat, and not again of how it begins: between its grips.
  cloth->updateConstants();
  cloth->m_bUpdateRtCst = false;
  for (int i = 0; i < N * N; ++i) {
    const float r = float(i / N) / (N - 1);
    btVector3 at = held(start, i % N) + height * r * down;
    if (i >= N) at += btVector3(0, 0.02f * std::sin(3.5f * float(i % N) / (N - 1)), 0);  // it buckles to this side
    cloth->m_nodes[i].m_x = cloth->m_nodes[i].m_q = at;
  }
  w.world.addSoftBody(cloth);

  std::vector<float> answer;
  double t = start - kHang_s;
  for (const double when : trial["times"]) {
    const int steps = static_cast<int>(std::ceil((when - t) / kStep_s - 1e-6));
    for (int s = 0; s < steps; ++s) {
      const double h = (when - t) / (steps - s);
      cloth->m_cfg.kDP = t < start ? 0.03f : parameters["damping"].get<float>();
      for (const int i : fixed) {
        cloth->m_nodes[i].m_x = held(t + h, i);
        cloth->m_nodes[i].m_v.setZero();
      }
      w.world.stepSimulation(static_cast<float>(h), 0);
      t += h;
    }
    for (const json& uv : trial["points"]) {  // between four nodes
      const float a = uv[0].get<float>() / width * (N - 1), b = uv[1].get<float>() / height * (N - 1);
      const int c = std::clamp(int(a), 0, N - 2), r = std::clamp(int(b), 0, N - 2), k = r * N + c;
      const auto x = [&](int i) { return cloth->m_nodes[i].m_x; };
      const btVector3 p = x(k).lerp(x(k + 1), a - c).lerp(x(k + N).lerp(x(k + N + 1), a - c), b - r);
      for (int axis = 0; axis < 3; ++axis) answer.push_back(p[axis]);
    }
  }
  w.world.removeSoftBody(cloth);
  delete cloth;
  return answer;
}

int main() {
  const auto parameter = [](const char* name, double usual, double lower, double upper) {
    return json{{"name", name}, {"unit", ""}, {"default", usual}, {"lower", lower}, {"upper", upper}, {"log", true}};
  };
  std::cout << json{{"protocol", "simulator/1"},
                    {"name", "Bullet's soft body"},
                    {"version", std::to_string(btGetVersion())},
                    {"holds", {"corners", "top_edge"}},
                    {"parameters",
                     {parameter("sides", 0.5, 0.01, 1), parameter("diagonals", 0.5, 0.01, 1),
                      parameter("bending", 0.02, 1e-4, 1), parameter("damping", 0.002, 1e-5, 0.1),
                      parameter("drag", 1, 0.01, 10)}}}
            << std::endl;
  std::map<int, json> trials;
  for (std::string line; std::getline(std::cin, line);) {
    const json told = json::parse(line);
    if (told["do"] == "trial") {
      trials[told["trial"]] = told;
      continue;
    }
    const std::vector<float> answer = simulate(trials[told["trial"]], told["parameters"]);
    if (std::all_of(answer.begin(), answer.end(), [](float x) { return std::isfinite(x); })) {
      std::cout << json{{"run", told["run"]}, {"floats", answer.size()}} << "\n";
      std::cout.write(reinterpret_cast<const char*>(answer.data()), std::streamsize(answer.size() * sizeof(float)));
    } else {
      std::cout << json{{"run", told["run"]}, {"error", "diverged"}} << "\n";
    }
    std::cout.flush();
  }
}
