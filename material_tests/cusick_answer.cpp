#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "cloth/contact/intersections.h"
#include "material_tests/bending_length.h"
#include "material_tests/cusick.h"
#include "report/html.h"

namespace selvedge::material_tests {

namespace {

using Eigen::Index;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;

// ln bend moves by this where stretch and shear are three times as much or as little (docs/real-fabric.md).
constexpr double kMembraneSd = 0.12;
constexpr size_t kMostPictures = 4;

std::vector<double> probabilities(const CusickFit& fit) {
  std::vector<double> p;
  double sum = 0;
  for (const BendingModel& m : fit.models) sum += p.emplace_back(std::exp(m.log_evidence - fit.best().log_evidence));
  for (double& share : p) share /= sum;
  return p;
}

double variance_of_ln_bend(const CusickFit& fit) {
  const std::vector<double> p = probabilities(fit);
  double sum = fit.best().covariance(0, 0) + kMembraneSd * kMembraneSd;
  for (size_t i = 0; i < p.size(); ++i) {
    const double gap = std::log(fit.models[i].material.bend / fit.best().material.bend);
    sum += p[i] * gap * gap;
  }
  return sum;
}

template <class Each>
MeanAndSd over(const std::vector<DrapePair>& pairs, const Each& each) {
  MeanAndSd out;
  const double n = static_cast<double>(pairs.size());
  for (const DrapePair& p : pairs) out.mean += each(p) / n;
  for (const DrapePair& p : pairs) out.sd += std::pow(each(p) - out.mean, 2) / std::max(1.0, n - 1);
  out.sd = std::sqrt(out.sd);
  return out;
}

void add_parameters(const CusickFit& fit, Answer& answer) {
  const cloth::Material& m = fit.best().material;
  answer.parameters = {{"bend", "N·m", m.bend, true}};
  const bool turns = fit.best().name == "anisotropic", softens = fit.best().name == "softening";
  if (turns) answer.parameters.push_back({"bend_anisotropy", "", m.bend_anisotropy, false});
  if (softens) answer.parameters.push_back({"bend_stiffening", "m²", m.bend_stiffening, false});
  answer.covariance = fit.best().covariance;
  if (softens) {  // from the share at the curvature 1/l to m²
    const Eigen::Vector2d scale(1, fit.softening_scale_m2);
    answer.covariance = (scale.asDiagonal() * answer.covariance * scale.asDiagonal()).eval();
  }
  answer.covariance(0, 0) += variance_of_ln_bend(fit) - fit.best().covariance(0, 0);
}

void add_reported(const CusickFit& fit, Answer& answer) {
  const auto add = [&](const char* name, const char* unit, const MeanAndSd& of) {
    answer.reported.push_back({name, unit, of.mean, of.sd});
  };
  add("drape_coefficient", "%", fit.measured_percent);
  const std::vector<DrapePair>& pairs = fit.best().drapes;
  add("drape_coefficient_fitted", "%", over(pairs, [](auto& p) { return 100 * p.fitted.drape_coefficient; }));
  add("folds", "", over(pairs, [](auto& p) { return double(p.measured.folds); }));
  add("folds_fitted", "", over(pairs, [](auto& p) { return double(p.fitted.folds); }));
  add("bending_length", "mm", {1e3 * bending_length_m(fit.best().material.bend, fit.best().material.density), 0});
  const std::vector<double> p = probabilities(fit);
  for (size_t i = 0; i < p.size(); ++i) add(("probability_" + fit.models[i].name).c_str(), "", {p[i], 0});
  if (fit.best().name == "anisotropic") add("stiff_direction", "°", {fit.axis_rad * 180 / M_PI, 0});
}

void add_remarks(const CusickFit& fit, const DiscSheet& sheet, Answer& answer) {
  const std::vector<double> p = probabilities(fit);
  answer.remarks.push_back(
      fmt::format("the evidence picks {} bending: isotropic {:.2f}, anisotropic {:.2f}, softening {:.2f}",
                  fit.best().name, p[0], p[1], p[2]));
  if (p[fit.picked] < 0.9)
    answer.remarks.push_back(
        "no law is picked beyond doubt: a drape alone hardly tells them apart, strips over an edge "
        "beside it do");
  answer.remarks.push_back(
      "stretch and shear were taken as woven fabrics have them (300 and 40 N/m); three times as much "
      "or a third moves bend by an eighth, which its interval holds");
  size_t crossing = 0, unrested = 0;
  for (const DrapePair& pair : fit.best().drapes) {
    unrested += !pair.at_rest;
    crossing += crossings(sheet, pair.control) > 0;
  }
  if (unrested > 0)
    answer.remarks.push_back(
        fmt::format("{} of {} simulated drapes did not come to rest", unrested, fit.best().drapes.size()));
  if (crossing > 0)
    answer.remarks.push_back(
        fmt::format("in {} of {} simulated drapes folds pass through each other, for contact is not "
                    "simulated: do not rely on this fit",
                    crossing, fit.best().drapes.size()));
}

}  // namespace

size_t crossings(const DiscSheet& sheet, const Matrix3Xd& control) {
  constexpr int around = 288, along = 10;
  const Matrix3Xd flat = sheet.grid(folded(sheet, 3, 0, 0), around, along);
  geometry::TriangleMesh mesh;
  mesh.width_m = mesh.height_m = 2 * sheet.disc().radius_m;
  for (Index i = 0; i < flat.cols(); ++i) mesh.rest_uv.push_back(flat.col(i).head<2>());
  for (int j = 0; j < around; ++j)
    for (int k = 0; k + 1 < along; ++k) {
      const int a = j * along + k, b = (j + 1) % around * along + k;
      mesh.triangles.push_back({a, a + 1, b});
      mesh.triangles.push_back({b, a + 1, b + 1});
    }
  return cloth::contact::intersecting_triangles(cloth::contact::make_surface(mesh), sheet.grid(control, around, along))
      .size();
}

std::string outline_picture(const DrapePair& pair, const Disc& disc) {
  const auto line = [](const std::string& name, const Eigen::VectorXd& radius_m) {
    report::Series s{name, {}, {}};
    for (Index i = 0; i <= radius_m.size(); ++i) {
      const double angle = 2 * M_PI * double(i) / double(radius_m.size()), r = 1e3 * radius_m(i % radius_m.size());
      s.x.push_back(r * std::cos(angle));
      s.y.push_back(r * std::sin(angle));
    }
    return s;
  };
  return report::line_plot({line("measured", pair.measured.radius_m), line("simulated", pair.fitted.radius_m),
                            line("support", Eigen::VectorXd::Constant(180, disc.support_radius_m))},
                           {.x_label = "mm, stiffer direction", .y_label = "mm", .width_px = 460, .height_px = 430});
}

std::string drape_picture(const DiscSheet& sheet, const Matrix3Xd& control) {
  constexpr int around = 180, along = 9, width = 520, height = 320;
  const Eigen::Matrix3d view = (Eigen::AngleAxisd(-1.1, Vector3d::UnitX()) * Eigen::AngleAxisd(0.4, Vector3d::UnitZ()))
                                   .toRotationMatrix();  // to the right, up, towards the eye
  const Matrix3Xd x = view * sheet.grid(control, around, along);
  struct Patch {
    double depth, light;
    std::array<Vector3d, 4> corner;
  };
  std::vector<Patch> patches;
  for (int j = 0; j < around; ++j)
    for (int k = 0; k + 1 < along; ++k) {
      const auto at = [&](int spoke, int ring) -> Vector3d { return x.col(spoke % around * along + ring); };
      Patch p{0, 0, {at(j, k), at(j, k + 1), at(j + 1, k + 1), at(j + 1, k)}};
      for (const Vector3d& c : p.corner) p.depth += c.z() / 4;
      p.light = std::abs((p.corner[2] - p.corner[0])
                             .cross(p.corner[3] - p.corner[1])
                             .normalized()
                             .dot(Vector3d(0.4, 0.6, 0.7).normalized()));
      patches.push_back(p);
    }
  std::sort(patches.begin(), patches.end(), [](const Patch& a, const Patch& b) { return a.depth < b.depth; });
  const double scale = width / (2.2 * sheet.disc().radius_m);
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" "
      "viewBox=\"0 0 {0} {1}\">",
      width, height);
  const auto point = [&](const Vector3d& c) {
    return fmt::format("{:.1f},{:.1f} ", width / 2.0 + scale * c.x(), height / 2.0 - scale * c.y());
  };
  std::string plate;
  for (int j = 0; j < around; ++j) plate += point(x.col(Index(j) * along));
  const auto add_plate = [&] {
    svg += fmt::format("<polygon points=\"{}\" fill=\"#e8e4da\" stroke=\"#888\"/>", plate);
  };
  bool plated = false;
  for (const Patch& p : patches) {
    if (!plated && p.depth > 0) {
      add_plate();
      plated = true;
    }
    const int grey = 60 + static_cast<int>(170 * p.light);
    svg += "<polygon points=\"";
    for (const Vector3d& c : p.corner) svg += point(c);
    svg += fmt::format("\" fill=\"rgb({0},{0},{1})\" stroke=\"rgb({0},{0},{1})\" stroke-width=\"0.6\"/>", grey,
                       std::min(255, grey + 25));
  }
  if (!plated) add_plate();
  return svg + "</svg>";
}

