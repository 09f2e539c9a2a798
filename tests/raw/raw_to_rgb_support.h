#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "isp/base/cfa.h"
#include "isp/base/plane.h"
#include "isp/raw/kernel/raw_to_rgb.h"
#include "tests/reference/raw_to_rgb_ref.h"

/// What the tests of RawToRgb share: random frames in rows that are longer than the picture, and a transform.
namespace lowlux::raw_to_rgb_testing {

inline constexpr BayerPhase all_phases[] = {BayerPhase::rggb, BayerPhase::grbg, BayerPhase::gbrg, BayerPhase::bggr};

/// width x height samples inside longer rows; `guard` fills what lies outside.
template <class T>
struct Strided {
  int width;
  int height;
  int stride;
  std::vector<T> memory;

  Strided(int w, int h, int extra, T guard)
      : width(w), height(h), stride(w + extra), memory(static_cast<std::size_t>(w + extra) * h, guard) {}
  PlaneView<T> view() { return {memory.data(), width, height, stride}; }
  PlaneView<const T> view() const { return {memory.data(), width, height, stride}; }
};

/// Fractional black levels and different gains at every site.
inline isp::SiteLevels uneven_levels() {
  return {{510.5f, 512.25f, 511.0f, 514.75f}, {2.0f / 15000, 1.0f / 15000, 1.01f / 15000, 1.6f / 15000}};
}

inline isp::RgbTransform typical_transform(bool move = true) {
  return {
      {1.70f, -0.60f, -0.10f, -0.20f, 1.55f, -0.35f, 0.02f, -0.52f, 1.50f}, {0.2126f, 0.7152f, 0.0722f}, 1.0f, move};
}

/// DN from below black to above white.
inline Strided<std::uint16_t> random_dn(int width, int height, unsigned seed) {
  Strided<std::uint16_t> out(width, height, 5, 65535);
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> dn(300, 17000);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) out.view().at(x, y) = static_cast<std::uint16_t>(dn(random));
  }
  return out;
}

/// Values from -0.3 to 1.5.
inline Strided<float> random_signed(int width, int height, unsigned seed) {
  Strided<float> out(width, height, 3, 1e6f);
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> value(-0.3f, 1.5f);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) out.view().at(x, y) = value(random);
  }
  return out;
}

/// The reference picture, before tone, row by row.
template <class Mosaic>
std::vector<reference::Rgb> reference_picture(const Mosaic& in, const isp::RgbTransform& transform) {
  const reference::LinearisedMosaic mosaic = reference::linearised(in);
  std::vector<reference::Rgb> out;
  for (int y = 0; y < mosaic.height; ++y) {
    for (int x = 0; x < mosaic.width; ++x) {
      out.push_back(reference::transformed(reference::malvar(mosaic, x, y), transform));
    }
  }
  return out;
}

}  // namespace lowlux::raw_to_rgb_testing
