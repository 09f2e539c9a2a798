#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <string>
#include <vector>

#include "capture/file/dng_source.h"
#include "tests/support/dng/dng_builder.h"
#include "tests/support/error_words.h"

namespace lowlux::test {

inline Result<RawFrame> read_bytes(const std::vector<std::byte>& bytes, const capture::ReadLimits& limits = {}) {
  return capture::read_raw(bytes, "built.dng", limits);
}

/// The frame of a file that must be readable; an empty frame, and a failed test, if it is not.
inline RawFrame read_built(const DngBuilder& dng) {
  auto frame = read_bytes(dng.build());
  if (frame) return *std::move(frame);
  ADD_FAILURE() << frame.error().message;
  return {};
}

/// The error of a file that must be refused. Errors are one line, name the file, and do not end with a full stop.
inline Error refused(const std::vector<std::byte>& bytes, const capture::ReadLimits& limits = {}) {
  const auto frame = read_bytes(bytes, limits);
  if (frame) {
    ADD_FAILURE() << "the file was accepted";
    return {};
  }
  EXPECT_EQ(frame.error().where, "built.dng");
  EXPECT_EQ(frame.error().message.find('\n'), std::string::npos);
  EXPECT_FALSE(frame.error().message.empty() || frame.error().message.back() == '.');
  return frame.error();
}

inline Error refused(const DngBuilder& dng, const capture::ReadLimits& limits = {}) {
  return refused(dng.build(), limits);
}

/// The warning of a file that must be readable with its samples, and have no other.
inline std::string warned(const DngBuilder& dng) {
  const RawFrame frame = read_built(dng);
  EXPECT_EQ(frame.raw.dn.size(), ramp(dng).size());
  EXPECT_EQ(frame.warnings.size(), 1u);
  return frame.warnings.empty() ? "" : frame.warnings.front();
}

/// Samples of a frame, row after row.
inline std::vector<std::uint16_t> samples_of(const RawFrame& frame) {
  const Plane<std::uint16_t>& dn = frame.raw.dn;
  return {dn.data(), dn.data() + dn.size()};
}

}  // namespace lowlux::test
