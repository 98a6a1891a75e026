// A frame ring of which another process wrote header and slots: opened, changed behind the reader's back, read.
//
// Input: flags, header behind its magic (24 bytes: shape, wake, newest), newest after the opening (8), slots.
#include <sys/mman.h>

#include <cstring>

#include "fuzz.h"
#include "rig/camera/frame_ring.h"

using namespace selvedge;

namespace {

constexpr size_t kHeader = 4096, kFields = 24, kNewestAt = 24, kMostBytes = 1 << 20;
constexpr char kMagic[] = "1NIRVLES";  // "SELVRIN1" as a little-endian number

// Bytes of a ring of that shape; 0 where that is no small one.
size_t bytes_of(const uint8_t* fields) {
  int32_t shape[3];
  std::memcpy(shape, fields, sizeof shape);
  for (const int32_t n : shape)
    if (n <= 0 || n > 4096) return 0;
  const size_t pixels = static_cast<size_t>(shape[0]) * static_cast<size_t>(shape[1]);
  const size_t bytes = kHeader + static_cast<size_t>(shape[2]) * (256 + (pixels + 63) / 64 * 64);
  return bytes <= kMostBytes ? bytes : 0;
}

}  // namespace

// Flags: bit 0 gives the memory the size that the header's shape needs, bit 1 spoils the magic.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size < 1 + kFields + 8) return 0;
  static const std::string name = "/selvedge-fuzz-" + std::to_string(::getpid());
  std::string bytes((data[0] & 2) != 0 ? "nothing!" : kMagic);
  bytes.append(reinterpret_cast<const char*>(data + 1), kFields);
  bytes.resize(kHeader);
  bytes.append(reinterpret_cast<const char*>(data + 1 + kFields + 8), size - 1 - kFields - 8);
  if (const size_t wanted = bytes_of(data + 1); (data[0] & 1) != 0 && wanted != 0) bytes.resize(wanted);
  fuzz::put("/dev/shm" + name, bytes);
  fuzz::or_refused([&] {
    camera::FrameRingReader reader(name);
    const int descriptor = ::shm_open(name.c_str(), O_RDWR | O_CLOEXEC, 0);
    if (::pwrite(descriptor, data + 1 + kFields, 8, kNewestAt) != 8) std::abort();
    ::close(descriptor);
    camera::RingFrame frame;
    for (int i = 0; i < 4 && reader.next(frame, 0); ++i)
      if (frame.head.whole && frame.pixels.empty()) std::abort();
  });
  // As the daemon does that comes after a crash.
  if ((data[0] & 4) != 0) fuzz::or_refused([&] { camera::FrameRingWriter(name, 8, 4, 4).newest_frame_number(); });
  ::shm_unlink(name.c_str());
  return 0;
}
