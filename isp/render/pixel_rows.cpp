#include "isp/render/pixel_rows.h"

#include <cmath>
#include <cstddef>

#if defined(__aarch64__)  // NEON only, as everywhere
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#endif
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isp/render/pixel_rows.cpp"
#include <hwy/foreach_target.h>  // compiles this file once more for each instruction set
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace lowlux::isp::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Sixteen pixels are processed at once in 32 bits: weighted sums of three channels, rounded, shifted by `shift` bits.
using Pixels = hn::FixedTag<std::uint8_t, 16>;
using Quads = hn::CappedTag<std::int32_t, 8>;

template <int kShift>
HWY_INLINE void weigh(const std::int32_t (&channel)[3][16], const std::int32_t* weight, std::int32_t base,
                      std::uint8_t* out) {
  const Quads d;
  const hn::Rebind<std::uint8_t, Quads> narrow;
  for (std::size_t i = 0; i < 16; i += hn::Lanes(d)) {
    auto sum = hn::Set(d, (base << kShift) + (1 << (kShift - 1)));
    for (int c = 0; c < 3; ++c) {
      sum = hn::Add(sum, hn::Mul(hn::Set(d, weight[c]), hn::LoadU(d, channel[c] + i)));
    }
    hn::StoreU(hn::DemoteTo(narrow, hn::ShiftRight<kShift>(sum)), narrow, out + i);
  }
}

HWY_INLINE void widen(const std::uint8_t* from, std::int32_t* to) {
  const Quads d;
  const hn::Rebind<std::uint8_t, Quads> narrow;
  for (std::size_t i = 0; i < 16; i += hn::Lanes(d))
    hn::StoreU(hn::PromoteTo(d, hn::LoadU(narrow, from + i)), d, to + i);
}

std::uint8_t one(const std::int32_t* weight, const std::int32_t* rgb, std::int32_t base, int shift) {
  std::int32_t sum = (base << shift) + (1 << (shift - 1));
  for (int c = 0; c < 3; ++c) sum += weight[c] * rgb[c];
  return static_cast<std::uint8_t>(sum >> shift);
}

void LumaRow(const YuvMatrix& matrix, const std::uint8_t* rgb, int width, std::uint8_t* out) {
  const Pixels d;
  int x = 0;
  for (; x + 16 <= width; x += 16) {
    hn::Vec<Pixels> r, g, b;
    hn::LoadInterleaved3(d, rgb + 3 * static_cast<std::ptrdiff_t>(x), r, g, b);
    alignas(16) std::uint8_t bytes[3][16];
    hn::Store(r, d, bytes[0]);
    hn::Store(g, d, bytes[1]);
    hn::Store(b, d, bytes[2]);
    std::int32_t channel[3][16];
    for (int c = 0; c < 3; ++c) widen(bytes[c], channel[c]);
    weigh<16>(channel, matrix.luma.data(), 16, out + x);
  }
  for (; x < width; ++x) {
    const std::uint8_t* const p = rgb + 3 * static_cast<std::ptrdiff_t>(x);
    const std::int32_t pixel[3] = {p[0], p[1], p[2]};
    out[x] = one(matrix.luma.data(), pixel, 16, 16);
  }
}

/// Adds the sums of two neighbours of both rows, for 32 pixels.
HWY_INLINE void add_pairs(const std::uint8_t (&above)[32], const std::uint8_t (&below)[32], std::int32_t* to) {
  const hn::CappedTag<std::uint16_t, 8> w;
  const hn::Repartition<std::uint8_t, decltype(w)> b;
  const hn::Repartition<std::int32_t, decltype(w)> d;
  const auto low = hn::Set(w, 0xFF);
  for (std::size_t i = 0; i < 16; i += hn::Lanes(w)) {
    const auto upper = hn::BitCast(w, hn::LoadU(b, above + 2 * i)), lower = hn::BitCast(w, hn::LoadU(b, below + 2 * i));
    const auto pairs = hn::Add(hn::Add(hn::And(upper, low), hn::ShiftRight<8>(upper)),
                               hn::Add(hn::And(lower, low), hn::ShiftRight<8>(lower)));
    hn::StoreU(hn::PromoteTo(d, hn::LowerHalf(pairs)), d, to + i);
    hn::StoreU(hn::PromoteTo(d, hn::UpperHalf(hn::Half<decltype(w)>(), pairs)), d, to + i + hn::Lanes(d));
  }
}

