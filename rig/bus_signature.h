// The trailer that says a message comes from a process which knows the key.
//
//   message | "SLV1" | the first 16 bytes of HMAC-SHA256(key, channel | 0 | message)
//
// It lies behind the message, where LCM's decoders do not look: logs of the bus stay readable to everything that reads
// LCM. It does not say when a message was sent: one that is sent again is as true as it was.
// Source: RFC 2104 (shortened as its section 5 allows); OpenSSL 3's EVP_MAC.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include "rig/bus_key.h"

struct evp_mac_ctx_st;  // OpenSSL's EVP_MAC_CTX

namespace selvedge::rig {

class BusSignature {
 public:
  static constexpr size_t kTrailerBytes = 20;

  explicit BusSignature(const BusKey& key);

  // Puts the trailer behind the message. From any thread.
  void sign(std::string_view channel, std::vector<uint8_t>& message) const;
  // Whether the bytes end in the trailer that sign() would have put there; takes as long for a wrong one. From any
  // thread.
  bool holds(std::string_view channel, const uint8_t* bytes, size_t size) const;

 private:
  void mac(std::string_view channel, const uint8_t* message, size_t size, uint8_t* first_16) const;

  std::unique_ptr<evp_mac_ctx_st, void (*)(evp_mac_ctx_st*)> keyed_;
};

// Whether bytes end in a trailer, true or not.
bool ends_in_trailer(const uint8_t* bytes, size_t size);

}  // namespace selvedge::rig
