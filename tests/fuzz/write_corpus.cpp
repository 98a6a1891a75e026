// write_corpus FOLDER: valid examples for every fuzzer into FOLDER/NAME, by our own writers and simulated devices. Run
// again where a format changed; inputs that once crashed a decoder lie beside them and stay.
#include <cstdio>
#include <cstring>

#include <selvedge_rig/arm_command_t.hpp>
#include <selvedge_rig/arm_control_t.hpp>
#include <selvedge_rig/arm_status_t.hpp>
#include <selvedge_rig/arm_trajectory_t.hpp>
#include <selvedge_rig/camera_command_t.hpp>
#include <selvedge_rig/clock_map_t.hpp>
#include <selvedge_rig/corner_sample_t.hpp>

#include "capture/trial/checked_trial.h"
#include "capture/trial/trial_writer.h"
#include "example_trial.h"
#include "files/checked_lines.h"
#include "files/whole_file.h"
#include "estimate/journal.h"
#include "estimate/optimisers/journal.h"
#include "fuzz.h"
#include "hardware_sim/datastream_server/frame_packet.h"
#include "hardware_sim/natnet_server/natnet_messages.h"
#include "rig/arm/backends/mxt_packet.h"
#include "rig/arm/backends/rtde_packages.h"
#include "rig/arm/control_link.h"
#include "rig/camera/frame_ring.h"
#include "rig/projector/backends/report_transport.h"
#include "rig/projector/backends/window_packets.h"
#include "station/journal.h"

using namespace selvedge;
namespace fs = std::filesystem;

