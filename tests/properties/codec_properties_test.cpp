#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <utility>
#include <variant>

#include "isp/base/executor.h"
#include "isp/codec/exr.h"
#include "isp/codec/jpeg.h"
#include "isp/codec/pfm.h"
#include "isp/codec/png.h"
#include "isp/codec/tiff.h"
#include "tests/codec/pictures.h"
#include "tests/properties/draws.h"

namespace lowlux::isp {
namespace {

using namespace properties;

/// Codes without any order, or all the same: what compresses worst and best.
template <class Code>
Encoded<Code> any_picture() {
  auto random = any_random();
  const bool even = *rc::gen::arbitrary<bool>();
  Encoded<Code> out{Plane<Code>(3 * size_between(1, 90), size_between(1, 60))};
  const auto first = static_cast<Code>(random());
  for (std::size_t i = 0; i < out.codes.size(); ++i) out.codes.data()[i] = even ? first : static_cast<Code>(random());
  return out;
}

/// @param one_in  values that are none, as any_plane has them
SceneLinear any_linear(float low, float high, int one_in) {
  const int width = size_between(1, 90), height = size_between(1, 60);
  SceneLinear out(width, height);
  for (auto& plane : out.plane) plane = any_plane(width, height, low, high, one_in);
  return out;
}

template <class Code>
void comes_back_as_png() {
  const auto picture = any_picture<Code>();
  const auto written_by = [&](Executor& executor) {
    return test::encoded([&](std::FILE* file) { return encode_png(picture, {}, executor, file).has_value(); });
  };
  InlineExecutor one;
  PoolExecutor three(3);
  const auto bytes = written_by(one);
  RC_ASSERT(bytes == written_by(three));
  const auto read = decode_png(bytes);
  RC_ASSERT(read.has_value());
  RC_ASSERT(test::same_bits(std::get<Encoded<Code>>(read->picture), picture));
}

RC_GTEST_PROP(PngProperty, CodesComeBackAndAnyThreadsWriteTheSame, ()) {
  comes_back_as_png<std::uint8_t>();
  comes_back_as_png<std::uint16_t>();
}

template <class Kind>
void comes_back_as_tiff(Kind picture) {
  const TiffOptions options{*rc::gen::element(TiffOptions::Compression::none, TiffOptions::Compression::deflate)};
  const Picture given = std::move(picture);
  const auto bytes = test::encoded([&](std::FILE* file) { return encode_tiff(given, {}, options, file).has_value(); });
  const auto read = decode_tiff(bytes);
  RC_ASSERT(read.has_value());
  RC_ASSERT(test::same_bits(std::get<Kind>(read->picture), std::get<Kind>(given)));
}

RC_GTEST_PROP(TiffProperty, EveryKindOfSampleComesBack, ()) {
  comes_back_as_tiff(any_picture<std::uint8_t>());
  comes_back_as_tiff(any_picture<std::uint16_t>());
  comes_back_as_tiff(any_linear(-10, 1e6F, 9));
}

RC_GTEST_PROP(PfmProperty, EveryFloatComesBack, ()) {
  const SceneLinear picture = any_linear(-10, 1e6F, 9);
  const auto bytes = test::encoded([&](std::FILE* file) { return encode_pfm(picture, file).has_value(); });
  const auto read = decode_pfm(bytes);
  RC_ASSERT(read.has_value());
  RC_ASSERT(test::same_bits(std::get<SceneLinear>(read->picture), picture));
}

Result<DecodedPicture> by_exr(const SceneLinear& picture, ExrOptions::Depth depth) {
  const ExrOptions options{depth, *rc::gen::element(ExrOptions::Compression::none, ExrOptions::Compression::piz)};
  return decode_exr(test::encoded([&](std::FILE* file) { return encode_exr(picture, {}, options, file).has_value(); }));
}

RC_GTEST_PROP(ExrProperty, FullDepthKeepsEveryFloatAndHalfElevenBits, ()) {
  const SceneLinear any = any_linear(-10, 1e6F, 9);
  const auto full = by_exr(any, ExrOptions::Depth::full);
  RC_ASSERT(full.has_value());
  RC_ASSERT(test::same_bits(std::get<SceneLinear>(full->picture), any));
  const float top = *rc::gen::element(1e-3F, 1.0F, 1e5F);
  const SceneLinear picture = any_linear(-top, top, 0);
  const auto half = by_exr(picture, ExrOptions::Depth::half);
  RC_ASSERT(half.has_value());
  const auto& read = std::get<SceneLinear>(half->picture);
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < picture.plane[c].size(); ++i) {
      const float held = std::clamp(picture.plane[c].data()[i], -65504.0F, 65504.0F);
      // Half a step of 2^-10, and of 2^-24 where numbers are below 2^-14.
      const float step = std::fmax(std::abs(held) * 0x1p-11F, 0x1p-25F);
      RC_ASSERT(std::abs(read.plane[c].data()[i] - held) <= step);
    }
  }
}

// The least coefficient of an even block is a step of the quantiser, at 92 of 3 for an eighth of a code: 0.2 of a code,
// 0.4 in a colour of its own, and rounded three times.
RC_GTEST_PROP(JpegProperty, AnEvenColourStaysWithinTwoCodes, ()) {
  Encoded8 picture{Plane<std::uint8_t>(3 * size_between(1, 90), size_between(1, 60))};
  std::array<std::uint8_t, 3> colour{};
  for (std::uint8_t& code : colour) code = static_cast<std::uint8_t>(*rc::gen::inRange(0, 256));
  for (std::size_t i = 0; i < picture.codes.size(); ++i) picture.codes.data()[i] = colour[i % 3];
  const JpegOptions options{.quality = size_between(92, 100),
                            .chroma = *rc::gen::element(JpegOptions::Chroma::full, JpegOptions::Chroma::half)};
  const auto bytes =
      test::encoded([&](std::FILE* file) { return encode_jpeg(picture, {}, options, file).has_value(); });
  const auto read = decode_jpeg(bytes);
  RC_ASSERT(read.has_value());
  const auto& codes = std::get<Encoded8>(read->picture).codes;
  RC_ASSERT(codes.width() == picture.codes.width() && codes.height() == picture.codes.height());
  for (std::size_t i = 0; i < codes.size(); ++i) RC_ASSERT(std::abs(codes.data()[i] - colour[i % 3]) <= 2);
}

}  // namespace
}  // namespace lowlux::isp
