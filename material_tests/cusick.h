// Bending of a fabric from Cusick drapes: a disc that hangs round its support, its outline from above.
//
// Each measured outline begins a search for rest, so that the simulated drape has its folds (drape.h: one fabric has
// several stable drapes). Compared are means over all captures with means over the simulated ones, of
//   drape coefficient; elongation c_2 of r(θ), with its direction; root mean square of all harmonics from the third on,
// whose covariance is taken from how captures and samples of the fabric differ (random effects of sample and capture:
// Searle, Casella & McCulloch 1992, ch. 3) and from what the model leaves out (kModelSd). Three laws of bending are
// fitted, each with Laplace's evidence (MacKay 2003, ch. 28): isotropic, anisotropic, softening. Stretch and shear
// hardly show in a drape and stay at what woven fabrics have. SI units.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "capture/trial/trial.h"
#include "cloth/material.h"
#include "material_tests/answer.h"
#include "material_tests/drape.h"
#include "material_tests/outline_measures.h"

namespace selvedge::material_tests {

struct CusickOptions {
  int cells = 8;                     // from the support to the rim
  int spokes = 96;                   // round the disc
  size_t drapes = 6;                 // captures that are simulated, spread over all of them
  double stretch = 300, shear = 40;  // N/m, of woven fabric
  std::function<void(double share, const std::string&)> progress = [](double, const std::string&) {};
};

// A capture beside the drape that its outline began.
struct DrapePair {
  std::string trial;
  int capture = 0;
  OutlineMeasures measured, fitted;
  double left_m = 0;  // root mean square between the radii of both outlines
  bool at_rest = false;
  Eigen::Matrix3Xd control;
};

struct BendingModel {
  std::string name;  // isotropic, anisotropic, softening
  cloth::Material material;
  double log_evidence = 0, chi_squared = 0;
  Eigen::MatrixXd covariance;  // of ln bend, then of bend_anisotropy or bend_stiffening
  std::vector<DrapePair> drapes;
};

struct MeanAndSd {
  double mean = 0, sd = 0;
};

struct CusickFit {
  std::vector<BendingModel> models;
  size_t picked = 0;              // of the most evidence; isotropic where none leads by 1
  double softening_scale_m2 = 0;  // by which the share of softening becomes bend_stiffening
  MeanAndSd measured_percent;     // drape coefficient of all captures
  double axis_rad = 0;            // of the measured outlines' longer axis: the stiffer direction, from x
  Eigen::Vector2d offset_m = Eigen::Vector2d::Zero();  // of the outlines' middle from the support's, taken off
  const BendingModel& best() const { return models[picked]; }
};

// Trials of kind cusick, of one fabric and one size of disc. Throws BadInput naming the trial and what is wrong.
CusickFit fit_cusick_models(const std::vector<const trial::Trial*>& discs, const CusickOptions& options = {});

// What that says: bend, and bend_anisotropy or bend_stiffening where the evidence picks them; reported drape
// coefficient and number of folds, measured and fitted.
Answer answer_of(const CusickFit& fit, const DiscSheet& sheet);
Answer fit_cusick(const std::vector<const trial::Trial*>& discs);

// Drapes of a fitted fabric whose folds are those of these trials' outlines: as many and where they are; nothing else
// of the outlines is used. One a capture.
std::vector<DrapePair> predict_drapes(const CusickFit& fit, const std::vector<const trial::Trial*>& discs,
                                      const CusickOptions& options = {});

// Pairs of triangles of a simulated drape that pass through each other: contact is not simulated.
size_t crossings(const DiscSheet& sheet, const Eigen::Matrix3Xd& control);

// SVG: both outlines of a pair; a drape from the side.
std::string outline_picture(const DrapePair& pair, const Disc& disc);
std::string drape_picture(const DiscSheet& sheet, const Eigen::Matrix3Xd& control);

}  // namespace selvedge::material_tests
