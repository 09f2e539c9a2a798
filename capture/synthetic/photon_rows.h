#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "capture/synthetic/scene.h"
#include "isp/base/cfa.h"
#include "isp/base/executor.h"
#include "isp/base/sensor.h"
#include "isp/model/spectrum/spectral_lift.h"

namespace lowlux::capture {

/// Model of photon sampling: physical (Poisson(mu), one draw for each pixel), or wavelength by wavelength as published
/// in the thesis (see PhotonRows).
enum class PhotonSampling : std::uint8_t { physical, published };

/// Samples photons by wavelength, as published in the thesis (Eq. 4.4 to 4.6): X_i ~ Poisson(x_i) photons fall on a
/// pixel in bin i, and sum X_i Qe_k(i) electrons are collected. The mean is right, the variance is sum x_i Qe_k(i)^2
/// instead of sum x_i Qe_k(i): too small, because each photon contributes a fraction of an electron. Provided to
/// reproduce the thesis; it needs about a hundred draws for each pixel instead of one.
class PhotonRows {
 public:
  /// @param table          table of the response; may be null for a scene of patches
  /// @param masked_columns dark columns of the sensor left of the scene
  PhotonRows(const Scene& scene, const SpectralResponse& response, const isp::LiftTable* table, BayerPhase phase,
             int masked_columns);

  /// Returns the largest mean of any pixel and bin [photons per s]: collect() is correct up to the sampler's limit.
  double largest_mean_per_s(Executor& executor) const;

  /// Computes the charge of the pixels (x0 + i, y) of the sensor in `time_s` [e-], fractions included.
  void collect(std::uint64_t seed, std::uint32_t frame, int x0, int y, double time_s, std::span<float> charge_e) const;

 private:
  /// Contribution of one bin of wavelengths: photons per second, and electrons per photon in R, G, B.
  struct Bin {
    float photons_per_s;
    std::array<float, 3> efficiency;
  };
  void collect_patch(const std::vector<Bin>& bins, std::uint64_t seed, std::uint32_t frame, int x0, int y,
                     double time_s, std::span<float> charge_e) const;
  void collect_lifted(std::uint64_t seed, std::uint32_t frame, int x0, int y, double time_s,
                      std::span<float> charge_e) const;
  std::array<float, isp::lift_nodes> power_at(int x, int y) const;

  const Scene& scene_;
  const isp::LiftTable* table_;
  BayerPhase phase_;
  int masked_columns_;
  std::vector<std::vector<Bin>> patches_;
  std::vector<Bin> lifted_;  // for a radiance of 1 W m-2 sr-1 nm-1
};

}  // namespace lowlux::capture