HWY_INLINE void split(const std::uint8_t* rgb, std::uint8_t (&channel)[3][32]) {
  const Pixels d;
  for (int part = 0; part < 32; part += 16) {
    hn::Vec<Pixels> r, g, b;
    hn::LoadInterleaved3(d, rgb + 3 * part, r, g, b);
    hn::StoreU(r, d, channel[0] + part);
    hn::StoreU(g, d, channel[1] + part);
    hn::StoreU(b, d, channel[2] + part);
  }
}

void ChromaRow(const YuvMatrix& matrix, const std::uint8_t* rgb, const std::uint8_t* below, int width,
               std::uint8_t* out) {
  int x = 0;
  for (; x + 32 <= width; x += 32) {
    std::uint8_t upper[3][32], lower[3][32];
    split(rgb + 3 * static_cast<std::ptrdiff_t>(x), upper);
    split(below + 3 * static_cast<std::ptrdiff_t>(x), lower);
    std::int32_t sums[3][16];
    for (int c = 0; c < 3; ++c) add_pairs(upper[c], lower[c], sums[c]);
    alignas(16) std::uint8_t blue[16], red[16];
    weigh<18>(sums, matrix.blue.data(), 128, blue);
    weigh<18>(sums, matrix.red.data(), 128, red);
    const Pixels d;
    hn::StoreInterleaved2(hn::Load(d, blue), hn::Load(d, red), d, out + x);
  }
  for (; x < width; x += 2) {
    const std::ptrdiff_t left = 3 * static_cast<std::ptrdiff_t>(x), right = x + 1 < width ? left + 3 : left;
    std::int32_t sum[3];
    for (int c = 0; c < 3; ++c) sum[c] = rgb[left + c] + rgb[right + c] + below[left + c] + below[right + c];
    out[x] = one(matrix.blue.data(), sum, 128, 18);
    out[x + 1] = one(matrix.red.data(), sum, 128, 18);
  }
}

}  // namespace lowlux::isp::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lowlux::isp {
HWY_EXPORT(LumaRow);
HWY_EXPORT(ChromaRow);

namespace {

/// Returns the rows of a matrix in integers that add up exactly, so that greys stay grey.
std::array<std::int32_t, 3> scaled(const std::array<double, 3>& weight, double range, std::int32_t sum) {
  std::array<std::int32_t, 3> out{};
  for (int c = 0; c < 3; ++c) out[c] = static_cast<std::int32_t>(std::lround(weight[c] * range / 255 * 65536));
  out[1] += sum - (out[0] + out[1] + out[2]);
  return out;
}

}  // namespace

YuvMatrix yuv_matrix(YuvStandard standard) {
  const bool hd = standard == YuvStandard::bt709;
  const double kr = hd ? 0.2126 : 0.299, kb = hd ? 0.0722 : 0.114, kg = 1 - kr - kb;
  const double b = 0.5 / (1 - kb), r = 0.5 / (1 - kr);
  const auto white = static_cast<std::int32_t>(std::lround(219.0 / 255 * 65536));
  return {scaled({kr, kg, kb}, 219, white), scaled({-kr * b, -kg * b, 0.5}, 224, 0),
          scaled({0.5, -kg * r, -kb * r}, 224, 0)};
}

void luma_row(const YuvMatrix& matrix, const std::uint8_t* rgb, int width, std::uint8_t* out) {
  HWY_DYNAMIC_DISPATCH(LumaRow)(matrix, rgb, width, out);
}
void chroma_row(const YuvMatrix& matrix, const std::uint8_t* rgb, const std::uint8_t* below, int width,
                std::uint8_t* out) {
  HWY_DYNAMIC_DISPATCH(ChromaRow)(matrix, rgb, below, width, out);
}

}  // namespace lowlux::isp
#endif