Answer answer_of(const CusickFit& fit, const DiscSheet& sheet) {
  Answer answer;
  add_parameters(fit, answer);
  add_reported(fit, answer);
  for (const DrapePair& pair : fit.best().drapes) {
    auto error = std::find_if(answer.errors.begin(), answer.errors.end(),
                              [&](const TestError& e) { return e.trial == pair.trial; });
    if (error == answer.errors.end()) error = answer.errors.insert(error, {pair.trial, "mm", 0, 0, 0});
    const double n = static_cast<double>(error->samples);
    error->rms = std::sqrt((n * error->rms * error->rms + 1e6 * pair.left_m * pair.left_m) / (n + 1));
    ++error->samples;
  }
  add_remarks(fit, sheet, answer);
  for (size_t i = 0; i < std::min(kMostPictures, fit.best().drapes.size()); ++i) {
    const DrapePair& pair = fit.best().drapes[i];
    answer.pictures.emplace_back(
        outline_picture(pair, sheet.disc()),
        fmt::format(
            "{}, capture {}: drape coefficient {:.1f} % measured, {:.1f} % simulated; folds {} and {}; {:.1f} mm "
            "between the outlines",
            pair.trial, pair.capture, 100 * pair.measured.drape_coefficient, 100 * pair.fitted.drape_coefficient,
            pair.measured.folds, pair.fitted.folds, 1e3 * pair.left_m));
  }
  answer.pictures.emplace_back(drape_picture(sheet, fit.best().drapes[0].control), "the first of them from the side");
  return answer;
}

Answer fit_cusick(const std::vector<const trial::Trial*>& discs) {
  const CusickOptions options;
  const CusickFit fit = fit_cusick_models(discs, options);
  const trial::Cusick& c = *discs[0]->cusick;
  return answer_of(fit, DiscSheet({c.disc_m / 2, c.support_m / 2}, options.cells, options.spokes));
}

}  // namespace selvedge::material_tests
