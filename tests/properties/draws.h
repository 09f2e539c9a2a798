#pragma once

#include <rapidcheck.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

#include "isp/base/cfa.h"
#include "isp/base/plane.h"

/// What properties are drawn from. Sizes and seeds shrink; what fills a frame is drawn from its seed.
namespace lowlux::properties {

inline int size_between(int least, int most) { return *rc::gen::inRange(least, most + 1); }
/// First to last, both included, in steps of a thousandth of it.
inline double any_between(double first, double last) {
  return first + (last - first) * *rc::gen::inRange(0, 1001) / 1000;
}
/// 10^first to 10^last, evenly over the decades.
inline double any_decade(double first, double last) { return std::pow(10, any_between(first, last)); }
inline BayerPhase any_phase() { return static_cast<BayerPhase>(*rc::gen::inRange(0, 4)); }
inline std::mt19937 any_random() { return std::mt19937(*rc::gen::arbitrary<std::uint32_t>()); }

/// Values within low..high; one in `one_in` is none or beyond any picture, if that is not 0.
inline Plane<float> any_plane(int width, int height, float low, float high, int one_in = 0) {
  constexpr float inf = std::numeric_limits<float>::infinity();
  constexpr std::array odd{std::numeric_limits<float>::quiet_NaN(), inf, -inf, 1e30F, -1e30F, 1e-42F};
  auto random = any_random();
  std::uniform_real_distribution<float> value(low, high);
  Plane<float> out(width, height);
  for (std::size_t i = 0; i < out.size(); ++i) {
    const bool is_odd = one_in > 0 && random() % static_cast<unsigned>(one_in) == 0;
    out.data()[i] = is_odd ? odd[random() % odd.size()] : value(random);
  }
  return out;
}

/// Codes 0..most.
inline Plane<std::uint16_t> any_codes(int width, int height, int most) {
  auto random = any_random();
  Plane<std::uint16_t> out(width, height);
  for (std::size_t i = 0; i < out.size(); ++i) {
    out.data()[i] = static_cast<std::uint16_t>(random() % static_cast<unsigned>(most + 1));
  }
  return out;
}

template <class T>
Plane<T> mirrored(const Plane<T>& in) {
  Plane<T> out(in.width(), in.height());
  for (int y = 0; y < in.height(); ++y) {
    for (int x = 0; x < in.width(); ++x) out.at(x, y) = in.at(in.width() - 1 - x, y);
  }
  return out;
}

/// The phase that a mosaic so wide has once it is mirrored left to right.
inline BayerPhase mirrored(BayerPhase phase, int width) { return phase_of_crop(phase, width - 1, 0); }

inline double largest_difference(const Plane<float>& a, const Plane<float>& b) {
  double worst = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    worst = std::fmax(worst, std::abs(static_cast<double>(a.data()[i]) - static_cast<double>(b.data()[i])));
  }
  return worst;
}

inline bool all_finite(const Plane<float>& plane) {
  for (std::size_t i = 0; i < plane.size(); ++i) {
    if (!std::isfinite(plane.data()[i])) return false;
  }
  return true;
}

}  // namespace lowlux::properties
