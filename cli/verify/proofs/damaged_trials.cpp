#include "cli/verify/proofs/damaged_trials.h"

#include <algorithm>
#include <cstdlib>
#include <random>
#include <stdexcept>

#include "capture/trial/trial_writer.h"
#include "files/bad_input.h"
#include "files/whole_file.h"

namespace selvedge::cli {

namespace fs = std::filesystem;
using nlohmann::json;

ScratchFolder::ScratchFolder() {
  std::string name = (fs::temp_directory_path() / "selvedge-XXXXXX").string();
  if (!::mkdtemp(name.data())) throw std::runtime_error("no temporary folder can be made as " + name);
  path_ = name;
}

ScratchFolder::~ScratchFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

ExampleTrial example_trial(unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  const auto any_point = [&] { return Eigen::Vector3d(normal(random), normal(random), normal(random)); };
  ExampleTrial example;
  trial::Trial& t = example.trial;
  t.experiment = trial::Experiment::robot;
  t.held = trial::Held::top_edge_clamped;
  t.clamp_direction = any_point();
  t.fabric = {"ripstop, \"grey\" §4", 0.1 + 0.2, 1.0 / 3, 0.0162, false};
  t.starts_at_rest = true;
  t.gravity_m_s2 = any_point();
  geometry::Projection camera;
  camera.matrix << 1028.98, 381.67, -9.56, 318.78, -12.45, 207.58, -1056.69, 81.53, -0.0598, 0.9977, -0.0299, 0.9977;
  camera.matrix += 1e-3 * Eigen::Matrix<double, 3, 4>::NullaryExpr([&] { return normal(random); });
  camera.distortion = {-0.21, 0.05, 1e-3, -2e-4, 1.0 / 7};
  camera.width_px = 64;
  camera.height_px = 48;
  t.camera = t.projector = camera;
  t.pattern = trial::StripePattern{"horizontal", 16.5, 0.4, 3};
  t.frame_rate_hz = 29.97;
  t.exposure_s = 1e-3;
  t.mocap_rate_hz = 120;
  t.mocap_noise_m = 2e-4;
  t.noise_grey_levels = 1.5;
  const int samples = 60, markers = 4;
  t.corners.left.resize(3, samples);
  t.corners.right.resize(3, samples);
  t.robot.emplace();
  t.robot->commanded.resize(3, samples);
  t.robot->measured.resize(3, samples);
  t.markers.emplace();
  t.markers->position.resize(3, samples * markers);
  for (int i = 0; i < samples; ++i) {
    const double time_s = i / 120.0;
    t.corners.time_s.push_back(time_s);
    t.corners.left.col(i) = any_point();
    t.corners.right.col(i) = i % 7 == 3 ? Eigen::Vector3d::Constant(std::nan("")).eval() : any_point();
    t.robot->time_s.push_back(time_s);
    t.robot->commanded.col(i) = any_point();
    t.robot->measured.col(i) = any_point();
    for (int m = 0; m < markers; ++m) {
      t.markers->time_s.push_back(time_s);
      t.markers->marker.push_back(m);
      t.markers->uv.emplace_back(0.1 * m, 1.0 / 7);
      t.markers->position.col(i * markers + m) = any_point();
    }
  }
  t.frames.emplace();
  for (const int number : {0, 1, 2, 5, 6}) {
    t.frames->number.push_back(number);
    t.frames->time_s.push_back(number / 29.97);
    example.images.push_back(trial::GreyImage::NullaryExpr(camera.height_px, camera.width_px,
                                                           [&] { return static_cast<unsigned char>(random() & 255); }));
  }
  return example;
}

namespace {

using Change = std::function<void(const fs::path&)>;

Change truncate_to(const char* file, double share) {
  return [=](const fs::path& folder) {
    fs::resize_file(folder / file,
                    static_cast<std::uintmax_t>(share * static_cast<double>(fs::file_size(folder / file))));
  };
}

Change drop(const char* file) {
  return [=](const fs::path& folder) { fs::remove_all(folder / file); };
}

Change replace_text(const char* file, const std::string& from, const std::string& to) {
  return [=](const fs::path& folder) {
    std::string text = files::read_whole(folder / file);
    const size_t at = text.find(from);
    if (at == std::string::npos) throw std::logic_error("damaged_trials: no \"" + from + "\" in " + file);
    files::write_whole(folder / file, text.replace(at, from.size(), to));
  };
}

// Puts `value` at a JSON pointer of trial.json, or takes the key away.
Change set_key(const std::string& pointer, const json& value) {
  return [=](const fs::path& folder) {
    json object = files::read_json(folder / "trial.json");
    object[json::json_pointer(pointer)] = value;
    files::write_json(folder / "trial.json", object);
  };
}

Change drop_key(const char* key) {
  return [=](const fs::path& folder) {
    json object = files::read_json(folder / "trial.json");
    object.erase(key);
    files::write_json(folder / "trial.json", object);
  };
}

// The third row becomes a sum of the other two.
Change lower_rank(const std::string& side) {
  return [=](const fs::path& folder) {
    json object = files::read_json(folder / "trial.json");
    json& rows = object[side]["projection"];
    for (int i = 0; i < 4; ++i) rows[2][i] = 0.7 * rows[0][i].get<double>() - 1.3 * rows[1][i].get<double>();
    files::write_json(folder / "trial.json", object);
  };
}

Change fill_numbers(const char* file, const std::string& with) {
  return [=](const fs::path& folder) {
    const std::string text = files::read_whole(folder / file);
    std::string filled = text.substr(0, text.find('\n') + 1);
    const long columns = 1 + std::count(filled.begin(), filled.end(), ',');
    for (int row = 0; row < 5; ++row)
      for (long c = 0; c < columns; ++c) filled += with + (c + 1 < columns ? "," : "\n");
    files::write_whole(folder / file, filled);
  };
}

// Swaps the second and third data lines: times, or frame numbers, go backwards.
Change swap_lines(const char* file, const std::string& skip_to) {
  return [=](const fs::path& folder) {
    const std::string text = files::read_whole(folder / file);
    const size_t first = text.find(skip_to) + 1, second = text.find('\n', first) + 1, end = text.find('\n', second) + 1;
    files::write_whole(folder / file, text.substr(0, first) + text.substr(second, end - second) +
                                          text.substr(first, second - first) + text.substr(end));
  };
}

Change write_image(const char* file, int width_px, int height_px) {
  return [=](const fs::path& folder) {
    const std::vector<unsigned char> pixels(static_cast<size_t>(width_px) * height_px, 90);
    files::write_whole(folder / file, trial::encode_grey_png(pixels.data(), width_px, height_px, 6));
  };
}

Change flip_byte(const char* file, double at) {
  return [=](const fs::path& folder) {
    std::string bytes = files::read_whole(folder / file);
    bytes[static_cast<size_t>(at * static_cast<double>(bytes.size()))] ^= 0x10;
    files::write_whole(folder / file, bytes);
  };
}

void add_csv_damages(std::vector<Damage>& list) {
  for (const char* file : {"corners.csv", "frames.csv", "markers.csv", "robot.csv"}) {
    const std::string name = file;
    list.push_back({name + " empty", name, truncate_to(file, 0)});
    list.push_back({name + " cut in its header", name, [=](const fs::path& f) { fs::resize_file(f / file, 5); }});
    list.push_back({name + " cut in its last line", name,
                    [=](const fs::path& folder) { fs::resize_file(folder / file, fs::file_size(folder / file) - 3); }});
    list.push_back({name + " without rows", name, [=](const fs::path& folder) {
                      const std::string text = files::read_whole(folder / file);
                      files::write_whole(folder / file, text.substr(0, text.find('\n') + 1));
                    }});
    list.push_back({name + " filled with NaN", name, fill_numbers(file, "nan")});
    list.push_back({name + " filled with infinities", name, fill_numbers(file, "inf")});
    list.push_back({name + " filled with text", name, fill_numbers(file, "x")});
    list.push_back({name + " filled with zero bytes", name, [=](const fs::path& folder) {
                      files::write_whole(folder / file, std::string(fs::file_size(folder / file), '\0'));
                    }});
    list.push_back({name + " without its time column", name, replace_text(file, "t_s", "time")});
    list.push_back({name + " with a field too many", name, replace_text(file, "\n0,", "\n0,0,")});
    list.push_back({name + " is a folder", name, [=](const fs::path& folder) {
                      fs::remove(folder / file);
                      fs::create_directory(folder / file);
                    }});
  }
  list.push_back({"corners.csv missing", "corners.csv", drop("corners.csv")});
  list.push_back({"frames.csv missing", "frames.csv", drop("frames.csv")});
  list.push_back({"corners.csv: times go backwards", "corners.csv:4", swap_lines("corners.csv", "\n0.008")});
  list.push_back({"markers.csv: times go backwards", "markers.csv", swap_lines("markers.csv", "\n0,3")});
  list.push_back({"frames.csv: frames go backwards", "frames.csv:4", swap_lines("frames.csv", "\n1,")});
  list.push_back({"frames.csv: one frame twice", "frames.csv:4", replace_text("frames.csv", "\n2,", "\n1,")});
  list.push_back(
      {"frames.csv: a frame that is no whole number", "frames.csv:3", replace_text("frames.csv", "\n1,", "\n1.5,")});
  list.push_back({"markers.csv: a marker that is no whole number", "markers.csv:3",
                  replace_text("markers.csv", "\n0,1,", "\n0,1.5,")});
  list.push_back(
      {"frames.csv lists a frame that is not there", "000003.png", replace_text("frames.csv", "\n5,", "\n3,")});
  list.push_back({"frames.csv cut after a whole line", "frames.csv", [](const fs::path& folder) {
                    const std::string text = files::read_whole(folder / "frames.csv");
                    files::write_whole(folder / "frames.csv", text.substr(0, text.find("\n5,") + 1));
                  }});
  list.push_back({"a corner that is never seen", "corners.csv", [](const fs::path& folder) {
                    files::write_whole(folder / "corners.csv",
                                       std::string(trial::corners_header) + "0,0,0,0,,,\n1,0,0,0,,,\n");
                  }});
}

void add_image_damages(std::vector<Damage>& list) {
  const char* image = "frames/000002.png";
  list.push_back({"an image missing", "000002.png", drop(image)});
  list.push_back({"an image empty", "000002.png", truncate_to(image, 0)});
  list.push_back(
      {"an image cut in its header", "000002.png", [=](const fs::path& f) { fs::resize_file(f / image, 20); }});
  list.push_back({"an image cut in half", "000002.png", truncate_to(image, 0.5)});
  list.push_back({"an image with one bit wrong", "000002.png", flip_byte(image, 0.5)});
  list.push_back({"an image too wide", "000002.png", write_image(image, 65, 48)});
  list.push_back({"an image too low", "000002.png", write_image(image, 64, 47)});
  list.push_back({"an image turned by 90 degrees", "000002.png", write_image(image, 48, 64)});
  list.push_back({"an image that is text", "000002.png", [=](const fs::path& folder) {
                    files::write_whole(folder / image, "not an image, though long enough to hold a header\n");
                  }});
}

void add_json_damages(std::vector<Damage>& list) {
  const std::string file = "trial.json";
  list.push_back({"trial.json missing", file, drop("trial.json")});
  list.push_back({"trial.json empty", file, truncate_to("trial.json", 0)});
  list.push_back({"trial.json cut in half", file, truncate_to("trial.json", 0.5)});
  list.push_back(
      {"trial.json holds a list", file, [](const fs::path& f) { files::write_whole(f / "trial.json", "[1]\n"); }});
  list.push_back({"trial.json holds NaN", file, replace_text("trial.json", "0.0162", "NaN")});
  list.push_back({"trial.json holds 1e999", file, replace_text("trial.json", "0.0162", "1e999")});
  list.push_back({"unknown format", "format", set_key("/format", "trial/2")});
  list.push_back({"no format", "format", drop_key("format")});
  list.push_back({"unknown experiment", "experiment", set_key("/experiment", "swinging")});
  list.push_back({"unknown way of holding", "held", set_key("/held", "left_edge")});
  list.push_back({"no clamp direction", "clamp_direction", drop_key("clamp_direction")});
  list.push_back({"no fabric", "fabric", drop_key("fabric")});
  for (const char* key : {"width_m", "height_m", "mass_kg"}) {
    const std::string pointer = std::string("/fabric/") + key, where = std::string("fabric.") + key;
    list.push_back({where + " zero", where, set_key(pointer, 0)});
    list.push_back({where + " negative", where, set_key(pointer, -0.3)});
    list.push_back({where + " a text", where, set_key(pointer, "0.3")});
    list.push_back({where + " null", where, set_key(pointer, nullptr)});
    list.push_back({where + " beyond any fabric", where, set_key(pointer, 1e300)});
  }
  list.push_back({"gravity of two numbers", "gravity_m_s2", set_key("/gravity_m_s2", {0, -9.81})});
  for (const char* side : {"camera", "projector"}) {
    const std::string pointer = std::string("/") + side;
    const std::string where = std::string(side) + ".projection";
    list.push_back({where + " of rank 2", where, lower_rank(side)});
    list.push_back({where + " of zeros", where,
                    set_key(pointer + "/projection", json::array({{0, 0, 0, 0}, {0, 0, 0, 0}, {0, 0, 0, 0}}))});
    list.push_back(
        {where + " with two rows", where, set_key(pointer + "/projection", json::array({{1, 0, 0, 0}, {0, 1, 0, 0}}))});
    list.push_back({where + " with a row of three", where, set_key(pointer + "/projection/1", {1, 2, 3})});
    list.push_back({where + " with a text", where, set_key(pointer + "/projection/1/2", "1")});
    list.push_back(
        {std::string(side) + ".width_px zero", std::string(side) + ".width_px", set_key(pointer + "/width_px", 0)});
  }
  list.push_back(
      {"camera.distortion of four numbers", "camera.distortion", set_key("/camera/distortion", {0, 0, 0, 0})});
  list.push_back({"images without a camera", "camera", drop_key("camera")});
  list.push_back({"stripes of period 0", "projector.pattern.period_px", set_key("/projector/pattern/period_px", 0)});
  list.push_back({"stripes that fill everything", "projector.pattern.duty", set_key("/projector/pattern/duty", 1)});
  list.push_back({"negative tracker noise", "mocap.noise_m", set_key("/mocap/noise_m", -1e-3)});
  list.push_back({"the folder missing", "trial", [](const fs::path& folder) { fs::remove_all(folder); }});
  list.push_back({"neither images nor markers", "markers.csv", [](const fs::path& folder) {
                    for (const char* part : {"frames", "frames.csv", "markers.csv"}) fs::remove_all(folder / part);
                    set_key("/frames/count", 0)(folder);
                  }});
}

}  // namespace

const std::vector<Damage>& damages() {
  static const std::vector<Damage> list = [] {
    std::vector<Damage> all;
    add_csv_damages(all);
    add_image_damages(all);
    add_json_damages(all);
    return all;
  }();
  return list;
}

const std::vector<Damage>& harmless_changes() {
  static const std::vector<Damage> list =
      {
          {"markers alone", "",
           [](const fs::path& folder) {
    for (const char* part : {"frames", "frames.csv", "robot.csv"}) fs::remove_all(folder / part);
    for (const char* key : {"frames", "camera", "projector", "noise_grey_levels", "state"}) drop_key(key)(folder);
           }},
          {"images alone", "", drop("markers.csv")},
          {"no robot.csv", "", drop("robot.csv")},
          {"no projector", "", drop_key("projector")},
          {"no pattern", "",
           [](const fs::path& folder) {
    json object = files::read_json(folder / "trial.json");
    object["projector"].erase("pattern");
    files::write_json(folder / "trial.json", object);
           }},
                                   {"no noise", "",
                                    [](const fs::path& folder) {
    set_key("/mocap", {{"rate_hz", 120}})(folder);
    drop_key("noise_grey_levels")(folder);
                                    }},
      {"no rates", "",
       [](const fs::path& folder) {
    drop_key("mocap")(folder);
    drop_key("frames")(folder);
       }},
      {"held by the corners, not said", "", drop_key("held")},
      {"an unknown key", "", set_key("/notes", "a draught in the afternoon")},
      {"columns in another order, one unknown, lines ended as in DOS, blank lines at the end", "",
       [](const fs::path& folder) {
    files::write_whole(folder / "robot.csv",
                       "gain,measured_x,measured_y,measured_z,t_s,commanded_x,commanded_y,commanded_z\r\n"
                       "high,1,2,3,0,1,2,3\r\nlow,1,2,3,0.5,1,2,3\r\n\r\n");
       }},
      };
  return list;
}

std::string refusal_of(const fs::path& folder) {
  try {
    const trial::Campaign campaign = trial::read_campaign(folder);
    for (const trial::Trial& trial : campaign.trials)
      for (size_t i = 0; trial.frames && i < trial.frames->path.size(); ++i) trial::read_frame(trial, i);
  } catch (const BadInput& error) { return error.what(); }
  return "";
}

}  // namespace selvedge::cli
