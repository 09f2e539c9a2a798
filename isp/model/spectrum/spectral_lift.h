#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "isp/base/matrix3.h"
#include "isp/base/sensor.h"
#include "isp/base/spectrum.h"
#include "isp/model/colour/colorimetry.h"

namespace lowlux::isp {

// A colour contains little information about its spectrum. The lift returns the spectrum of largest entropy among all
// with the colour's chromaticity: the smoothest estimate, positive everywhere. With S = xbar + ybar + zbar it is
//     p(nm) = exp(a (xbar - x S) + b (ybar - y S)) / normalisation,
// which is the largest-entropy spectrum for f = (xbar, ybar, zbar) at the total power where entropy is largest: two
// multipliers instead of three, and no estimate of the power. Its smoothing weight gamma is 1e-6.

/// Lifted spectra have these nodes: 380, 385 ... 780 nm.
inline constexpr int lift_nodes = 81;
constexpr double lift_wavelength_nm(int i) { return 380.0 + 5.0 * i; }

/// Returns the spectral radiance [W m-2 sr-1 nm-1] of a colour [cd/m2]; nullopt if it has no chromaticity or one that
/// no light can have (outside of, or within 2 % of, the spectral locus: see liftable).
std::optional<Spectrum> lift(const Xyz& colour_cd_m2);

/// Returns the nearest chromaticity on the way to the equal-energy white that can be lifted; the argument itself if it
/// can.
Xy liftable(const Xy& xy);

/// Returns the excitation purity (CIE S 017) relative to the equal-energy white: 0 there, 1 on the spectral
/// locus and the line of purples, more where no light is.
double excitation_purity(const Xy& xy);

/// Tabulates a sensor's response to lifted colours, as a bilinear table over xy with steps of 1/128: electrons per
/// second in a pixel of R, G, B per cd/m2 of X + Y + Z. It is exactly linear in xy for a sensor whose sensitivities are
/// sums of colour-matching functions, and nearly so for real ones.
class LiftTable {
 public:
  explicit LiftTable(const SpectralResponse& response);

  /// Returns the electrons per second of one channel for X + Y + Z = 1 at a liftable chromaticity.
  float response(int channel, float x, float y) const;
  /// Returns the multipliers a, b of the spectrum at a liftable chromaticity.
  std::array<float, 2> multipliers(float x, float y) const;

  static constexpr float steps_per_unit = 128;
  static constexpr int columns = 98;  // x in 0..0.75
  static constexpr int rows = 111;    // y in 0..0.85

 private:
  struct Node {
    std::array<float, 3> response;
    std::array<float, 2> multipliers;
  };
  std::vector<Node> nodes_;  // rows x columns
};

/// Returns the lifted radiance at its nodes [W m-2 sr-1 nm-1] of a colour [cd/m2], by the table's multipliers; 0 for
/// black.
std::array<float, lift_nodes> lifted_power(const LiftTable& table, const Xyz& colour_cd_m2);

}  // namespace lowlux::isp
