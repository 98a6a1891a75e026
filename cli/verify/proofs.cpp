#include "cli/verify/figures.h"

namespace selvedge::cli {

std::vector<Figure> prove_arm(const FigureOptions& options);
std::vector<Figure> prove_calibration(const FigureOptions& options);
std::vector<Figure> prove_cloth(const FigureOptions& options);
std::vector<Figure> prove_contact(const FigureOptions& options);
std::vector<Figure> prove_diagnosis(const FigureOptions& options);
std::vector<Figure> prove_exports(const FigureOptions& options);
std::vector<Figure> prove_fit(const FigureOptions& options);
std::vector<Figure> prove_format(const FigureOptions& options);
std::vector<Figure> prove_louchet(const FigureOptions& options);
std::vector<Figure> prove_metric(const FigureOptions& options);
std::vector<Figure> prove_real(const FigureOptions& options);
std::vector<Figure> prove_recorder(const FigureOptions& options);
std::vector<Figure> prove_rig(const FigureOptions& options);
std::vector<Figure> prove_simulator(const FigureOptions& options);
std::vector<Figure> prove_spline_fit(const FigureOptions& options);
std::vector<Figure> prove_spline_sheet(const FigureOptions& options);
std::vector<Figure> prove_station(const FigureOptions& options);
std::vector<Figure> prove_surface(const FigureOptions& options);
std::vector<Figure> prove_worlds(const FigureOptions& options);

const std::vector<FigureSet>& proofs() {
  static const std::vector<FigureSet> list = {
      {"arm",
       "an operator's stop brings the arm to rest and is final, in each phase of a robot trial and through a flood; "
       "the tracker's age, planning",
       prove_arm},
      {"calibration",
       "camera and projector against known truth, beside OpenCV and mrcal, and what must not pass silently",
       prove_calibration},
      {"cloth", "the fabric against closed forms, finer meshes and conservation laws", prove_cloth},
      {"contact",
       "fabric over a rod and folded onto itself never intersects, contact gives no energy, friction holds its angle, "
       "a skirt is worn",
       prove_contact},
      {"diagnosis",
       "of a diagnosis without a bank: forces injected, the evidence's calibration, power and deletion of every "
       "effect, "
       "the same answer again",
       prove_diagnosis},
      {"exports",
       "fabrics exported for Blender and Bullet, hung and waved there, beside ours; needs blender, libbullet-dev, and "
       "../shared",
       prove_exports},
      {"fit", "tables 1 to 3 and figure 14 of 2003 on four simulated fabrics, annealing beside least squares",
       prove_fit},
      {"format", "trials come back from disk unchanged, and every damage is refused", prove_format},
      {"louchet", "the 17x17 sheet of 1995 identified from its motion, by its evolution strategy and by ours",
       prove_louchet},
      {"metric", "the fold metric recovers stripes of known direction", prove_metric},
      {"real",
       "material tests that others made of real fabric, beside what they or the replicates say: strips over an edge, "
       "pulls; of ../shared",
       prove_real},
      {"recorder",
       "after a thousand power cuts whatever the recorder called durable reads; one that says so too early is caught",
       prove_recorder},
      {"rig",
       "clock offsets, drifts and the delay set in the simulated devices come back over the real wire, within what is "
       "stated",
       prove_rig},
      {"simulator", "our own sheet as another program gives the fit that it gives in this one", prove_simulator},
      {"spline-fit",
       "parameters of real fabrics that were simulated on four times the cells of the grid that a fit chooses; of "
       "../shared",
       prove_spline_fit},
      {"spline-sheet",
       "real fabrics as sheets of splines on the grid chosen for each, against four times the cells; of ../shared",
       prove_spline_sheet},
      {"station", "a session of four fabrics runs by itself and names what was hidden; a browser walks the console",
       prove_station},
      {"surface", "fabrics that a depth camera scanned, fitted and diagnosed from clouds without correspondence",
       prove_surface},
      {"worlds", "the cells of each world that banks are made of do not matter, on fabrics as real ones are",
       prove_worlds},
  };
  return list;
}

}  // namespace selvedge::cli
