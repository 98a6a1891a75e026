// Nodes of a GenICam description (standard 2.0, schema 1.0): a feature with the register behind it, as text.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <string>
#include <utility>

#include "hardware_sim/genicam_camera/register_file.h"

namespace selvedge::sim {

class Nodes {
 public:
  using Entries = std::initializer_list<std::pair<const char*, uint32_t>>;

  // of: every register's.
  explicit Nodes(ByteOrder of) : order_(of == ByteOrder::big ? "BigEndian" : "LittleEndian") {}

  // The whole description, from the nodes' text.
  static std::string description(const char* model, const char* standard, const std::string& nodes);
  static std::string category(const char* name, std::initializer_list<const char*> features);

  std::string text(const char* name, uint32_t address, int length) const;
  std::string integer(const char* name, uint32_t address, const char* access, const std::string& bounds = "",
                      int length = 4) const;
  std::string real(const char* name, uint32_t address, const char* access, double least, double most,
                   const char* unit) const;
  std::string boolean(const char* name, uint32_t address) const;
  std::string command(const char* name, uint32_t address, int value) const;
  std::string enumeration(const char* name, uint32_t address, Entries entries, const char* access = "RW") const;
  // Bits of a register: an integer of its own, and a command that sets one of them.
  std::string masked_integer(const char* name, uint32_t address, int lsb, int msb, const std::string& bounds) const;
  std::string masked_command(const char* name, uint32_t address, int bit) const;

 private:
  std::string integer_register(const char* name, uint32_t address, int length, const char* access) const;

  const char* order_;
};

}  // namespace selvedge::sim
