// The Python example of docs/devices.md, run as it stands there: a lab's own program that follows it is heard.
#include <cstdlib>

#include <gtest/gtest.h>

#include "files/whole_file.h"
#include "rig/bus_signature.h"
#include "rig/runtime_folder.h"
#include "tests/rig/raw_lcm.h"
#include "tests/rig/temporary_folder.h"

namespace selvedge::rig {
namespace {

std::string python_example() {
  const std::string text = files::read_whole(SELVEDGE_SOURCE_DIR "/docs/devices.md"), opening = "```python\n";
  const size_t start = text.find(opening) + opening.size();
  return text.substr(start, text.find("```", start) - start);
}

TEST(BusDocumentation, PythonExampleSignsAndChecksAsWeDo) {
  const TemporaryFolder folder;
  for (const char* name : {"XDG_RUNTIME_DIR", "RUNTIME_DIRECTORY"}) {  // the second goes before the first
    ::setenv(name, (folder.path() / name).c_str(), 1);
    std::filesystem::create_directory(folder.path() / name);
    const BusKey key = shared_bus_key(runtime_folder() / "bus.key");
    std::vector<uint8_t> message = {'h', 'e', 'l', 'l', 'o'};
    BusSignature(key).sign(kChannel, message);
    std::string hex;
    for (const uint8_t byte : message) hex += fmt::format("{:02x}", byte);
    files::write_whole(folder.path() / "example.py",
                       python_example() + fmt::format("own = signed('{0}', b'hello')\n"
                                                      "assert own.hex() == '{1}', own.hex()\n"
                                                      "assert is_true('{0}', own)\n"
                                                      "assert not is_true('{0}', own[:-1])\n"
                                                      "assert not is_true('ARM_STATUS', own)\n",
                                                      kChannel, hex));
    EXPECT_EQ(std::system(("/usr/bin/python3 " + (folder.path() / "example.py").string()).c_str()), 0) << name;
  }
}

}  // namespace
}  // namespace selvedge::rig
