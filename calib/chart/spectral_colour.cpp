#include "calib/chart/spectral_colour.h"

#include <algorithm>
#include <cstddef>
#include <span>
#include <utility>

#include "calib/chart/colour_fit.h"
#include "isp/model/colour/camera_matrix.h"
#include "isp/model/spectrum/cie_data.h"
#include "isp/model/spectrum/spectral_data.h"

namespace lowlux::calib {
namespace {

std::vector<ColourSample> photographed(const std::array<Spectrum, 3>& sensitivity, const Spectrum& light,
                                       std::span<const Spectrum> reflectances) {
  std::vector<ColourSample> out;
  out.reserve(reflectances.size());
  for (const Spectrum& reflectance : reflectances) {
    out.push_back({isp::camera_response(sensitivity, light, reflectance),
                   isp::xyz_of_reflectance(reflectance, light).value_or(isp::Xyz{})});
  }
  return out;
}

Result<RatedMatrix> rated(const Matrix3& camera_to_xyz, double condition_number, std::span<const ColourSample> samples,
                          const isp::Xyz& white) {
  const ColourFitOptions options{.white = white, .uneven_light = false};
  const auto scaled = scaled_to_chart(camera_to_xyz, samples, options);
  if (!scaled) return tl::make_unexpected(scaled.error());
  RatedMatrix out{scaled->camera_to_xyz, condition_number, colour_errors(*scaled, samples, white), {}};
  out.patch_xyz.resize(samples.size());
  std::transform(samples.begin(), samples.end(), out.patch_xyz.begin(),
                 [&](const ColourSample& sample) { return predicted(*scaled, sample); });
  return out;
}

/// Returns the sensitivities of Eq. 4.15 as printed: it divides by the wavelength although the energy of a photon
/// requires a multiplication.
std::array<Spectrum, 3> as_printed(const std::array<Spectrum, 3>& sensitivity) {
  const auto change = [](double nm, double value) { return value * (550 / nm) * (550 / nm); };
  return {sensitivity[0].mapped(change), sensitivity[1].mapped(change), sensitivity[2].mapped(change)};
}

}  // namespace

Result<SpectralColour> spectral_colour(const std::array<Spectrum, 3>& sensitivity, const Spectrum& light) {
  SpectralColour out;
  const auto calibration = isp::fit_calibration(sensitivity, light, isp::ForwardMatrix::fit);
  if (!calibration) return tl::make_unexpected(calibration.error());
  out.calibration = *calibration;
  const isp::Xyz sum = isp::xyz_of(light);
  out.white = {sum.x / sum.y, 1, sum.z / sum.y};
  const auto reference = chart_reference(light);
  if (!reference) return tl::make_unexpected(reference.error());
  out.reference = *reference;

  const auto printed = isp::spectral_matrix(as_printed(sensitivity));
  if (!printed) return tl::make_unexpected(printed.error());
  const auto corrected = isp::spectral_matrix(sensitivity);
  if (!corrected) return tl::make_unexpected(corrected.error());
  const auto to_xyz = inverse(out.calibration.xyz_to_camera);
  if (!to_xyz) return fail(ErrorCode::insufficient, "the colour matrix fitted to the sensitivities is singular");

  std::vector<Spectrum> patches;
  patches.reserve(24);
  for (isp::NamedSpectrum& patch : isp::spectra_of(isp::SpectrumSet::colorchecker)) {
    patches.push_back(std::move(patch.spectrum));
  }
  const auto chart = photographed(sensitivity, light, patches);
  const auto training = photographed(sensitivity, light, isp::training_reflectances());
  const auto rate = [&](RatedMatrix& to, const Matrix3& matrix, double condition) -> Result<void> {
    auto result = rated(matrix, condition, chart, out.white);
    if (!result) return tl::make_unexpected(result.error());
    to = *std::move(result);
    return {};
  };
  if (auto done = rate(out.printed, printed->camera_to_xyz, printed->condition_number); !done) {
    return tl::make_unexpected(done.error());
  }
  if (auto done = rate(out.corrected, corrected->camera_to_xyz, corrected->condition_number); !done) {
    return tl::make_unexpected(done.error());
  }
  if (auto done = rate(out.fitted, *to_xyz, corrected->condition_number); !done) {
    return tl::make_unexpected(done.error());
  }
  const auto trained = rated(*to_xyz, corrected->condition_number, training, out.white);
  if (!trained) return tl::make_unexpected(trained.error());
  out.training_ciede2000 = summary_of(trained->ciede2000).mean;
  return out;
}

}  // namespace lowlux::calib
