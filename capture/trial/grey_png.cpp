#include "capture/trial/grey_png.h"

#include <cstring>
#include <fstream>
#include <vector>

#include <png.h>
#include <zlib.h>

#include "files/bad_input.h"
#include "files/whole_file.h"

namespace selvedge::trial {

namespace {

constexpr size_t header_bytes = 8 + 25;  // signature and IHDR
constexpr char end_chunk[] = "\0\0\0\0IEND\xae\x42\x60\x82";

unsigned big_endian(const char* bytes) {
  unsigned value = 0;
  for (int i = 0; i < 4; ++i) value = value << 8 | static_cast<unsigned char>(bytes[i]);
  return value;
}

PngSize parse_header(const char* bytes, size_t count, const std::string& where) {
  if (count == 0) refuse(where, "found an empty file, expected a PNG image");
  if (count < header_bytes || std::memcmp(bytes, "\x89PNG\r\n\x1a\n", 8) != 0 ||
      std::memcmp(bytes + 12, "IHDR", 4) != 0)
    refuse(where, "found {} bytes without a PNG header, expected a PNG image", count);
  const unsigned width = big_endian(bytes + 16), height = big_endian(bytes + 20);
  const int depth = bytes[24], colour = bytes[25];
  if (depth != 8 || colour != PNG_COLOR_TYPE_GRAY)
    refuse(where, "found a PNG of {} bits and colour type {}, expected 8-bit grey (colour type 0)", depth, colour);
  if (width == 0 || height == 0 || width > 1000000 || height > 1000000)
    refuse(where, "found an image of {}x{} px, expected sides from 1 to 1000000", width, height);
  return {static_cast<int>(width), static_cast<int>(height)};
}

// libpng's callbacks jump back with the message kept here; they never throw.
struct Session {
  char message[128] = "damaged data";
  const std::string* source = nullptr;
  size_t position = 0;
  std::string* sink = nullptr;
};

[[noreturn]] void on_error(png_structp png, png_const_charp message) {
  auto* session = static_cast<Session*>(png_get_error_ptr(png));
  std::strncpy(session->message, message, sizeof session->message - 1);
  png_longjmp(png, 1);
}

void on_warning(png_structp, png_const_charp) {}

void on_read(png_structp png, png_bytep bytes, size_t count) {
  auto* session = static_cast<Session*>(png_get_io_ptr(png));
  if (session->source->size() - session->position < count) png_error(png, "the file ends too early");
  std::memcpy(bytes, session->source->data() + session->position, count);
  session->position += count;
}

void on_write(png_structp png, png_bytep bytes, size_t count) {
  static_cast<Session*>(png_get_io_ptr(png))->sink->append(reinterpret_cast<char*>(bytes), count);
}

// False where libpng gave up; everything with a destructor lives in the caller, because of the jump.
bool decode(Session& session, GreyImage& image) {
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &session, on_error, on_warning);
  png_infop info = png_create_info_struct(png);
  if (setjmp(png_jmpbuf(png))) {
    png_destroy_read_struct(&png, &info, nullptr);
    return false;
  }
  png_set_read_fn(png, &session, on_read);
  png_read_info(png, info);
  const int passes = png_set_interlace_handling(png);
  png_read_update_info(png, info);
  for (int pass = 0; pass < passes; ++pass)
    for (int row = 0; row < image.rows(); ++row)
      png_read_row(png, image.data() + static_cast<size_t>(row) * image.cols(), nullptr);
  png_read_end(png, nullptr);
  png_destroy_read_struct(&png, &info, nullptr);
  return true;
}

bool encode(Session& session, const unsigned char* pixels, int width_px, int height_px, int level) {
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &session, on_error, on_warning);
  png_infop info = png_create_info_struct(png);
  if (setjmp(png_jmpbuf(png))) {
    png_destroy_write_struct(&png, &info);
    return false;
  }
  png_set_write_fn(png, &session, on_write, nullptr);
  png_set_IHDR(png, info, width_px, height_px, 8, PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
               PNG_FILTER_TYPE_DEFAULT);
  png_set_compression_level(png, level);
  // Between noisy pixels there is nothing to match but runs: twice as fast as zlib's own level 1, and smaller.
  if (level == 1) png_set_compression_strategy(png, Z_RLE);
  png_set_filter(png, PNG_FILTER_TYPE_BASE, level == 0 ? PNG_FILTER_NONE : PNG_FILTER_SUB);
  png_write_info(png, info);
  for (int row = 0; row < height_px; ++row) png_write_row(png, pixels + static_cast<size_t>(row) * width_px);
  png_write_end(png, nullptr);
  png_destroy_write_struct(&png, &info);
  return true;
}

}  // namespace

PngSize read_png_size(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) refuse(path.string(), "no such file, expected a PNG image");
  std::ifstream stream(path, std::ios::binary);
  if (!stream) refuse(path.string(), "cannot be opened: {}", std::strerror(errno));
  char header[header_bytes], tail[12];
  stream.read(header, sizeof header);
  const PngSize size = parse_header(header, static_cast<size_t>(stream.gcount()), path.string());
  stream.seekg(-static_cast<int>(sizeof tail), std::ios::end);
  stream.read(tail, sizeof tail);
  if (!stream || std::memcmp(tail, end_chunk, sizeof tail) != 0)
    refuse(path.string(), "found no end mark in the last 12 bytes, expected a whole PNG image (the file is cut off)");
  return size;
}

GreyImage read_grey_png(const std::filesystem::path& path) {
  return decode_grey_png(files::read_whole(path), path.string());
}

GreyImage decode_grey_png(const std::string& bytes, const std::string& where) {
  const PngSize size = parse_header(bytes.data(), bytes.size(), where);
  // No image compresses by more than deflate's 1032 : 1; keeps a forged header from taking all memory.
  if (static_cast<double>(size.width_px) * size.height_px > 1100.0 * static_cast<double>(bytes.size()))
    refuse(where, "found {} bytes, expected more for {}x{} px", bytes.size(), size.width_px, size.height_px);
  GreyImage image(size.height_px, size.width_px);
  Session session;
  session.source = &bytes;
  if (!decode(session, image))
    refuse(where, "found damaged image data ({}), expected a whole PNG image", session.message);
  return image;
}

std::string encode_grey_png(const unsigned char* pixels, int width_px, int height_px, int level) {
  std::string bytes;
  // Room for data that deflate cannot shrink, so that on_write never has to allocate.
  const size_t raw = static_cast<size_t>(width_px + 1) * height_px;
  bytes.reserve(raw + raw / 500 + 8192);
  Session session;
  session.sink = &bytes;
  if (!encode(session, pixels, width_px, height_px, level))
    throw std::runtime_error(fmt::format("encode_grey_png: {}x{} px: {}", width_px, height_px, session.message));
  return bytes;
}

}  // namespace selvedge::trial
