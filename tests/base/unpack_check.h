#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <random>
#include <span>
#include <vector>

#include "isp/base/packed/raw_format.h"
#include "tests/reference/unpack_ref.h"
#include "tests/support/guarded_memory.h"

namespace lowlux::unpack_testing {

inline const char* name_of(const RawFormat& format) {
  return names_of(format)->libcamera.empty() ? "a format of V4L2 alone" : names_of(format)->libcamera.data();
}

/// Formats that differ in more than the order of their colours.
inline std::vector<RawFormat> layouts() {
  std::vector<RawFormat> out;
  for (const RawFormatNames& names : raw_formats()) {
    if (names.format.phase == BayerPhase::rggb) out.push_back(names.format);
  }
  return out;
}

/// Every remainder of groups and vectors, both sides of the kernels' pieces of 800, and common sensors.
inline std::vector<int> widths() {
  std::vector<int> out;
  for (int width = 1; width <= 70; ++width) out.push_back(width);
  for (const int width : {775, 799, 800, 801, 824, 1601, 1640, 3280, 4056}) out.push_back(width);
  return out;
}

inline void fill_at_random(std::span<std::byte> bytes, std::minstd_rand& random) {
  for (std::byte& byte : bytes) byte = static_cast<std::byte>(random() >> 8);
}

/// First column that differs from the reference; width: none.
inline int first_difference(const RawFormat& format, const std::byte* row, int width, const std::uint16_t* codes) {
  int x = 0;
  while (x < width && codes[x] == reference::unpacked_code(format, row, x)) ++x;
  return x;
}

/// Any bytes, in rows that begin and end where memory does, as do those of codes.
inline void expect_reference_between_guards(const RawFormat& format, const std::vector<int>& some_widths) {
  const int widest = *std::max_element(some_widths.begin(), some_widths.end());
  const test::GuardedMemory in(row_bytes(format, widest)), out(sizeof(std::uint16_t) * widest);
  std::minstd_rand random(7);
  for (const int width : some_widths) {
    const std::size_t in_bytes = row_bytes(format, width), out_bytes = sizeof(std::uint16_t) * width;
    for (const bool at_end : {false, true}) {
      const auto row = at_end ? in.last(in_bytes) : in.first(in_bytes);
      auto* const codes =
          reinterpret_cast<std::uint16_t*>((at_end ? out.last(out_bytes) : out.first(out_bytes)).data());
      fill_at_random(row, random);
      unpack_row(format, row.data(), width, codes);
      ASSERT_EQ(first_difference(format, row.data(), width, codes), width) << name_of(format) << ", width " << width;
    }
  }
}

}  // namespace lowlux::unpack_testing
