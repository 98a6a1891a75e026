// A sheet of masses and springs that speaks simulator/1 (docs/simulator.md).
//   g++ -std=c++20 -O2 -I /usr/include/eigen3 mass_spring.cpp -o mass_spring    (libeigen3-dev, nlohmann-json3-dev)
#include <cmath>
#include <iostream>
#include <map>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

using Eigen::Vector3d;
using nlohmann::json;
constexpr int N = 9;                             // masses along a side
constexpr double kStep_s = 2e-4, kHang_s = 3.0;  // for so long it is left to hang, well damped

Vector3d vector(const json& v) { return {v[0].get<double>(), v[1].get<double>(), v[2].get<double>()}; }

Vector3d grip(const json& trial, const char* side, double t) {  // linear between the times, at rest outside
  const json &times = trial["grip_times"], &path = trial[side];
  size_t k = 1;
  while (k + 1 < times.size() && times[k] <= t) ++k;
  if (times.size() < 2) return vector(path[0]);
  const double a = times[k - 1], share = std::clamp((t - a) / (times[k].get<double>() - a), 0.0, 1.0);
  return (1 - share) * vector(path[k - 1]) + share * vector(path[k]);
}

std::vector<float> simulate(const json& trial, double stretch, double shear, double drag) {
  const double width = trial["width"], height = trial["height"], start = trial["start"];
  const double mass = trial["mass"].get<double>() / (N * N), area = width * height / (N * N);
  const Vector3d gravity = vector(trial["gravity"]);
  const auto between = [&](double t, double share) -> Vector3d {
    return (1 - share) * grip(trial, "left", t) + share * grip(trial, "right", t);
  };
  std::vector<Vector3d> x, v(N * N, Vector3d::Zero());
  for (int i = 0; i < N * N; ++i)
    x.push_back(between(start, double(i % N) / (N - 1)) + height * (i / N) / (N - 1) * gravity.normalized() +
                (i < N ? 0 : 0.02 * std::sin(3.5 * (i % N) / (N - 1))) * Vector3d::UnitY());  // it buckles to this side
  double t = start - kHang_s;
  std::vector<float> answer;
  for (const double when : trial["times"]) {
    for (; t < when - kStep_s / 2; t += kStep_s) {
      std::vector<Vector3d> force(N * N, mass * gravity);
      const auto spring = [&](int i, int c, int r, double k) {
        if (i % N + c < 0 || i % N + c >= N || i / N + r >= N) return;
        const int j = i + c + N * r;
        const Vector3d apart = x[j] - x[i];
        const double rest = std::hypot(c * width, r * height) / (N - 1);
        force[i] += k * (1 - rest / apart.norm()) * apart;
        force[j] -= k * (1 - rest / apart.norm()) * apart;
      };
      for (int i = 0; i < N * N; ++i) {
        spring(i, 1, 0, stretch), spring(i, 0, 1, stretch), spring(i, 1, 1, shear), spring(i, -1, 1, shear);
      }
      const double keep = std::exp(-kStep_s * (t > start ? drag * area / mass : 6));
      for (int i = 0; i < N * N; ++i) x[i] += kStep_s * (v[i] = keep * (v[i] + kStep_s / mass * force[i]));
      for (int i = 0; i < N; ++i)
        if (trial["hold"] != "corners" || i == 0 || i == N - 1) x[i] = between(t + kStep_s, double(i) / (N - 1));
    }
    for (const json& uv : trial["points"]) {  // between four masses
      const double a = uv[0].get<double>() / width * (N - 1), b = uv[1].get<double>() / height * (N - 1);
      const int c = std::min(int(a), N - 2), r = std::min(int(b), N - 2), k = r * N + c;
      const Vector3d p = (1 - b + r) * ((1 - a + c) * x[k] + (a - c) * x[k + 1]) +
                         (b - r) * ((1 - a + c) * x[k + N] + (a - c) * x[k + N + 1]);
      if (!p.allFinite()) throw std::runtime_error("diverged at " + std::to_string(t) + " s");
      for (const double axis : p) answer.push_back(float(axis));
    }
  }
  return answer;
}

int main() {
  const auto parameter = [](const char* name, const char* unit, double usual, double lower, double upper) {
    return json{{"name", name}, {"unit", unit}, {"default", usual}, {"lower", lower}, {"upper", upper}, {"log", true}};
  };
  std::cout << json{{"protocol", "simulator/1"},
                    {"name", "masses and springs in C++"},
                    {"holds", {"corners", "top_edge"}},
                    {"parameters",
                     {parameter("stretch", "N/m", 20, 2, 200), parameter("shear", "N/m", 5, 0.5, 100),
                      parameter("drag", "kg/(m2 s)", 0.5, 0.01, 10)}}}
            << std::endl;
  std::map<int, json> trials;
  for (std::string line; std::getline(std::cin, line);) {
    const json told = json::parse(line);
    if (told["do"] == "trial") {
      trials[told["trial"]] = told;
      continue;
    }
    const json& p = told["parameters"];
    try {
      const std::vector<float> answer = simulate(trials[told["trial"]], p["stretch"], p["shear"], p["drag"]);
      std::cout << json{{"run", told["run"]}, {"floats", answer.size()}} << "\n";
      std::cout.write(reinterpret_cast<const char*>(answer.data()), std::streamsize(answer.size() * sizeof(float)));
    } catch (const std::runtime_error& error) {
      std::cout << json{{"run", told["run"]}, {"error", error.what()}} << "\n";
    }
    std::cout.flush();
  }
}