namespace {

using Bytes = std::vector<uint8_t>;

fs::path corpus;

std::string text_of(const Bytes& bytes) { return {bytes.begin(), bytes.end()}; }
template <class Plain>
std::string bytes_of(const Plain& value) {
  return {reinterpret_cast<const char*>(&value), sizeof value};
}

void keep(const std::string& fuzzer, const std::string& name, const std::string& bytes) {
  fs::create_directories(corpus / fuzzer);
  fuzz::put(corpus / fuzzer / name, bytes);
}
std::string flagged(int flags, const std::string& bytes) { return static_cast<char>(flags) + bytes; }
void keep_file(const std::string& fuzzer, int flags, const fs::path& file) {
  keep(fuzzer, file.filename().string(), flagged(flags, files::read_whole(file)));
}

void trackers() {
  const std::vector<hardware_sim::NamedPoint> seen = {{"fabric", "left", {0.1, 0.2, 0.3}},
                                                      {"fabric", "right", {0.4, 0.2, 0.3}}};
  hardware_sim::datastream::Declared declared;
  keep("datastream", "stream",
       text_of(hardware_sim::datastream::supported_packet()) +
           text_of(hardware_sim::datastream::frame_packet({1, 0.002, 200, seen}, declared, true)) +
           text_of(hardware_sim::datastream::frame_packet({2, 0.002, 200, seen}, declared, false)) +
           text_of(hardware_sim::datastream::ping_packet(7)));
  const hardware_sim::natnet::MarkerSets sets = {{"fabric", {"left", "right"}}};
  for (const int flags : {0, 3}) {
    const hardware_sim::natnet::Bitstream bitstream{flags % 2 == 0 ? 3 : 4, flags / 2 % 4};
    const auto name = [&](const char* what) { return std::string(what) + "-" + std::to_string(bitstream.major); };
    using namespace hardware_sim::natnet;
    keep("natnet", name("info"), flagged(flags, text_of(server_info(bitstream, 1e7))));
    keep("natnet", name("model"), flagged(flags, text_of(model_definition(bitstream, sets))));
    keep("natnet", name("frame"),
         flagged(flags, text_of(frame(bitstream, 1, sets, seen, false, false, {100, 200, 300}))));
  }
}

void arms() {
  wire::BigWriter state;
  state.number<uint8_t>(1);
  for (int i = 0; i < 13; ++i) state.number<double>(0.1 * i);
  state.number<int32_t>(7).number<int32_t>(1);
  keep("rtde", "state", flagged(1, text_of(arm::rtde::encode(arm::rtde::data, state))));
  keep("mxt", "request", text_of(arm::mxt::encode({})));
  selvedge_rig::arm_trajectory_t path{};
  path.points = 2;
  path.time_s = {0, 1};
  path.x_m = path.y_m = path.z_m = {0.1, 0.2};
  selvedge_rig::arm_control_t stop{};
  stop.reason = "by hand";
  keep("control", "stream",
       text_of(arm::encode_frame(arm::FrameKind::control, stop)) +
           text_of(arm::encode_frame(arm::FrameKind::command, selvedge_rig::arm_command_t{})) +
           text_of(arm::encode_frame(arm::FrameKind::trajectory, path)) +
           text_of(arm::encode_frame(arm::FrameKind::answer, selvedge_rig::arm_answer_t{})));
}

// index: of the message in fuzz_messages.cpp.
template <class Message>
void message(int index, const Message& value) {
  Bytes bytes(static_cast<size_t>(value.getEncodedSize()));
  value.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  keep("messages", Message::getTypeName(), flagged(index, text_of(bytes).substr(8)));
}

void bus() {
  message(0, selvedge_rig::arm_command_t{});
  message(1, selvedge_rig::arm_control_t{});
  message(2, selvedge_rig::arm_status_t{});
  message(4, selvedge_rig::camera_command_t{});
  message(5, selvedge_rig::clock_map_t{});
  message(6, selvedge_rig::corner_sample_t{});
}

void projectors() {
  projector::window::Request request;
  request.show = true;
  request.pattern = {.kind = projector::PatternKind::stripes, .period_px = 16};
  keep("window", "show", flagged(0, bytes_of(request)));
  keep("window", "done", flagged(1, bytes_of(projector::window::answer(projector::window::Outcome::done, "a window"))));
  // Every command answered, flags 0xc0, payload of 16 bytes: the version, then states in which nothing is wrong.
  std::string report("\xc0\0\x10\0\1\2\3\4", 8);
  report.resize(sizeof(projector::Report), '\x03');
  std::string answers;
  for (int i = 0; i < 20; ++i) answers += report;
  keep("dlpc350", "projector", flagged(1, answers));
  keep("dlpc350", "link", flagged(3, answers));
}

void ring() {
  struct {
    int32_t width_px = 8, height_px = 4, slots = 4;
    uint32_t wake = 0;
    int64_t newest = 0, later = 2;
  } header;
  std::string slots;
  for (const int64_t number : {0, 1, 2, 0}) {
    std::string slot = bytes_of(number) + bytes_of(camera::RingHead{.frame_number = number, .whole = true});
    slot.resize(256 + 64);
    slots += slot;
  }
  keep("ring", "two-frames", flagged(1, bytes_of(header) + slots));
  keep("ring", "after-a-crash", flagged(5, bytes_of(header) + slots));
}

void trials(const fs::path& scratch) {
  const char* const tables[] = {"trial.json",  "corners.csv", "frames.csv",
                                "markers.csv", "robot.csv",   trial::copy_name};
  for (const int checked : {0, 1}) {
    const fs::path folder = scratch / (checked ? "checked" : "plain");
    fuzz::write_example_trial(folder, checked != 0);
    for (int i = 0; i < 5 + checked; ++i)
      keep("trial", folder.filename().string() + "-" + tables[i],
           flagged(i << 1 | checked, files::read_whole(folder / tables[i])));
    if (checked) keep("csv", "checked", flagged(1, "t_s,frame,x,crc32\n" + files::with_checksum("0.5,1,2")));
    if (checked) keep_file("png", 0, trial::frame_path(folder, 0));
    keep("json", folder.filename().string(), files::read_whole(folder / "trial.json"));
  }
  keep("trial", "campaign",
       flagged(12,
               R"({"format": "campaign/1", "fabric": "linen", "trials": ["waving-1"], "replicates": [["waving-1"]]})"));
  keep("csv", "plain", flagged(0, "t_s,frame,x,other\n0,1,,a\n0.5,2,1e-3,b\n"));
}

void material_tests(const fs::path& scratch) {
  for (size_t which = 0; which < std::size(fuzz::kMaterialTables); ++which) {
    const std::string table = fuzz::kMaterialTables[which];
    const fs::path folder = scratch / table;
    fuzz::write_material_test(folder, which);
    const int flags = static_cast<int>(which) << 1;
    keep("material", table, flagged(flags, files::read_whole(folder / table)));
    keep("material", "header-of-" + table, flagged(flags | 1, files::read_whole(folder / "trial.json")));
  }
}

void journals(const fs::path& scratch) {
  const fs::path search = scratch / "search.csv", fitted = scratch / "fit.csv", session = scratch / "session";
  {
    estimate::Journal journal(search, "fuzz");
    journal.recorded([](const Eigen::MatrixXd& points) {
      return std::vector<double>(static_cast<size_t>(points.cols()), 0.25);
    })(Eigen::MatrixXd::Constant(2, 2, 0.5));
    estimate::FitJournal fit(fitted, "fuzz");
    fit.keep("grid 1", {1, 2.5});
    station::Journal steps(session, "");
    steps.begun("linen/record/waving-1");
    steps.done("linen/record/waving-1", 3, {{"frames", 4}});
    steps.failed("linen/fit", 1, "no trial");
  }
  keep_file("journals", 0, search);
  keep_file("journals", 1, fitted);
  keep_file("journals", 2, session / "journal.jsonl");
}

void texts() {
  const fs::path top = SELVEDGE_SOURCE_DIR;
  keep("toml", "rig", files::read_whole(top / "examples/demo-rig.toml"));
  keep_file("configuration", 0, top / "examples/demo-rig.toml");
  keep_file("configuration", 1, top / "data/projector/flash.toml");
  keep_file("configuration", 2, top / "data/arms/ur5e.toml");
  keep_file("configuration", 3, top / "examples/fabrics.toml");
  keep("pattern", "skirt", files::read_whole(top / "examples/skirt.json"));
  keep("pattern", "panels",
       R"({"format": "garment/1", "spacing_m": 0.02, "panels": [{"name": "front", "top": [[0, 1], [1, 1]],
    "bottom": [[0, 0], [1, 0]]}, {"name": "back", "gore": {"top_m": 1, "bottom_m": 1, "length_m": 1}}],
    "seams": [{"sew": ["front.right", "back.left"]}], "held": ["front.top"], "held_by": "Hips",
    "fabric": {"density": 0.2, "stretch": 100}})");
  keep("bvh", "two-joints", R"(HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Leg
  {
    OFFSET 0 -40 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {
      OFFSET 0 -40 0
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.01
0 90 0 0 0 0 10 0 0
1 90 0 0 0 5 12 0 0
)");
  keep("mapping", "drape", R"([trial]
name = "drape"
kind = "waving"
[fabric]
width_m = 0.3
height_m = 0.3
mass_kg = 0.02
[units]
length_m = 0.001
axes = ["x", "-z", "y"]
[markers]
file = "dots.csv"
time = "t"
marker = "id"
position = ["x", "y", "z"]
flat = ["u", "v"]
[corners]
left_marker = 0
right_marker = 4
)");
  keep("mapping", "pictures", R"([trial]
name = "pictures"
kind = "static"
[fabric]
width_m = 0.3
height_m = 0.3
mass_kg = 0.02
[images]
folder = "pictures"
rate_hz = 30
[camera]
width_px = 8
height_px = 4
projection = [10, 0, 4, 0, 0, 10, 2, 0, 0, 0, 1, 1]
[corners]
file = "corners.csv"
time = "t"
left = ["lx", "ly", "lz"]
right = ["rx", "ry", "rz"]
)");
}

void results() {
  const std::string optics =
                        R"({"projection": [[10, 0, 4, 0], [0, 10, 2, 0], [0, 0, 1, 1]], "distortion": [0, 0, 0, 0, 0],
    "width_px": 8, "height_px": 4, "rms_px": 0.1})",
                    poses = R"({"format": "poses/1", "camera": {"width_px": 8, "height_px": 4},
    "projector": {"width_px": 8, "height_px": 4}, "tracker_noise_m": 1e-4, "fabric_volume_m": [[0, 0, 0], [1, 1, 1]],
    "correspondences": [[1, 2, 0.1, 0.2, 0.3, 4, 2, null, null]]})",
                    calibration = R"({"format": "calibration/1", "verdict": "good", "advice": "none", "camera": )" +
                                  optics + R"(, "projector": )" + optics + R"(, "inputs": )" + poses + "}";
  keep("calibration", "whole", flagged(0, calibration));
  keep("calibration", "inputs", flagged(1, calibration));
  keep("calibration", "poses", flagged(2, poses));
  keep("calibration", "rows",
       flagged(3, "pose,marker,x,y,z,camera_u,camera_v,projector_u,projector_v\n1,2,0,0,1,4,2,,\n"));
  keep("results", "fit", flagged(0, R"({"format": "fit/1", "campaign": "b", "parameters": {"stretch": {"value": 2,
    "interval": [1, 3]}}, "held_out": {"error": 2}, "trials": {"waving": {"error_end": 1,
    "error_held_out_interval": [1, 2]}}})"));
  keep("results", "diagnosis",
       flagged(1, R"({"format": "diagnosis/1", "cause": "drag", "side": "model", "gap": {"interval_mm":
    [1, 2]}, "probabilities": {"drag": 0.6}, "shrink": {"drag": {"fraction": 0.5}}, "where": [{"axis": "time",
    "cell": "1", "share": 0.1}]})"));
  keep("results", "session", flagged(2, R"({"format": "session/1", "fabrics": {"linen": {"trials": [{"state": "done",
    "frames": 3, "frames_lost": 0, "kept_aside": []}]}}})"));
  keep("results", "motion", flagged(3, R"({"format": "motion/1", "trial": "waving", "uv_m": [[0, 0], [1, 0], [0, 1]],
    "triangles": [[0, 1, 2]], "time_s": [0, 0.1]})"));
  keep("console", "record", flagged(0, R"({"name": "t-1", "kind": "waving", "duration_s": 5, "amplitude_m": 0.03})"));
  keep("console", "answer", flagged(1, R"({"prompt": 3, "answer": "yes"})"));
  keep("console", "frame", flagged(2, "12"));
  keep("console", "path", flagged(3, "page.html"));
}

}  // namespace

int main(int count, char** words) {
  if (count != 2) return std::fputs("write_corpus FOLDER\n", stderr), 2;
  corpus = words[1];
  const fs::path scratch = fuzz::memory_folder() / "scratch";
  fs::create_directories(scratch);
  trackers();
  arms();
  bus();
  projectors();
  ring();
  trials(scratch);
  material_tests(scratch);
  journals(scratch);
  texts();
  results();
  fs::remove_all(scratch);
  fs::remove(fuzz::memory_folder());
}
