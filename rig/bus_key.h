// The secret that the processes of one user on one host share, so that the bus believes no other's messages.
//
// 32 random bytes in a file of mode 600. Whichever process comes first makes it; of several at once, one does and the
// others take what it made: the file appears under its name whole (link(2) of a file made with O_EXCL).
// Randomness: getrandom(2).
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>

namespace selvedge::rig {

using BusKey = std::array<uint8_t, 32>;

// Reads the key, and makes it where there is no such file. Throws BadInput with the file's name where it cannot be
// made or read, is no plain file, belongs to another user, may be reached by others, or has another size.
BusKey shared_bus_key(const std::filesystem::path& file);

}  // namespace selvedge::rig
