#include "base/frame.h"

#include <openssl/evp.h>

#include <array>
#include <vector>

#include "base/ensure.h"
#include "base/sha256.h"

namespace opaline {

std::string sha256_hex(std::span<const std::byte> bytes) {
  std::array<unsigned char, 32> digest{};
  unsigned int size = 0;
  ENSURE(EVP_Digest(bytes.data(), bytes.size(), digest.data(), &size, EVP_sha256(), nullptr) == 1);
  constexpr const char* kDigits = "0123456789abcdef";
  std::string hex;
  for (const unsigned char byte : digest) {
    hex += kDigits[byte >> 4];
    hex += kDigits[byte & 15];
  }
  return hex;
}

std::string frame_hash(const Image<std::uint16_t>& pixels) {
  std::vector<std::byte> bytes;
  bytes.reserve(12 + pixels.samples().size() * 2);
  for (const int value : {pixels.width(), pixels.height(), pixels.channels()}) {
    for (int shift = 0; shift < 32; shift += 8)
      bytes.push_back(static_cast<std::byte>(value >> shift));
  }
  for (const std::uint16_t sample : pixels.samples()) {
    bytes.push_back(static_cast<std::byte>(sample & 255));
    bytes.push_back(static_cast<std::byte>(sample >> 8));
  }
  return sha256_hex(bytes);
}

}  // namespace opaline
