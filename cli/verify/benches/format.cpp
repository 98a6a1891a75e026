// `./selvedge bench format`: how fast trials are read and written, beside the usual ways in the same run.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <random>

#include <opencv2/imgcodecs.hpp>

#include "capture/trial/trial_writer.h"
#include "cli/verify/figures.h"
#include "cli/verify/proofs/damaged_trials.h"
#include "files/whole_file.h"

namespace selvedge::cli {

namespace fs = std::filesystem;

namespace {

double median_s(int repeats, const std::function<void()>& work) {
  std::vector<double> times_s;
  for (int i = 0; i < repeats; ++i) {
    const auto start = std::chrono::steady_clock::now();
    work();
    times_s.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  return median(std::move(times_s));
}

trial::Trial many_markers(unsigned seed, int rows) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  trial::Trial trial = example_trial(seed).trial;
  trial.frames.reset();
  trial::Markers& markers = *trial.markers;
  markers = {};
  markers.position.resize(3, rows);
  for (int i = 0; i < rows; ++i) {
    markers.time_s.push_back(i / 25 / 120.0);
    markers.marker.push_back(i % 25);
    markers.uv.emplace_back(0.06 * (i % 5), 0.06 * (i / 5 % 5));
    for (int axis = 0; axis < 3; ++axis) markers.position(axis, i) = normal(random);
  }
  return trial;
}

// The usual way to read a CSV of numbers in C++.
double read_with_streams(const fs::path& path) {
  std::ifstream stream(path);
  std::string line;
  std::getline(stream, line);
  double value = 0, sum = 0;
  for (char comma; stream >> value; stream.get(comma)) sum += value;
  return sum;
}

// Stripes with sensor noise, as a camera of the rig sees them.
trial::GreyImage noisy_stripes(unsigned seed, int width_px, int height_px) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, 1);
  trial::GreyImage image(height_px, width_px);
  for (int row = 0; row < height_px; ++row)
    for (int c = 0; c < width_px; ++c)
      image(row, c) = static_cast<unsigned char>(std::clamp(
          90 + 60 * std::tanh(3 * std::sin(0.4 * row + 2 * std::sin(0.01 * c))) + noise(random), 0.0, 255.0));
  return image;
}

}  // namespace

std::vector<Figure> bench_format(const FigureOptions& options) {
  ScratchFolder scratch;
  const int rows = options.quick ? 5000 : 100000, repeats = options.quick ? 3 : 9;
  const trial::Trial trial = many_markers(options.seed, rows);
  const fs::path folder = scratch.path() / "trial";
  const double write_s = median_s(repeats, [&] { trial::write_trial(trial, folder); });
  const fs::path csv = folder / "markers.csv";
  const double megabytes = static_cast<double>(fs::file_size(csv)) / 1e6;
  const double raw_s = median_s(repeats, [&] { files::read_whole(csv); });
  const double read_s = median_s(repeats, [&] { trial::read_trial(folder); });
  volatile double sum = 0;
  const double stream_s = median_s(repeats, [&] { sum = read_with_streams(csv); });
  options.progress(0.5, "CSV");

  const trial::GreyImage image = noisy_stripes(options.seed, 1280, 1024);
  const auto encode = [&](int level) { return trial::encode_grey_png(image.data(), 1280, 1024, level); };
  const std::string png = encode(1);
  const fs::path path = scratch.path() / "image.png";
  files::write_whole(path, png);
  const double decode_s = median_s(repeats, [&] { trial::read_grey_png(path); });
  const double opencv_s = median_s(repeats, [&] { cv::imread(path.string(), cv::IMREAD_GRAYSCALE); });
  const double encode_s = median_s(repeats, [&] { encode(1); });
  const double stored_s = median_s(repeats, [&] { encode(0); });
  const cv::Mat mat(1024, 1280, CV_8U, const_cast<unsigned char*>(image.data()));
  std::vector<unsigned char> sink;
  const double opencv_encode_s = median_s(repeats, [&] {
    cv::imencode(".png", mat, sink, {cv::IMWRITE_PNG_COMPRESSION, 1});
  });
  options.progress(1, "PNG");

  const std::string here = "same file, same run";
  return {
      {"read a trial, markers.csv of " + std::to_string(rows) + " rows, against streams", megabytes / read_s,
       megabytes / stream_s, "MB/s", Relation::shown, "std::ifstream >> double, " + here},
      {"the same against the file's bare bytes", megabytes / read_s, megabytes / raw_s, "MB/s", Relation::shown,
       "read_whole, " + here},
      {"write a trial to disk with fsync", megabytes / write_s, megabytes / read_s, "MB/s", Relation::shown,
       "reading it, same run"},
      {"decode a PNG of 1280x1024", 1 / decode_s, 1 / opencv_s, "images/s", Relation::shown, "cv::imread, " + here},
      {"encode a PNG of 1280x1024, level 1", 1 / encode_s, 1 / opencv_encode_s, "images/s", Relation::shown,
       "cv::imencode, level 1, same image"},
      {"encode it stored, level 0", 1 / stored_s, 1 / encode_s, "images/s", Relation::shown, "level 1, same image"},
      {"size at level 1 against stored", static_cast<double>(png.size()) / 1e6,
       static_cast<double>(encode(0).size()) / 1e6, "MB", Relation::shown, "level 0, same image"},
  };
}

}  // namespace selvedge::cli
