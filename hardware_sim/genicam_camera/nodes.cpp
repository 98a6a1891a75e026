#include "hardware_sim/genicam_camera/nodes.h"

#include <fmt/format.h>

namespace selvedge::sim {

namespace {

std::string register_body(uint32_t address, int length, const char* access) {
  return fmt::format("<Address>0x{:X}</Address><Length>{}</Length><AccessMode>{}</AccessMode><pPort>Device</pPort>",
                     address, length, access);
}
std::string register_name(const char* name) { return fmt::format("{}Register", name); }

}  // namespace

std::string Nodes::description(const char* model, const char* standard, const std::string& nodes) {
  return fmt::format(
             "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n"
             "<RegisterDescription ModelName=\"{}\" VendorName=\"Selvedge\" StandardNameSpace=\"{}\" "
             "SchemaMajorVersion=\"1\" SchemaMinorVersion=\"0\" SchemaSubMinorVersion=\"1\" MajorVersion=\"1\" "
             "MinorVersion=\"0\" SubMinorVersion=\"0\" ProductGuid=\"0\" VersionGuid=\"0\" "
             "xmlns=\"http://www.genicam.org/GenApi/Version_1_0\">\n",
             model, standard) +
         nodes + "<Port Name=\"Device\" NameSpace=\"Standard\"></Port>\n</RegisterDescription>\n";
}

std::string Nodes::category(const char* name, std::initializer_list<const char*> features) {
  std::string result = fmt::format("<Category Name=\"{}\" NameSpace=\"Standard\">", name);
  for (const char* feature : features) result += fmt::format("<pFeature>{}</pFeature>", feature);
  return result + "</Category>\n";
}

std::string Nodes::integer_register(const char* name, uint32_t address, int length, const char* access) const {
  return fmt::format(
      "<IntReg Name=\"{}\">{}<Cachable>NoCache</Cachable><Sign>Unsigned</Sign><Endianess>{}</Endianess></IntReg>\n",
      name, register_body(address, length, access), order_);
}

std::string Nodes::text(const char* name, uint32_t address, int length) const {
  return fmt::format("<StringReg Name=\"{}\">{}</StringReg>\n", name, register_body(address, length, "RO"));
}

std::string Nodes::integer(const char* name, uint32_t address, const char* access, const std::string& bounds,
                           int length) const {
  const std::string value = register_name(name);
  return fmt::format("<Integer Name=\"{}\" NameSpace=\"Standard\"><pValue>{}</pValue>{}</Integer>\n", name, value,
                     bounds) +
         integer_register(value.c_str(), address, length, access);
}

std::string Nodes::real(const char* name, uint32_t address, const char* access, double least, double most,
                        const char* unit) const {
  return fmt::format(
      "<Float Name=\"{0}\" NameSpace=\"Standard\"><Unit>{4}</Unit><pValue>{0}Register</pValue><Min>{2}</Min>"
      "<Max>{3}</Max></Float>\n"
      "<FloatReg Name=\"{0}Register\">{1}<Cachable>NoCache</Cachable><Endianess>{5}</Endianess></FloatReg>\n",
      name, register_body(address, 8, access), least, most, unit, order_);
}

std::string Nodes::boolean(const char* name, uint32_t address) const {
  return fmt::format(
             "<Boolean Name=\"{0}\" NameSpace=\"Standard\"><pValue>{0}Register</pValue><OnValue>1</OnValue>"
             "<OffValue>0</OffValue></Boolean>\n",
             name) +
         integer_register(register_name(name).c_str(), address, 4, "RW");
}

std::string Nodes::command(const char* name, uint32_t address, int value) const {
  return fmt::format(
             "<Command Name=\"{0}\" NameSpace=\"Standard\"><pValue>{0}Register</pValue>"
             "<CommandValue>{1}</CommandValue></Command>\n",
             name, value) +
         integer_register(register_name(name).c_str(), address, 4, "WO");
}

std::string Nodes::enumeration(const char* name, uint32_t address, Entries entries, const char* access) const {
  std::string result = fmt::format("<Enumeration Name=\"{}\" NameSpace=\"Standard\">", name);
  for (const auto& [entry, value] : entries)
    result += fmt::format("<EnumEntry Name=\"{}\"><Value>{}</Value></EnumEntry>", entry, value);
  result += fmt::format("<pValue>{}Register</pValue></Enumeration>\n", name);
  return result + integer_register(register_name(name).c_str(), address, 4, access);
}

std::string Nodes::masked_integer(const char* name, uint32_t address, int lsb, int msb,
                                  const std::string& bounds) const {
  return fmt::format(
      "<MaskedIntReg Name=\"{0}Register\">{1}<Cachable>NoCache</Cachable><LSB>{2}</LSB><MSB>{3}</MSB>"
      "<Sign>Unsigned</Sign><Endianess>{4}</Endianess></MaskedIntReg>\n"
      "<Integer Name=\"{0}\"><pValue>{0}Register</pValue>{5}</Integer>\n",
      name, register_body(address, 4, "RW"), lsb, msb, order_, bounds);
}

std::string Nodes::masked_command(const char* name, uint32_t address, int bit) const {
  return fmt::format(
      "<MaskedIntReg Name=\"{0}Register\">{1}<Cachable>NoCache</Cachable><Bit>{2}</Bit><Sign>Unsigned</Sign>"
      "<Endianess>{3}</Endianess></MaskedIntReg>\n"
      "<Command Name=\"{0}\"><pValue>{0}Register</pValue><CommandValue>1</CommandValue></Command>\n",
      name, register_body(address, 4, "RW"), bit, order_);
}

}  // namespace selvedge::sim
