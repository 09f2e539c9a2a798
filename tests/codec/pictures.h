#pragma once

#include <gtest/gtest.h>
#include <sys/types.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <random>
#include <span>
#include <vector>

#include "isp/base/image.h"
#include "isp/base/result.h"

namespace lowlux::test {

/// A smooth picture with a little noise, as codes of any width.
template <class Code>
Encoded<Code> noisy_codes(int width, int height, unsigned seed = 1) {
  std::mt19937 random(seed);
  Encoded<Code> picture{Plane<Code>(3 * width, height)};
  const double top = static_cast<Code>(-1);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < 3 * width; ++x) {
      const int pixel = x / 3;
      const double smooth = 0.5 + 0.3 * std::sin(0.02 * pixel + x % 3) * std::cos(0.03 * y);
      const double noise = 0.02 * (static_cast<double>(random()) / 4294967295.0 - 0.5);
      picture.codes.at(x, y) = static_cast<Code>(top * (smooth + noise));
    }
  }
  return picture;
}

/// Signed values on both sides of 0..1.
inline SceneLinear noisy_linear(int width, int height, unsigned seed = 1) {
  std::mt19937 random(seed);
  SceneLinear picture(width, height);
  for (auto& plane : picture.plane) {
    for (std::size_t i = 0; i < plane.size(); ++i) {
      plane.data()[i] = static_cast<float>(static_cast<double>(random()) / 2147483648.0 - 0.5);
    }
  }
  return picture;
}

template <class T>
bool same_bits(const Plane<T>& a, const Plane<T>& b) {
  return a.width() == b.width() && a.height() == b.height() &&
         std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0;
}

template <class Code>
bool same_bits(const Encoded<Code>& a, const Encoded<Code>& b) {
  return same_bits(a.codes, b.codes);
}

inline bool same_bits(const SceneLinear& a, const SceneLinear& b) {
  return same_bits(a.plane[0], b.plane[0]) && same_bits(a.plane[1], b.plane[1]) && same_bits(a.plane[2], b.plane[2]);
}

/// Peak signal-to-noise ratio of 8-bit codes, dB.
inline double psnr_db(const Encoded8& a, const Encoded8& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.codes.size(); ++i) {
    const double d = static_cast<double>(a.codes.data()[i]) - b.codes.data()[i];
    sum += d * d;
  }
  return 10 * std::log10(255.0 * 255.0 * static_cast<double>(a.codes.size()) / sum);
}

/// All bytes of an open file.
inline std::vector<std::byte> contents(std::FILE* file) {
  std::fflush(file);
  std::fseek(file, 0, SEEK_END);
  std::vector<std::byte> bytes(static_cast<std::size_t>(std::ftell(file)));
  std::rewind(file);
  if (std::fread(bytes.data(), 1, bytes.size(), file) != bytes.size()) bytes.clear();
  return bytes;
}

/// What encode(file) writes; empty if it fails.
template <class Encode>
std::vector<std::byte> encoded(const Encode& encode) {
  std::FILE* file = std::tmpfile();
  std::vector<std::byte> bytes;
  if (encode(file)) bytes = contents(file);
  std::fclose(file);
  return bytes;
}

/// A disk that takes `room` bytes and no more.
struct SmallDisk {
  std::size_t room = 0;
  std::vector<char> bytes;
  std::size_t place = 0;

  static ssize_t write(void* cookie, const char* data, std::size_t size) {
    auto& disk = *static_cast<SmallDisk*>(cookie);
    if (disk.place + size > disk.room) {
      errno = ENOSPC;
      return 0;
    }
    if (disk.bytes.size() < disk.place + size) disk.bytes.resize(disk.place + size);
    std::memcpy(disk.bytes.data() + disk.place, data, size);
    disk.place += size;
    return static_cast<ssize_t>(size);
  }
  static ssize_t read(void* cookie, char* data, std::size_t size) {
    auto& disk = *static_cast<SmallDisk*>(cookie);
    const std::size_t count = std::min(size, disk.bytes.size() - std::min(disk.bytes.size(), disk.place));
    if (count > 0) std::memcpy(data, disk.bytes.data() + disk.place, count);
    disk.place += count;
    return static_cast<ssize_t>(count);
  }
  static int seek(void* cookie, off64_t* offset, int whence) {
    auto& disk = *static_cast<SmallDisk*>(cookie);
    const std::size_t base = whence == SEEK_SET ? 0 : whence == SEEK_CUR ? disk.place : disk.bytes.size();
    disk.place = base + static_cast<std::size_t>(*offset);
    *offset = static_cast<off64_t>(disk.place);
    return 0;
  }
};

/// What encode(file) and a flush say on a disk with `room` bytes.
template <class Encode>
Result<void> encode_to_small_disk(std::size_t room, const Encode& encode) {
  SmallDisk disk{room, {}, 0};
  std::FILE* file = fopencookie(&disk, "w+", {SmallDisk::read, SmallDisk::write, SmallDisk::seek, nullptr});
  Result<void> written = encode(file);
  if (written && std::fflush(file) != 0) written = fail(ErrorCode::unwritable, "the disk is full");
  std::fclose(file);
  return written;
}

/// Encodes to disks that are full after any part of the file, and to one that just holds it.
template <class Encode>
void expect_full_disks_are_reported(const Encode& encode) {
  const std::size_t size = encoded(encode).size();
  ASSERT_GT(size, 0U);
  for (const double part : {0.0, 0.001, 0.01, 0.1, 0.5, 0.9, 0.99, 0.999}) {
    const auto room = static_cast<std::size_t>(part * static_cast<double>(size));
    const auto written = encode_to_small_disk(room, encode);
    ASSERT_FALSE(written) << room << " of " << size;
    EXPECT_EQ(written.error().code, ErrorCode::unwritable);
    EXPECT_EQ(written.error().message, "the disk is full") << room << " of " << size;
  }
  EXPECT_FALSE(encode_to_small_disk(size - 1, encode));
  EXPECT_TRUE(encode_to_small_disk(size, encode));
}

inline std::vector<std::byte> bytes_of(std::span<const unsigned char> codes) {
  const auto bytes = std::as_bytes(codes);
  return {bytes.begin(), bytes.end()};
}

/// The smallest ICC profile a reader that checks the header accepts: an RGB display profile without tags
/// (ICC.1:2022 7.2), plus `padding` bytes that hardly compress: libpng refuses an iCCP chunk below 81 bytes.
inline std::vector<std::byte> bare_icc_profile(std::size_t padding = 0) {
  std::vector<unsigned char> p(132 + padding, 0);
  for (std::size_t i = 132; i < p.size(); ++i) p[i] = static_cast<unsigned char>(i * i * 31);
  for (int i = 0; i < 4; ++i) p[i] = static_cast<unsigned char>(p.size() >> (24 - 8 * i));
  const auto put = [&](std::size_t at, const char* text) { std::memcpy(&p[at], text, 4); };
  p[8] = 4;
  put(12, "mntr");
  put(16, "RGB ");
  put(20, "XYZ ");
  put(36, "acsp");
  const std::array<unsigned char, 12> d50{0, 0, 0xF6, 0xD6, 0, 1, 0, 0, 0, 0, 0xD3, 0x2D};
  std::memcpy(&p[68], d50.data(), d50.size());
  return bytes_of(p);
}

/// A TIFF header with an empty directory: the smallest EXIF block.
inline std::vector<std::byte> bare_exif() {
  return bytes_of(std::array<unsigned char, 14>{'I', 'I', 42, 0, 8, 0, 0, 0, 0, 0, 0, 0, 0, 0});
}

}  // namespace lowlux::test
