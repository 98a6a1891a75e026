// Trials and campaigns as they lie on disk (docs/formats.md), in numpy arrays.
#include "capture/trial/trial.h"

#include "capture/trial/trial_writer.h"
#include "files/bad_input.h"
#include "python/arrays.h"
#include "python/bindings.h"
#include "python/sound_trial.h"

PYBIND11_MAKE_OPAQUE(std::vector<selvedge::trial::Trial>)
#include <pybind11/stl_bind.h>

namespace selvedge::python {

namespace {

using trial::Trial;

using Row3 = Eigen::RowVector3d;

// An attribute that is one of some words.
template <class Enum>
void word_part(py::class_<Trial>& c, const char* name, Enum Trial::*member, const std::vector<Enum>& all,
               const char* doc) {
  c.def_property(
      name, [member](const Trial& self) { return trial::to_text(self.*member); },
      [=](Trial& self, const std::string& word) {
    std::string words;
    for (const Enum value : all) {
      if (word == trial::to_text(value)) {
        self.*member = value;
        return;
      }
      words += std::string(words.empty() ? "" : ", ") + trial::to_text(value);
    }
    refuse(std::string("Trial.") + name, "found {}, expected one of {}", in_quotes(word), words);
      },
      doc);
}

void bind_fabric_and_optics(py::module_& m) {
  py::class_<trial::Fabric> fabric(m, "Fabric", "The swatch of a trial.");
  keyword_constructor(fabric);
  fabric.def_readwrite("name", &trial::Fabric::name)
      .def_readwrite("width_m", &trial::Fabric::width_m, "Of the top edge, m.")
      .def_readwrite("height_m", &trial::Fabric::height_m, "m.")
      .def_readwrite("mass_kg", &trial::Fabric::mass_kg, "kg.")
      .def_readwrite("mass_known", &trial::Fabric::mass_known, "False where the mass is a guess.");
  py::class_<geometry::Projection> projection(
      m, "Projection", "A pinhole camera, or a projector as one. Pixel (0, 0) is the centre of the top left pixel.");
  keyword_constructor(projection);
  projection
      .def_readwrite("matrix", &geometry::Projection::matrix, "(3, 4), undistorted px from m, tracker's frame, z up.")
      .def_readwrite("distortion", &geometry::Projection::distortion, "OpenCV's k1 k2 p1 p2 k3.")
      .def_readwrite("width_px", &geometry::Projection::width_px)
      .def_readwrite("height_px", &geometry::Projection::height_px);
  py::class_<trial::StripePattern> pattern(
      m, "StripePattern", "Projector row r is bright where (r - first_bright_row_px) mod period_px < duty period_px.");
  keyword_constructor(pattern);
  pattern.def_readwrite("orientation", &trial::StripePattern::orientation)
      .def_readwrite("period_px", &trial::StripePattern::period_px)
      .def_readwrite("duty", &trial::StripePattern::duty)
      .def_readwrite("first_bright_row_px", &trial::StripePattern::first_bright_row_px);
}

void bind_tables(py::module_& m) {
  using Times = std::vector<double>;
  py::class_<trial::Corners> corners(m, "Corners", "corners.csv: the two held corners.");
  keyword_constructor(corners);
  array_part<Times>(corners, "time_s", &trial::Corners::time_s, "(T,), s, clock of the motion capture.");
  array_part<PointRows>(corners, "left", &trial::Corners::left, "(T, 3), m; NaN where it was hidden.");
  array_part<PointRows>(corners, "right", &trial::Corners::right, "(T, 3), m; NaN where it was hidden.");
  py::class_<trial::Markers> markers(m, "Markers", "markers.csv: a row a sample of one marker.");
  keyword_constructor(markers);
  array_part<Times>(markers, "time_s", &trial::Markers::time_s, "(N,), s, ascending.");
  array_part<std::vector<int>>(markers, "marker", &trial::Markers::marker, "(N,), the marker's number.");
  array_part<FlatRows>(markers, "uv", &trial::Markers::uv,
                       "(N, 2), m: in the flat fabric, from the left edge and down from the top edge.");
  array_part<PointRows>(markers, "position", &trial::Markers::position, "(N, 3), m.");
  py::class_<trial::Surface> surface(
      m, "Surface", "surface.csv: a row a point that was scanned; which point of the fabric it is nobody says.");
  keyword_constructor(surface);
  array_part<Times>(surface, "time_s", &trial::Surface::time_s, "(N,), s, ascending; points of one cloud share it.");
  array_part<PointRows>(surface, "position", &trial::Surface::position, "(N, 3), m.");
  surface.def_readwrite("seen_from_m", &trial::Surface::seen_from_m, "(3,), m: where the instrument stood, or None.");
  py::class_<trial::Robot> robot(m, "Robot", "robot.csv: the arm's tool point.");
  keyword_constructor(robot);
  array_part<Times>(robot, "time_s", &trial::Robot::time_s, "(T,), s.");
  array_part<PointRows>(robot, "commanded", &trial::Robot::commanded, "(T, 3), m.");
  array_part<PointRows>(robot, "measured", &trial::Robot::measured, "(T, 3), m.");
  py::class_<trial::Frames> frames(m, "Frames", "frames.csv; pictures stay on disk, see Trial.read_frame.");
  keyword_constructor(frames);
  array_part<std::vector<int>>(frames, "number", &trial::Frames::number, "(F,), as the files are numbered.");
  array_part<Times>(frames, "time_s", &trial::Frames::time_s, "(F,), s: mid-exposure.");
  frames.def_readwrite("path", &trial::Frames::path, "A file each.");
}

void bind_trial(py::module_& m) {
  using trial::Experiment, trial::Held;
  py::class_<Trial> t(m, "Trial", "A recorded trial (docs/formats.md). Arrays that it gives are read-only copies.");
  keyword_constructor(t);
  t.def_readwrite("folder", &Trial::folder, "Where it was read from; empty: it is in memory alone.")
      .def_readwrite("name", &Trial::name);
  word_part(t, "experiment", &Trial::experiment,
            {Experiment::static_hang, Experiment::waving, Experiment::robot, Experiment::cantilever, Experiment::cusick,
             Experiment::tensile},
            "static, waving or robot; cantilever, cusick or tensile: a material test.");
  word_part(t, "held", &Trial::held, {Held::corners, Held::top_edge, Held::top_edge_clamped},
            "corners, top_edge or top_edge_clamped.");
  t.def_property_readonly(
       "state", [](const Trial& self) { return trial::to_text(self.state); }, "complete, cut or recording.")
      .def_readwrite("clamp_direction", &Trial::clamp_direction, "(3,): of top_edge_clamped.")
      .def_readwrite("fabric", &Trial::fabric)
      .def_readwrite("starts_at_rest", &Trial::starts_at_rest, "It hangs in equilibrium at the first sample.")
      .def_readwrite("gravity_m_s2", &Trial::gravity_m_s2, "(3,), m/s^2.")
      .def_readwrite("frame_rate_hz", &Trial::frame_rate_hz)
      .def_readwrite("exposure_s", &Trial::exposure_s)
      .def_readwrite("mocap_rate_hz", &Trial::mocap_rate_hz)
      .def_readwrite("mocap_noise_m", &Trial::mocap_noise_m, "One standard deviation of a coordinate, m, or None.")
      .def_readwrite("noise_grey_levels", &Trial::noise_grey_levels, "One standard deviation, or None.")
      .def_readwrite("corners", &Trial::corners)
      .def_readonly("damaged", &Trial::damaged, "What did not read and was passed over, a sentence each.")
      .def(
          "read_frame",
          [](const Trial& self, size_t index) {
    if (!self.frames || index >= self.frames->path.size())
      throw py::index_error("read_frame: the trial has no frame " + std::to_string(index));
    return trial::read_frame(self, index);
          },
          py::arg("index"), "(height, width) uint8, grey: picture `index` of frames.")
      .def("__repr__", [](const Trial& self) {
        return fmt::format("<selvedge.Trial {}: {}, {:.2f} s>", self.name, trial::to_text(self.experiment),
                           self.corners.time_s.empty() ? 0 : self.corners.time_s.back() - self.corners.time_s.front());
      });
  optional_part(t, "camera", &Trial::camera, "Projection or None.");
  optional_part(t, "projector", &Trial::projector, "Projection or None.");
  optional_part(t, "pattern", &Trial::pattern, "StripePattern or None.");
  optional_part(t, "frames", &Trial::frames, "Frames or None.");
  optional_part(t, "markers", &Trial::markers, "Markers or None.");
  optional_part(t, "surface", &Trial::surface, "Surface or None.");
  optional_part(t, "robot", &Trial::robot, "Robot or None.");
}

void bind_campaign(py::module_& m) {
  using Trials = std::vector<Trial>;
  py::bind_vector<Trials>(m, "Trials", "A list of trials.");
  py::implicitly_convertible<py::list, Trials>();
  py::class_<trial::Campaign> campaign(m, "Campaign", "Trials of one fabric.");
  keyword_constructor(campaign);
  campaign.def_readwrite("folder", &trial::Campaign::folder)
      .def_readwrite("fabric", &trial::Campaign::fabric, "The fabric's name.")
      .def_readwrite("trials", &trial::Campaign::trials)
      .def_readwrite("replicates", &trial::Campaign::replicates, "Lists of names that are meant to be one motion.")
      .def("__repr__", [](const trial::Campaign& self) {
        return fmt::format("<selvedge.Campaign {}: {} trials>", self.fabric, self.trials.size());
      });
}

void write_checked(const Trial& t, const std::filesystem::path& folder, std::vector<trial::GreyImage> images) {
  expect_sound(t);
  if (std::filesystem::exists(folder)) refuse(folder.string(), "is there already, expected a new folder");
  if (images.empty() && t.frames)
    for (size_t i = 0; i < t.frames->path.size(); ++i) images.push_back(trial::read_frame(t, i));
  try {
    trial::write_trial(t, folder, images);
    trial::read_trial(folder);
  } catch (...) {
    std::filesystem::remove_all(folder);
    throw;
  }
}

// Trials first: a folder with a campaign.json is whole.
void write_campaign(const trial::Campaign& campaign, const std::filesystem::path& folder) {
  for (const Trial& t : campaign.trials) {
    if (t.name.empty()) refuse("Trial.name", "found nothing, expected the name of its folder in the campaign");
    if (std::filesystem::exists(folder / t.name))
      refuse((folder / t.name).string(), "is there already, expected a new folder");
  }
  for (const Trial& t : campaign.trials) write_checked(t, folder / t.name, {});
  trial::write_campaign_json(campaign, folder);
}

}  // namespace

void bind_trials(py::module_& m) {
  bind_fabric_and_optics(m);
  bind_tables(m);
  bind_trial(m);
  bind_campaign(m);
  m.def("read_trial", &trial::read_trial, py::arg("folder"), "Reads and checks a trial. BadInput where it is damaged.");
  m.def("read_campaign", &trial::read_campaign, py::arg("folder"),
        "Reads and checks a campaign, or one trial as a campaign of it. BadInput where it is damaged.");
  m.def("write_trial", &write_checked, py::arg("trial"), py::arg("folder"), py::arg("images") = py::list(),
        "Writes a trial into `folder`, which is made, and reads it again: BadInput where it would be refused, and\n"
        "nothing is left of it. images: (height, width) uint8, one a frame of trial.frames; by default those that the\n"
        "frames' files hold.");
  m.def("write_campaign", &write_campaign, py::arg("campaign"), py::arg("folder"),
        "Writes campaign.json and a folder a trial, with its pictures. BadInput where a trial's folder is there.");
}

}  // namespace selvedge::python
