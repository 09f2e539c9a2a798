#pragma once

#include <cstdint>

#include "denoise/picture/resaturate.h"
#include "tests/denoise/draws.h"

namespace lowlux::test {

/// A patch as it truly is: signal on top of dark, the same number of pixels in every plane.
struct TruePatch {
  Vector3 signal_e{};
  double dark_e = 0;
  double noise_std_e = 1.5;
  double pixels = 1;
};

inline TruePatch true_patch(const Vector3& colour, double signal_e, double dark_e, double pixels) {
  TruePatch patch{.dark_e = dark_e, .pixels = pixels};
  for (int k = 0; k < 3; ++k) patch.signal_e[k] = colour[k] * signal_e;
  return patch;
}

/// What is measured of it, once: the mean of N pixels is (Poisson(N lambda) + Normal(0, N sigma^2)) / N.
inline denoise::PatchMean measured_patch(const TruePatch& truth, std::uint32_t seed, std::uint32_t draw) {
  denoise::PatchMean out;
  out.noise_std_e = truth.noise_std_e;
  for (std::uint32_t k = 0; k < 3; ++k) {
    const double n = truth.pixels;
    out.charge_e[k] =
        noisy_charge_e(seed, draw, k, n * (truth.signal_e[k] + truth.dark_e), std::sqrt(n) * truth.noise_std_e) / n;
    out.dark_e[k] = truth.dark_e;
    out.pixels[k] = n;
  }
  return out;
}

}  // namespace lowlux::test
