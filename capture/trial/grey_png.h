// 8-bit grey PNG images: size from the header, decoding, encoding. Grey levels pass unchanged (no gamma).
#pragma once

#include <filesystem>
#include <string>

#include <Eigen/Core>

namespace selvedge::trial {

using GreyImage = Eigen::Matrix<unsigned char, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

struct PngSize {
  int width_px = 0;
  int height_px = 0;
};

// From the header alone; also looks for the end mark in the file's last bytes, so that a file cut short
// shows without decoding it. Throws BadInput where it is no 8-bit grey PNG.
PngSize read_png_size(const std::filesystem::path& path);

// Throws BadInput where the file is missing, damaged, or not 8-bit grey.
GreyImage read_grey_png(const std::filesystem::path& path);
// The same of a file that was read already; `where` is for errors.
GreyImage decode_grey_png(const std::string& bytes, const std::string& where);

// PNG bytes of an image, row major without padding. level: zlib's, 0 (stored) to 9; 1 is made
// for recording: run lengths and Huffman codes alone.
std::string encode_grey_png(const unsigned char* pixels, int width_px, int height_px, int level);

}  // namespace selvedge::trial
