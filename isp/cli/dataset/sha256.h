#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "isp/base/result.h"

namespace lowlux::cli {

/// Computes SHA-256 (FIPS 180-4, section 6.2) of bytes that arrive in parts of any length.
class Sha256 {
 public:
  void add(std::span<const unsigned char> bytes);
  /// Returns the hash of all bytes. Call it once.
  std::array<unsigned char, 32> finish();

 private:
  void add_block(const unsigned char* block);

  std::array<std::uint32_t, 8> state_{0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a,
                                      0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};
  std::array<unsigned char, 64> block_{};
  std::uint64_t bytes_ = 0;
};

/// Returns the hash of a text as 64 hexadecimal digits.
std::string sha256_of(std::string_view text);

/// Holds size and hash of a file.
struct FileHash {
  std::uint64_t bytes = 0;
  std::string sha256;
};

/// Reads a file in parts and returns its hash. Errors: it is missing, no regular file, or cannot be read.
Result<FileHash> sha256_of_file(const std::string& file);

}  // namespace lowlux::cli
