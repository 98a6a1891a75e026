#include "rig/bus_signature.h"

#include <cstring>
#include <stdexcept>

#include <openssl/core_names.h>
#include <openssl/crypto.h>
#include <openssl/evp.h>
#include <openssl/params.h>

namespace selvedge::rig {

namespace {

constexpr char kMagic[] = {'S', 'L', 'V', '1'};
constexpr size_t kMacBytes = BusSignature::kTrailerBytes - sizeof kMagic;
constexpr size_t kSha256Bytes = 32;

using Context = std::unique_ptr<EVP_MAC_CTX, void (*)(EVP_MAC_CTX*)>;

void require(bool done) {
  if (!done) throw std::runtime_error("bus: OpenSSL cannot compute HMAC-SHA256");
}

Context context_for(const BusKey& key) {
  const std::unique_ptr<EVP_MAC, void (*)(EVP_MAC*)> hmac(EVP_MAC_fetch(nullptr, "HMAC", nullptr), EVP_MAC_free);
  require(hmac != nullptr);
  Context context(EVP_MAC_CTX_new(hmac.get()), EVP_MAC_CTX_free);
  char digest[] = "SHA256";
  const OSSL_PARAM parameters[] = {OSSL_PARAM_construct_utf8_string(OSSL_MAC_PARAM_DIGEST, digest, 0),
                                   OSSL_PARAM_construct_end()};
  require(context != nullptr && EVP_MAC_init(context.get(), key.data(), key.size(), parameters) == 1);
  return context;
}

}  // namespace

BusSignature::BusSignature(const BusKey& key) : keyed_(context_for(key)) {}

// A copy of the context that has taken in the key: threads share that one, and the key is hashed once.
void BusSignature::mac(std::string_view channel, const uint8_t* message, size_t size, uint8_t* first_16) const {
  const Context context(EVP_MAC_CTX_dup(keyed_.get()), EVP_MAC_CTX_free);
  require(context != nullptr);
  const uint8_t zero = 0;
  uint8_t whole[kSha256Bytes];
  size_t written = 0;
  require(EVP_MAC_update(context.get(), reinterpret_cast<const uint8_t*>(channel.data()), channel.size()) == 1 &&
          EVP_MAC_update(context.get(), &zero, 1) == 1 && EVP_MAC_update(context.get(), message, size) == 1 &&
          EVP_MAC_final(context.get(), whole, &written, sizeof whole) == 1 && written == sizeof whole);
  std::memcpy(first_16, whole, kMacBytes);
}

void BusSignature::sign(std::string_view channel, std::vector<uint8_t>& message) const {
  uint8_t first_16[kMacBytes];
  mac(channel, message.data(), message.size(), first_16);
  message.insert(message.end(), std::begin(kMagic), std::end(kMagic));
  message.insert(message.end(), std::begin(first_16), std::end(first_16));
}

bool BusSignature::holds(std::string_view channel, const uint8_t* bytes, size_t size) const {
  if (!ends_in_trailer(bytes, size)) return false;
  uint8_t expected[kMacBytes];
  mac(channel, bytes, size - kTrailerBytes, expected);
  return CRYPTO_memcmp(expected, bytes + size - kMacBytes, kMacBytes) == 0;
}

bool ends_in_trailer(const uint8_t* bytes, size_t size) {
  return size >= BusSignature::kTrailerBytes &&
         std::memcmp(bytes + size - BusSignature::kTrailerBytes, kMagic, sizeof kMagic) == 0;
}

}  // namespace selvedge::rig
