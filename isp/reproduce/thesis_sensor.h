#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "capture/synthetic/photon_rows.h"
#include "isp/base/matrix3.h"
#include "isp/base/result.h"
#include "isp/base/sensor.h"
#include "isp/model/colour/chromaticity_cloud.h"

namespace lowlux::isp {

inline constexpr double thesis_volt_per_e = 2e-4;     // G_Ve, Table 4-1
inline constexpr double thesis_dn_per_volt = 141.67;  // G, Table 4-1

/// Gives the etendue that Qe in e- m2 sr per photon implies where no area of a pixel is stated, as in the thesis.
inline constexpr double published_etendue_m2_sr = 1;

/// The image sensor of the thesis' chapter 4 and the colour transform it computes.
struct ThesisCamera {
  SensorModel sensor;         // Table 4-1: a Sony DXC-930 like sensor at 20 C
  SpectralResponse response;  // Qe with peak 1; a perfect white under D65 at 100 cd/m2 fills the best channel
  double exposure_s = 1;
  Matrix3 dn_to_xyz;  // Eq. 4.14, XYZ with Y in cd/m2
  double condition_number = 0;
};

/// Returns the camera. Errors: the sensitivities yield no matrix.
Result<ThesisCamera> thesis_camera();

/// Returns a light scaled to F = 1, 100 cd/m2 [W m-2 sr-1 nm-1]; nullopt if it has no luminance.
std::optional<Spectrum> at_full_level(const Spectrum& light);

/// Returns the mean charge that a radiance generates in R, G and B [e-]: exposure * etendue * integral of photons * Qe.
/// @param radiance  [W m-2 sr-1 nm-1], of a light
Vector3 signal_charge_e(const ThesisCamera& camera, const Spectrum& radiance);

/// A colour in front of the camera at F = 1, where Y = 100 cd/m2.
struct Patch {
  std::string name;   // reflectance under lamp
  Spectrum radiance;  // [W m-2 sr-1 nm-1]
  Xy xy;              // chromaticity of the radiance
  Vector3 signal_e;   // mean charge in R, G, B
};

/// Returns colours that span the gamut: of the 24 patches of the SFU Macbeth chart under the 25 SFU laboratory lamps
/// (600 spectra, standing in for the thesis' own 598, which are not public), the one farthest from equal-energy white
/// in xy, then always the one farthest from all chosen before. So the first 13 of 20 are those of a selection of 13.
Result<std::vector<Patch>> thesis_patches(const ThesisCamera& camera, int count);

inline constexpr int scenario_i_patches = 20;
inline constexpr int scenario_ii_patches = 13;  // also of scenario III

/// Returns the mean dark charge of one exposure [e-].
Vector3 dark_charge_e(const ThesisCamera& camera);

/// Returns the mean code without quantisation and saturation, as XYZ: the expectation of a measurement.
Xyz xyz_of_charge(const ThesisCamera& camera, const Vector3& charge_e);

/// Returns the first-order cloud of the measured chromaticity, for channels of independent noise.
/// @param variance_e2  variance of each channel
std::optional<ChromaticityCloud> sensor_cloud(const ThesisCamera& camera, const Vector3& mean_e,
                                              const Vector3& variance_e2);

/// Selects the noises that are simulated.
struct Noises {
  bool dark = false;
  bool read = false;
  bool converter = false;  // full well, quantisation and the ends of the code range
  Quantisation quantisation = Quantisation::floor;
  // Published sampling draws the same photons for all three channels: the thesis' camera has three sensors.
  capture::PhotonSampling sampling = capture::PhotonSampling::physical;
};

/// Samples of one patch at one level.
struct PatchSamples {
  std::vector<Vector3> dn;  // codes of unsaturated samples
  int saturated = 0;        // number of samples with a channel that may be full: they have no colour, and are left out
};

/// Identifies samples: their random numbers depend on this alone.
struct PatchPlace {
  std::uint64_t seed = 0;
  std::uint32_t frame = 0;  // one for each level and combination of noises
  std::uint32_t patch = 0;
};

/// Photographs a patch under `level` times its light. Charges above the exact sampler's limit, poisson_max_mean, have
/// poisson_count() for their distribution; read noise and converter are off then.
PatchSamples photograph(const ThesisCamera& camera, const Patch& patch, double level, const Noises& noises,
                        const PatchPlace& place, int samples);

/// Returns the chromaticities of samples, one each; those without one (X + Y + Z <= 0) are left out.
std::vector<Xy> chromaticities(const ThesisCamera& camera, const std::vector<Vector3>& dn);

/// Returns the mean of codes; nullopt without samples.
std::optional<Vector3> mean_code(const std::vector<Vector3>& dn);

/// Returns the distance in the chromaticity plane in just noticeable differences: three of MacAdam's standard
/// deviations, those of the ellipse whose centre is nearest to `from`, in the direction of `to`.
double noticeable_differences(const Xy& from, const Xy& to);

}  // namespace lowlux::isp
