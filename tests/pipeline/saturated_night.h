#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <random>

#include "tests/pipeline/merge/merge_bursts.h"

/// Nights of sensors that saturate below the white level that their files state.
namespace lowlux::test {

inline constexpr Rect sign{32, 32, 48, 48};

/// A sensor that saturates at a level that scatters.
struct Saturation {
  double level_dn = 0;
  double scatter_dn = 0;

  static Saturation draw(unsigned seed) {
    std::mt19937 random(seed);
    return {std::uniform_real_distribution<double>(0.78, 0.97)(random) * night_white_dn,
            seed % 3 == 0 ? 0 : std::uniform_real_distribution<double>(1, 25)(random)};
  }

  void limit(RawFrame& frame, int index) const {
    std::mt19937 random(static_cast<unsigned>(index + 1));
    std::normal_distribution<double> normal(level_dn, scatter_dn);
    for (std::size_t i = 0; i < frame.raw.dn.size(); ++i) {
      std::uint16_t& dn = frame.raw.dn.data()[i];
      const double level = normal(random);
      if (dn >= level) dn = static_cast<std::uint16_t>(std::lround(level));
    }
  }
};

/// A night of lamps with the glare of a lens around them, and an evenly lit sign.
/// @param sign_e  light of the sign
inline Burst saturated_night(const Saturation& saturation, const std::array<double, 3>& sign_e) {
  Burst burst{.width = 320, .height = 240};
  burst.scene = [sign_e](double x, double y, int colour) {
    const auto c = static_cast<std::size_t>(colour);
    if (x >= sign.x && x < sign.x + sign.width && y >= sign.y && y < sign.y + sign.height) return sign_e[c];
    double sum = 30 * std::array{0.5, 1.0, 0.4}[c];
    for (int lamp = 0; lamp < 8; ++lamp) {
      const double distance = std::hypot(x - 120 - 50 * (lamp % 4), y - 60 - 110 * (lamp / 4)) / 6;
      const std::array light{lamp % 3 == 0 ? 1.5 : 0.6, 1.0, lamp % 2 == 0 ? 0.2 : 0.7};
      sum += 60000 * light[c] * std::pow(1 + distance * distance, -1.5);
    }
    return sum;
  };
  burst.disturb = [saturation](RawFrame& frame, int index) { saturation.limit(frame, index); };
  return burst;
}

}  // namespace lowlux::test
