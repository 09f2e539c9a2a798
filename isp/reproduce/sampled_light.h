#pragma once

#include <cstdint>
#include <vector>

#include "isp/base/random/random.h"
#include "isp/base/result.h"
#include "isp/model/sensor/photon.h"
#include "isp/output/report/report.h"

namespace lowlux::isp {

/// These are the first frames of random numbers of the experiments: level l of an experiment is frame first + l.
inline constexpr std::uint32_t frames_of_few_photons = 0x000;
inline constexpr std::uint32_t frames_of_clouds_i = 0x100;
inline constexpr std::uint32_t frames_of_clouds_ii = 0x200;
inline constexpr std::uint32_t frames_of_flashes = 0x300;
inline constexpr std::uint32_t frames_of_sensor = 0x400;
inline constexpr std::uint32_t frames_of_checker = 0x500;

/// Returns a Poisson count of a mean >= 0: exact up to poisson_max_mean, above it the nearest integer to a normal
/// deviate of equal mean and variance, whose skewness is off by less than 1e-3.
double poisson_count(const DrawStream& stream, std::uint32_t x, std::uint32_t y, double mean);

/// Identifies a draw of photons; each is independent of all others.
struct DrawPlace {
  std::uint64_t seed = 0;
  std::uint32_t frame = 0;
  std::uint32_t source = 0;
  std::uint32_t sample = 0;
};

/// Returns counts of the bins of `means`, drawn for each wavelength.
std::vector<double> draw_photons(const PhotonMeans& means, const DrawPlace& place);

/// Returns the levels of the thesis' section 3: 1 W down to 6e-15 W.
std::vector<double> photon_levels_w();

inline constexpr double photon_exposure_s = 0.2;  // from the thesis' section 3

/// Returns the spectral locus as a series of a chromaticity diagram, closed by the line of purples.
Series spectral_locus();

}  // namespace lowlux::isp
