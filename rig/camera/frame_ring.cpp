#include "rig/camera/frame_ring.h"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <climits>
#include <cstring>
#include <thread>
#include <type_traits>

#include <fcntl.h>
#include <linux/futex.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include "files/bad_input.h"
#include "rig/clock.h"

namespace selvedge::camera {

namespace {

constexpr uint64_t kMagic = 0x53454c5652494e31;  // "SELVRIN1"
constexpr size_t kHeaderBytes = 4096, kSlotHeadBytes = 256;
constexpr int32_t kMostSide_px = 1 << 16, kMostSlots = 1 << 16;
constexpr int64_t kMostFrames = int64_t{1} << 62;  // no ring counts so far; sums with it do not overflow

struct Slot {
  std::atomic<int64_t> number;  // of the frame it holds, 0 while it is written
  RingHead head;
};
static_assert(sizeof(Slot) <= kSlotHeadBytes && alignof(Slot) == alignof(uint64_t) &&
              std::is_trivially_copyable_v<RingHead>);
static_assert(std::atomic<int64_t>::is_always_lock_free && std::atomic<uint32_t>::is_always_lock_free);

}  // namespace

struct Memory {
  std::atomic<uint64_t> magic;  // set last, so that a reader never sees half a header
  RingShape shape;
  std::atomic<uint32_t> wake;   // futex: low half of newest
  std::atomic<int64_t> newest;  // number of the last frame written, 0 before the first
};
static_assert(sizeof(Memory) <= kHeaderBytes && std::is_trivially_copyable_v<RingShape>);

namespace {

size_t pixel_bytes(const RingShape& shape) {
  return static_cast<size_t>(shape.width_px) * static_cast<size_t>(shape.height_px);
}
size_t slot_bytes(const RingShape& shape) { return kSlotHeadBytes + (pixel_bytes(shape) + 63) / 64 * 64; }
size_t ring_bytes(const RingShape& shape) {
  return kHeaderBytes + static_cast<size_t>(shape.slots) * slot_bytes(shape);
}

char* slot_address(const Memory* memory, const RingShape& shape, int64_t number) {
  char* first = reinterpret_cast<char*>(const_cast<Memory*>(memory)) + kHeaderBytes;
  return first + static_cast<size_t>(number % shape.slots) * slot_bytes(shape);
}
Slot& slot(const Memory* memory, const RingShape& shape, int64_t number) {
  return *reinterpret_cast<Slot*>(slot_address(memory, shape, number));
}
uint8_t* pixels_of(const Memory* memory, const RingShape& shape, int64_t number) {
  return reinterpret_cast<uint8_t*>(slot_address(memory, shape, number) + kSlotHeadBytes);
}

// Whether what stands in a header can be a ring's: other programs may have written it.
bool can_be(const RingShape& shape) {
  const auto within = [](int32_t value, int32_t most) { return value > 0 && value <= most; };
  return within(shape.width_px, kMostSide_px) && within(shape.height_px, kMostSide_px) &&
         within(shape.slots, kMostSlots);
}
bool can_be_newest(int64_t number) { return number >= 0 && number < kMostFrames; }

void* map(int descriptor, size_t bytes, int protection) {
  void* address = ::mmap(nullptr, bytes, protection, MAP_SHARED, descriptor, 0);
  return address == MAP_FAILED ? nullptr : address;
}

bool same_shape(int descriptor, const RingShape& wanted) {
  struct stat status {};
  if (::fstat(descriptor, &status) != 0 || static_cast<size_t>(status.st_size) != ring_bytes(wanted)) return false;
  auto* memory = static_cast<Memory*>(map(descriptor, kHeaderBytes, PROT_READ));
  if (!memory) return false;
  const bool same = memory->magic == kMagic && memory->shape == wanted && can_be_newest(memory->newest);
  ::munmap(memory, kHeaderBytes);
  return same;
}

// To and from the ring, word by word: a reader may look while the writer writes, finds that out from the slot's number
// and throws away what it has. Plain copies would then be a data race.
void copy_in(const void* from, void* shared, size_t bytes) {
  const auto* in = static_cast<const uint8_t*>(from);
  auto* out = static_cast<uint8_t*>(shared);
  size_t i = 0;
  for (; i + sizeof(uint64_t) <= bytes; i += sizeof(uint64_t)) {
    uint64_t word;
    std::memcpy(&word, in + i, sizeof word);
    std::atomic_ref(*reinterpret_cast<uint64_t*>(out + i)).store(word, std::memory_order_relaxed);
  }
  for (; i < bytes; ++i) std::atomic_ref(out[i]).store(in[i], std::memory_order_relaxed);
}

void copy_out(void* shared, void* to, size_t bytes) {
  auto* in = static_cast<uint8_t*>(shared);
  auto* out = static_cast<uint8_t*>(to);
  size_t i = 0;
  for (; i + sizeof(uint64_t) <= bytes; i += sizeof(uint64_t)) {
    const uint64_t word = std::atomic_ref(*reinterpret_cast<uint64_t*>(in + i)).load(std::memory_order_relaxed);
    std::memcpy(out + i, &word, sizeof word);
  }
  for (; i < bytes; ++i) out[i] = std::atomic_ref(in[i]).load(std::memory_order_relaxed);
}

// A byte that is neither 0 nor 1 is no bool in C++, and may stand in shared memory.
void copy_head(RingHead& shared, RingHead& to) {
  copy_out(&shared, &to, sizeof to);
  unsigned char whole = 0;
  std::memcpy(&whole, &to.whole, sizeof whole);
  to.whole = whole == 1;
}

void futex_wait(const std::atomic<uint32_t>& word, uint32_t seen, double timeout_s) {
  timespec timeout{};
  timeout.tv_sec = static_cast<time_t>(timeout_s);
  timeout.tv_nsec = static_cast<long>((timeout_s - static_cast<double>(timeout.tv_sec)) * 1e9);
  ::syscall(SYS_futex, &word, FUTEX_WAIT, seen, &timeout, nullptr, 0);
}

bool locked_within(int descriptor, double patience_s) {
  const double until_s = rig::host_now_s() + patience_s;
  while (::flock(descriptor, LOCK_EX | LOCK_NB) != 0) {
    if (rig::host_now_s() > until_s) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return true;
}

}  // namespace

std::string ring_name(int bus_port, const std::string& device) {
  return fmt::format("/selvedge-{}-{}", bus_port, device);
}

FrameRingWriter::FrameRingWriter(const std::string& name, int width_px, int height_px, int slots,
                                 double predecessor_ends_s) {
  const RingShape shape{width_px, height_px, slots};
  const std::string where = "frame ring " + name;
  if (!can_be(shape))
    refuse(where, "found {}x{} px and {} slots, expected sides of 1 to {} px and 1 to {} slots", width_px, height_px,
           slots, kMostSide_px, kMostSlots);
  bytes_ = ring_bytes(shape);

  descriptor_ = ::shm_open(name.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (descriptor_ < 0) refuse(where, "cannot be opened: {}", std::strerror(errno));
  if (!locked_within(descriptor_, predecessor_ends_s)) {
    ::close(descriptor_);
    refuse(where, "another process writes to it; is the daemon running already?");
  }
  bool fresh = false;
  if (!same_shape(descriptor_, shape)) {
    // Not resized in place: readers of the old ring would fault.
    ::shm_unlink(name.c_str());
    ::close(descriptor_);
    descriptor_ = ::shm_open(name.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
    // posix_fallocate: short memory shows here, not as SIGBUS while a trial runs.
    const int error = descriptor_ < 0 ? errno
                      : ::flock(descriptor_, LOCK_EX | LOCK_NB) != 0
                          ? errno
                          : ::posix_fallocate(descriptor_, 0, static_cast<off_t>(bytes_));
    if (error != 0) {
      if (descriptor_ >= 0) ::close(descriptor_);
      ::shm_unlink(name.c_str());
      refuse(where, "cannot get {} MiB of shared memory: {}; fewer ring_frames need less", bytes_ >> 20,
             std::strerror(error));
    }
    fresh = true;
  }
  memory_ = static_cast<Memory*>(map(descriptor_, bytes_, PROT_READ | PROT_WRITE));
  if (!memory_) {
    ::close(descriptor_);
    refuse(where, "cannot be mapped: {}", std::strerror(errno));
  }
  if (!fresh) return;
  memory_->shape = shape;
  memory_->magic = kMagic;
}

FrameRingWriter::~FrameRingWriter() {
  ::munmap(memory_, bytes_);
  ::close(descriptor_);
}

void FrameRingWriter::remove(const std::string& name) { ::shm_unlink(name.c_str()); }

int64_t FrameRingWriter::newest_frame_number() const {
  const int64_t newest = memory_->newest.load(std::memory_order_relaxed);
  return newest == 0 ? 0 : slot(memory_, memory_->shape, newest).head.frame_number;
}

int64_t FrameRingWriter::write(const RingHead& head, const uint8_t* pixels) {
  const int64_t number = memory_->newest.load(std::memory_order_relaxed) + 1;
  const RingShape& shape = memory_->shape;
  Slot& into = slot(memory_, shape, number);
  into.number.store(0, std::memory_order_relaxed);
  std::atomic_thread_fence(std::memory_order_release);
  copy_in(&head, &into.head, sizeof head);
  copy_in(pixels, pixels_of(memory_, shape, number), pixel_bytes(shape));
  into.number.store(number, std::memory_order_release);
  memory_->newest.store(number, std::memory_order_release);
  memory_->wake.store(static_cast<uint32_t>(number), std::memory_order_release);
  ::syscall(SYS_futex, &memory_->wake, FUTEX_WAKE, INT_MAX, nullptr, nullptr, 0);
  return number;
}

FrameRingReader::FrameRingReader(const std::string& name) : name_(name) {
  const std::string where = "frame ring " + name;
  descriptor_ = ::shm_open(name.c_str(), O_RDONLY | O_CLOEXEC, 0);
  if (descriptor_ < 0) refuse(where, "cannot be opened: {}; does the camera daemon run?", std::strerror(errno));
  struct stat status {};
  ::fstat(descriptor_, &status);
  bytes_ = static_cast<size_t>(status.st_size);
  if (bytes_ > kHeaderBytes) memory_ = static_cast<const Memory*>(map(descriptor_, bytes_, PROT_READ));
  if (memory_) shape_ = memory_->shape;
  const int64_t newest = memory_ ? memory_->newest.load() : -1;
  if (!memory_ || memory_->magic != kMagic || !can_be(shape_) || ring_bytes(shape_) != bytes_ ||
      !can_be_newest(newest)) {
    if (memory_) ::munmap(const_cast<Memory*>(memory_), bytes_);
    ::close(descriptor_);
    refuse(where, "found {} bytes that are no frame ring", bytes_);
  }
  next_number_ = newest + 1;
}

FrameRingReader::~FrameRingReader() {
  ::munmap(const_cast<Memory*>(memory_), bytes_);
  ::close(descriptor_);
}

bool FrameRingReader::next(RingFrame& frame, double timeout_s) {
  const int64_t deadline_us = rig::host_now_us() + static_cast<int64_t>(timeout_s * 1e6);
  for (;;) {
    const uint32_t seen = memory_->wake.load(std::memory_order_acquire);
    const int64_t newest = memory_->newest.load(std::memory_order_acquire);
    if (!can_be_newest(newest)) refuse("frame ring " + name_, "found the frame {} as its newest", newest);
    if (newest < next_number_) {
      const int64_t left_us = deadline_us - rig::host_now_us();
      if (left_us <= 0) return false;
      futex_wait(memory_->wake, seen, static_cast<double>(left_us) * 1e-6);
      continue;
    }
    // The slot that is written next is the oldest one, so it does not count as there.
    const int64_t oldest = std::max<int64_t>(1, newest - shape_.slots + 2);
    if (next_number_ < oldest) {
      missed_ += oldest - next_number_;
      next_number_ = oldest;
    }
    Slot& from = slot(memory_, shape_, next_number_);
    if (from.number.load(std::memory_order_acquire) == next_number_) {
      frame.ring_number = next_number_;
      copy_head(from.head, frame.head);
      frame.pixels.resize(pixel_bytes(shape_));
      copy_out(pixels_of(memory_, shape_, next_number_), frame.pixels.data(), frame.pixels.size());
      std::atomic_thread_fence(std::memory_order_acquire);
      if (from.number.load(std::memory_order_relaxed) == next_number_) {
        ++next_number_;
        return true;
      }
    }
    // Overwritten while it was looked at.
    ++missed_;
    ++next_number_;
  }
}

bool FrameRingReader::replaced() const {
  const int current = ::shm_open(name_.c_str(), O_RDONLY | O_CLOEXEC, 0);
  if (current < 0) return true;
  struct stat mine {
  }, theirs{};
  ::fstat(descriptor_, &mine);
  ::fstat(current, &theirs);
  ::close(current);
  return mine.st_ino != theirs.st_ino;
}

}  // namespace selvedge::camera
