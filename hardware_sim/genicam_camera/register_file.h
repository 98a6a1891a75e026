// The register file of a simulated camera: bytes behind addresses, with what a client may write there.
//
// Source: what GVCP (GigE Vision) and GenCP (USB3 Vision) have in common; they differ in byte order and alignment.
#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <vector>

namespace selvedge::sim {

enum class ByteOrder { big, little };

// Why an access is refused: the low byte of the status 0x80xx, the same in both protocols.
enum class AccessError : uint8_t {
  none = 0x00,
  not_implemented = 0x01,
  invalid_parameter = 0x02,
  invalid_address = 0x03,
  write_protect = 0x04,
  bad_alignment = 0x05,
  access_denied = 0x06,
  invalid_header = 0x0e,
};

class RegisterFile {
 public:
  // alignment_bytes: of every access, its address and its length.
  RegisterFile(ByteOrder order, size_t size_bytes, size_t alignment_bytes);

  // What clients may write; everything else is write-protected. A command's value is not kept.
  void allow(uint32_t address, uint32_t least, uint32_t most);
  void allow_real(uint32_t address, double least, double most);
  void allow_command(uint32_t address, uint32_t least, uint32_t most);

  AccessError read(uint64_t address, uint8_t* bytes, size_t count) const;
  // One register: 4 bytes, or 8 (float64), in the file's byte order.
  AccessError write(uint64_t address, const uint8_t* bytes, size_t count);

  uint32_t word(uint32_t address) const;
  double real(uint32_t address) const;
  uint32_t word_of(const uint8_t* bytes) const;  // of four bytes in the file's order
  void set_word(uint32_t address, uint32_t value);
  void set_long(uint32_t address, uint64_t value);
  void set_real(uint32_t address, double value);
  void set_text(uint32_t address, size_t size, const std::string& text);  // cut to size

 private:
  struct Allowed {
    double least, most;
    size_t bytes;  // 4: an unsigned word, 8: a float64
    bool command;
  };
  uint64_t get(size_t address, size_t count) const;
  void put(size_t address, uint64_t value, size_t count);

  const ByteOrder order_;
  const size_t alignment_bytes_;
  std::map<uint64_t, Allowed> allowed_;
  mutable std::mutex mutex_;  // guards the bytes
  std::vector<uint8_t> bytes_;
};

}  // namespace selvedge::sim
