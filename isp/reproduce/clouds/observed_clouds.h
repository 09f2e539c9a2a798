#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "isp/base/result.h"
#include "isp/base/spectrum.h"
#include "isp/model/colour/chromaticity_cloud.h"
#include "isp/model/spectrum/spectral_data.h"

namespace lowlux::isp {

/// Holds three functions by which an observer finds X, Y and Z of radiant power.
struct Observer {
  std::string name;
  std::array<Spectrum, 3> xyz;
};

/// Returns the observer of CIE 1931.
Observer standard_observer();

/// Returns an observer who finds X, Y and Z from the responses of cones (thesis Eq. 3.9, 3.10): by the 3x3 matrix for
/// which sums of the cones are nearest to the CIE 1931 functions, by least squares at 380, 385 ... 780 nm.
Observer cone_observer(ConeSet cones);

/// Returns the three functions at the nodes 380, 385 ... 780 nm as the sums of `from` that are nearest to `to` by least
/// squares. Precondition: the functions of `from` are linearly independent.
std::array<Spectrum, 3> nearest_sums(const std::array<Spectrum, 3>& from, const std::array<Spectrum, 3>& to);

/// Returns the cloud of an observer who counts photons, to first order; as predicted_cloud() for the CIE 1931 observer.
/// @return nullopt if no photon reaches a wavelength the observer sees
std::optional<ChromaticityCloud> predicted_cloud_by(const Observer& observer, const PhotonMeans& means);

/// Holds the samples of one colour at one level.
struct Cloud {
  double power_w = 0;
  std::vector<Xy> samples;
  ChromaticityCloud sampled;
  ChromaticityCloud predicted;  // to first order
};

/// Holds a colour and its light.
struct Colour {
  std::string name;
  Spectrum light;
  std::vector<Cloud> clouds;  // by level, brightest first
};

/// Identifies the draws of colours: the photons of colour c at level l are the same for equal places.
struct CloudDraws {
  std::uint64_t seed = 0;
  std::uint32_t first_frame = 0;
  std::uint32_t samples = 0;
};

/// Samples the clouds of all colours at the levels of photon_levels_w(). Errors: a light without power, one that the
/// observer sees by fewer than two photons.
Result<void> sample_colours(std::vector<Colour>& colours, const Observer& observer, const CloudDraws& draws);

/// Returns the reflectances of a set under a light, without clouds.
std::vector<Colour> colours_under(const Spectrum& light, SpectrumSet set);

}  // namespace lowlux::isp
