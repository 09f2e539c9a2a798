#include "isp/cli/dataset/sha256.h"

#include <algorithm>
#include <bit>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <vector>

#include <fmt/format.h>

namespace lowlux::cli {
namespace {

/// Returns the constants of FIPS 180-4, section 4.2.2: the first 32 bits of the fractional parts of the cube roots of
/// the first 64 primes p, as the largest r with r^3 <= p 2^96, modulo 2^32.
constexpr std::array<std::uint32_t, 64> round_constants() {
  std::array<std::uint32_t, 64> constants{};
  std::uint32_t p = 2;
  for (std::uint32_t& constant : constants) {
    std::uint64_t root = 0;  // below 2^35, as the primes end at 311
    for (int bit = 34; bit >= 0; --bit) {
      const std::uint64_t r = root | (std::uint64_t{1} << bit);
      // r^3 in three words of 32 bits: r^2 is below 2^70, its words are `low` and `high`.
      const std::uint64_t a = r & 0xffffffff, b = r >> 32;
      const std::uint64_t w0 = a * a, w1 = 2 * a * b + (w0 >> 32), w2 = b * b + (w1 >> 32);
      const std::array<std::uint64_t, 3> square{w0 & 0xffffffff, w1 & 0xffffffff, w2};
      const std::uint64_t c0 = square[0] * a;
      const std::uint64_t c1 = (c0 >> 32) + (square[1] * a & 0xffffffff) + square[0] * b;
      const std::uint64_t c2 = (c1 >> 32) + (square[1] * a >> 32) + (square[2] * a & 0xffffffff) + square[1] * b;
      const std::uint64_t c3 = (c2 >> 32) + (square[2] * a >> 32) + square[2] * b;
      const bool exact = c3 == p && ((c2 | c1 | c0) & 0xffffffff) == 0;
      if (c3 < p || exact) root = r;
    }
    constant = static_cast<std::uint32_t>(root);
    bool prime = false;
    while (!prime) {
      ++p;
      prime = true;
      for (std::uint32_t d = 2; d * d <= p; ++d) prime = prime && p % d != 0;
    }
  }
  return constants;
}

constexpr std::array<std::uint32_t, 64> k = round_constants();
static_assert(k[0] == 0x428a2f98 && k[63] == 0xc67178f2);

std::string hex_of(std::span<const unsigned char> bytes) {
  std::string text;
  for (const unsigned char byte : bytes) text += fmt::format("{:02x}", byte);
  return text;
}

}  // namespace

void Sha256::add_block(const unsigned char* block) {
  std::array<std::uint32_t, 64> w{};
  for (std::size_t t = 0; t < 64; ++t) {
    if (t < 16) {
      const unsigned char* b = block + 4 * t;
      w[t] = std::uint32_t{b[0]} << 24 | std::uint32_t{b[1]} << 16 | std::uint32_t{b[2]} << 8 | b[3];
      continue;
    }
    const std::uint32_t x = w[t - 15], y = w[t - 2];
    w[t] = w[t - 16] + w[t - 7] + (std::rotr(x, 7) ^ std::rotr(x, 18) ^ x >> 3) +
           (std::rotr(y, 17) ^ std::rotr(y, 19) ^ y >> 10);
  }
  auto [a, b, c, d, e, f, g, h] = state_;
  for (std::size_t t = 0; t < 64; ++t) {
    const std::uint32_t t1 =
        h + (std::rotr(e, 6) ^ std::rotr(e, 11) ^ std::rotr(e, 25)) + ((e & f) ^ (~e & g)) + k[t] + w[t];
    const std::uint32_t t2 = (std::rotr(a, 2) ^ std::rotr(a, 13) ^ std::rotr(a, 22)) + ((a & b) ^ (a & c) ^ (b & c));
    h = g, g = f, f = e, e = d + t1, d = c, c = b, b = a, a = t1 + t2;
  }
  const std::array<std::uint32_t, 8> sum{a, b, c, d, e, f, g, h};
  for (std::size_t i = 0; i < 8; ++i) state_[i] += sum[i];
}

void Sha256::add(std::span<const unsigned char> bytes) {
  while (!bytes.empty()) {
    const std::size_t used = bytes_ % 64, count = std::min(64 - used, bytes.size());
    std::copy_n(bytes.begin(), count, block_.begin() + used);
    bytes_ += count;
    if (bytes_ % 64 == 0) add_block(block_.data());
    bytes = bytes.subspan(count);
  }
}

std::array<unsigned char, 32> Sha256::finish() {
  const std::uint64_t bits = 8 * bytes_;
  std::vector<unsigned char> padding((bytes_ % 64 < 56 ? 64 : 128) - bytes_ % 64, 0);
  padding.front() = 0x80;
  for (std::size_t i = 0; i < 8; ++i) padding[padding.size() - 1 - i] = static_cast<unsigned char>(bits >> 8 * i);
  add(padding);
  std::array<unsigned char, 32> hash{};
  for (std::size_t i = 0; i < 32; ++i) hash[i] = static_cast<unsigned char>(state_[i / 4] >> (24 - 8 * (i % 4)));
  return hash;
}

std::string sha256_of(std::string_view text) {
  Sha256 hash;
  hash.add({reinterpret_cast<const unsigned char*>(text.data()), text.size()});
  return hex_of(hash.finish());
}

Result<FileHash> sha256_of_file(const std::string& file) {
  std::error_code failed;
  if (!std::filesystem::exists(file, failed)) return fail(ErrorCode::not_found, "there is no such file", file);
  if (!std::filesystem::is_regular_file(file, failed)) return fail(ErrorCode::unreadable, "is not a file", file);
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> in(std::fopen(file.c_str(), "rb"), std::fclose);
  if (in == nullptr) return fail(ErrorCode::unreadable, "cannot be read: check its permissions", file);
  Sha256 hash;
  FileHash out;
  std::vector<unsigned char> part(std::size_t{1} << 16);
  while (const std::size_t count = std::fread(part.data(), 1, part.size(), in.get())) {
    hash.add(std::span(part).first(count));
    out.bytes += count;
  }
  if (std::ferror(in.get()) != 0) return fail(ErrorCode::unreadable, "cannot be read to its end", file);
  out.sha256 = hex_of(hash.finish());
  return out;
}

}  // namespace lowlux::cli
