// SHA-256 of bytes, as `sha256sum` prints it. Source: FIPS 180-4; OpenSSL's EVP_Digest.
#pragma once

#include <string>

namespace selvedge::files {

// 64 hexadecimal digits. Throws std::runtime_error where OpenSSL cannot.
std::string sha256_hex(const std::string& bytes);

}  // namespace selvedge::files
