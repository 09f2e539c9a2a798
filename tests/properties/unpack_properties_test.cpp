#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "isp/base/packed/raw_format.h"
#include "tests/adapter/stage_frames.h"
#include "tests/properties/draws.h"

namespace lowlux {
namespace {

using namespace properties;

const RawFormatNames& any_format() {
  const auto formats = raw_formats();
  return formats[static_cast<std::size_t>(*rc::gen::inRange(0, static_cast<int>(formats.size())))];
}

/// Unpacked from a copy that ends where the row does, so many bytes beyond an address that is aligned.
std::vector<std::uint16_t> unpacked(const RawFormat& format, const std::vector<std::byte>& row, int width, int shift) {
  std::vector<std::byte> moved(static_cast<std::size_t>(shift));
  moved.insert(moved.end(), row.begin(), row.begin() + static_cast<std::ptrdiff_t>(row_bytes(format, width)));
  std::vector<std::uint16_t> out(static_cast<std::size_t>(width));
  unpack_row(format, moved.data() + shift, width, out.data());
  return out;
}

RC_GTEST_PROP(UnpackProperty, WhatIsPackedComesBackFromAnyAddress, ()) {
  const RawFormat& format = any_format().format;
  const int width = size_between(1, 700);
  const auto codes = any_codes(width, 1, largest_code(format));
  const auto row = stage_testing::packed_row(format, codes.data(), width);
  RC_ASSERT(row.size() == row_bytes(format, width));
  const auto whole = unpacked(format, row, width, size_between(0, 15));
  RC_ASSERT(std::equal(whole.begin(), whole.end(), codes.data()));
  const int narrower = size_between(1, width);
  const auto first = unpacked(format, row, narrower, 0);
  RC_ASSERT(std::equal(first.begin(), first.end(), codes.data()));
}

RC_GTEST_PROP(RawFormatProperty, NamesLeadBackToTheirFormat, ()) {
  const RawFormatNames& names = any_format();
  RC_ASSERT(names.v4l2_fourcc == 0 || raw_format_of_v4l2(names.v4l2_fourcc) == names.format);
  RC_ASSERT(names.drm_fourcc == 0 || raw_format_of_drm(names.drm_fourcc, names.drm_modifier) == names.format);
  const int width = size_between(1, 70000);
  const RawGroup group = group_of(names.format);
  const auto groups = static_cast<std::size_t>((width + group.pixels - 1) / group.pixels);
  RC_ASSERT(row_bytes(names.format, width) == groups * static_cast<std::size_t>(group.bytes));
}

}  // namespace
}  // namespace lowlux
