// PNG images of a trial. Bit 0 of the first byte mends the checksums of the chunks, which no mutation gets right.
#include <zlib.h>

#include "capture/trial/grey_png.h"
#include "fuzz.h"

using namespace selvedge;

namespace {

uint32_t big_endian(const std::string& bytes, size_t at) {
  uint32_t value = 0;
  for (size_t i = 0; i < 4; ++i) value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
  return value;
}

void mend_checksums(std::string& bytes) {
  constexpr size_t signature = 8, around_data = 12;
  for (size_t at = signature; bytes.size() >= around_data && at <= bytes.size() - around_data;) {
    const size_t length = big_endian(bytes, at);
    if (length > bytes.size() - around_data - at) return;
    const auto crc = static_cast<uint32_t>(
        ::crc32(0, reinterpret_cast<const Bytef*>(bytes.data() + at + 4), static_cast<uInt>(length + 4)));
    for (size_t i = 0; i < 4; ++i) bytes[at + 8 + length + i] = static_cast<char>(crc >> (24 - 8 * i));
    at += length + around_data;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size < 1) return 0;
  std::string bytes(fuzz::text_of(data + 1, size - 1));
  if ((data[0] & 1) != 0) mend_checksums(bytes);
  fuzz::or_refused([&] {
    const trial::GreyImage image = trial::decode_grey_png(bytes, "fuzz.png");
    const std::string again =
        trial::encode_grey_png(image.data(), static_cast<int>(image.cols()), static_cast<int>(image.rows()), 1);
    if (trial::decode_grey_png(again, "again") != image) std::abort();
  });
  fuzz::or_refused([&] {
    fuzz::put(fuzz::memory_folder() / "fuzz.png", bytes);
    trial::read_png_size(fuzz::memory_folder() / "fuzz.png");
  });
  return 0;
}
