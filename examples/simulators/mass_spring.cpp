// Masses and springs that speak simulator/1 (docs/simulator.md). Debian: libeigen3-dev, nlohmann-json3-dev.
//   g++ -std=c++20 -O2 -I /usr/include/eigen3 mass_spring.cpp -o mass_spring
#include <iostream>
#include <Eigen/Dense>
#include <nlohmann/json.hpp>
using Eigen::Matrix3Xd, Eigen::Vector3d, nlohmann::json;
constexpr int N = 9;                           // masses along a side
constexpr double kStep_s = 2e-4, kHang_s = 3;  // for so long it is left to hang, well damped
Vector3d vector(const json& v) { return Vector3d(v.get<std::array<double, 3>>().data()); }
double hat(double x) { return std::max(0.0, 1 - std::abs(x)); }  // a point lies between four masses

json answer_to(const json& run, const json& trial, double stretch, double shear, double drag) {
  const double du = double(trial["width"]) / (N - 1), dv = double(trial["height"]) / (N - 1);
  const double mass = double(trial["mass"]) / (N * N), start = trial["start"];
  const Vector3d gravity = vector(trial["gravity"]);
  const std::vector<double> times = trial["grip_times"];
  const auto between = [&](double t, double share) -> Vector3d {  // the grips, linear between the times
    const size_t k = std::upper_bound(times.begin(), times.end(), t) - times.begin();
    const size_t a = k > 0 ? k - 1 : 0, b = std::min(k, times.size() - 1);
    const double s = a < b ? (t - times[a]) / (times[b] - times[a]) : 0;
    const auto grip = [&](const json& path) -> Vector3d { return (1 - s) * vector(path[a]) + s * vector(path[b]); };
    return (1 - share) * grip(trial["left"]) + share * grip(trial["right"]);
  };
  Matrix3Xd x(3, N * N), v = Matrix3Xd::Zero(3, N * N);
  for (int i = 0; i < N * N; ++i)
    x.col(i) = between(start, i % N / (N - 1.0)) + i / N * dv * gravity.normalized() + Vector3d(0, 0.003 * (i % 5), 0);
  std::vector<double> answer;
  for (double t = start - kHang_s; const double when : trial["times"]) {
    for (; t < when - kStep_s / 2; t += kStep_s) {
      for (int i = 0; i < N * N; ++i)
        for (int j = std::max(0, i - N - 1); j < std::min(N * N, i + N + 2); ++j) {
          const int c = std::abs(j % N - i % N), r = std::abs(j / N - i / N);
          if (c > 1 || r > 1 || c + r == 0) continue;
          const Vector3d apart = x.col(j) - x.col(i);
          const double k = c + r == 1 ? stretch : shear;
          v.col(i) += kStep_s / mass * k * (1 - std::hypot(c * du, r * dv) / apart.norm()) * apart;
        }
      v = std::exp(-kStep_s * (t < start ? 6 : drag * du * dv / mass)) * (v.colwise() + kStep_s * gravity);
      x += kStep_s * v;
      for (int i = 0; i < N; i += trial["hold"] == "corners" ? N - 1 : 1)
        x.col(i) = between(t + kStep_s, i / (N - 1.0));
    }
    for (const json& uv : trial["points"]) {
      Vector3d at = Vector3d::Zero();
      for (int i = 0; i < N * N; ++i)
        at += hat(double(uv[0]) / du - i % N) * hat(double(uv[1]) / dv - i / N) * x.col(i);
      answer.insert(answer.end(), at.begin(), at.end());
    }
  }
  if (x.allFinite()) return {{"run", run["run"]}, {"positions", answer}};
  return {{"run", run["run"]}, {"error", "diverged"}};
}

int main() {
  json hello = {{"protocol", "simulator/1"}, {"name", "masses and springs in C++"}, {"holds", {"corners", "top_edge"}}};
  for (const auto& [name, unit, usual] :
       {std::tuple{"stretch", "N/m", 20.0}, {"shear", "N/m", 5}, {"drag", "kg/(m2 s)", 0.5}})
    hello["parameters"].push_back({{"name", name},
                                   {"unit", unit},
                                   {"default", usual},
                                   {"lower", usual / 10},
                                   {"upper", usual * 10},
                                   {"log", true}});
  std::cout << hello << std::endl;
  std::map<int, json> trials;
  for (std::string line; std::getline(std::cin, line);) {
    json told = json::parse(line), p = told["parameters"];
    if (told["do"] == "trial") trials[told["trial"]] = told;
    else std::cout << answer_to(told, trials[told["trial"]], p["stretch"], p["shear"], p["drag"]) << std::endl;
  }
}
