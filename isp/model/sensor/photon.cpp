#include "isp/model/sensor/photon.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>

#include "isp/base/text.h"

namespace lowlux::isp {
namespace {

constexpr double metre_per_nm = 1e-9;

tl::unexpected<Error> bad_value(const char* what, double value, double wavelength_nm) {
  return fail(ErrorCode::invalid_argument, std::string(what) + " must not be negative, found " + number_text(value) +
                                               " at " + number_text(wavelength_nm) + " nm");
}

// Returns an error unless the spectrum is a possible light: wavelengths above 0, values not below. Spectrum::of ensures
// that all are finite.
std::optional<tl::unexpected<Error>> not_a_light(const Spectrum& spectrum, const char* what) {
  if (spectrum.wavelengths_nm().front() <= 0) {
    return fail(ErrorCode::invalid_argument, "the wavelengths of a light must be positive, found " +
                                                 number_text(spectrum.wavelengths_nm().front()) + " nm");
  }
  for (std::size_t i = 0; i < spectrum.size(); ++i) {
    if (spectrum.values()[i] < 0) return bad_value(what, spectrum.values()[i], spectrum.wavelengths_nm()[i]);
  }
  return std::nullopt;
}

Result<Spectrum> with_values(const Spectrum& like, std::vector<double> values) {
  return Spectrum::of({like.wavelengths_nm().begin(), like.wavelengths_nm().end()}, std::move(values));
}

}  // namespace

double photon_energy_j(double wavelength_nm) {
  assert(wavelength_nm > 0);
  return planck_j_s * light_speed_m_per_s / (wavelength_nm * metre_per_nm);
}

std::vector<double> bin_widths_nm(const Spectrum& spectrum) {
  const auto nm = spectrum.wavelengths_nm();
  std::vector<double> widths(nm.size());
  for (std::size_t i = 0; i < nm.size(); ++i) {
    const double below = nm[i == 0 ? 0 : i - 1];
    const double above = nm[std::min(i + 1, nm.size() - 1)];
    widths[i] = 0.5 * (above - below);
  }
  return widths;
}

Result<Spectrum> photon_radiance(const Spectrum& radiance) {
  if (const auto wrong = not_a_light(radiance, "a radiance")) return *wrong;
  std::vector<double> photons(radiance.size());
  for (std::size_t i = 0; i < photons.size(); ++i) {
    photons[i] = radiance.values()[i] / photon_energy_j(radiance.wavelengths_nm()[i]);
  }
  return with_values(radiance, std::move(photons));
}

Result<Spectrum> normalised(const Spectrum& power) {
  if (const auto wrong = not_a_light(power, "a spectral power")) return *wrong;
  const double largest = std::ranges::max(power.values());
  if (!(largest > 0)) return fail(ErrorCode::insufficient, "the power of a spectrum must not be 0 at all wavelengths");
  // The values are divided by the largest first: the integral of values near the limits of double would exceed them.
  std::vector<double> shares(power.values().begin(), power.values().end());
  for (double& share : shares) share /= largest;
  auto scaled = with_values(power, shares);
  if (!scaled) return scaled;
  const double total = integrate(*scaled);
  for (double& share : shares) share /= total;
  return with_values(power, std::move(shares));
}

Result<PhotonMeans> mean_photons(const Spectrum& power, double power_w, double exposure_s) {
  if (!(power_w >= 0) || !std::isfinite(power_w)) {
    return fail(ErrorCode::invalid_argument,
                "a power must be finite and not negative, found " + number_text(power_w) + " W");
  }
  if (!(exposure_s >= 0) || !std::isfinite(exposure_s)) {
    return fail(ErrorCode::invalid_argument,
                "an exposure must be finite and not negative, found " + number_text(exposure_s) + " s");
  }
  const Result<Spectrum> shares = normalised(power);
  if (!shares) return tl::make_unexpected(shares.error());
  PhotonMeans out{{shares->wavelengths_nm().begin(), shares->wavelengths_nm().end()}, bin_widths_nm(*shares), {}};
  for (std::size_t i = 0; i < shares->size(); ++i) {
    const double energy_j = power_w * exposure_s * shares->values()[i] * out.widths_nm[i];
    out.photons.push_back(energy_j / photon_energy_j(out.wavelengths_nm[i]));
    if (!std::isfinite(out.photons.back())) {
      return fail(ErrorCode::invalid_argument, "the photons of " + number_text(power_w) + " W in " +
                                                   number_text(exposure_s) + " s are too many photons to count");
    }
  }
  return out;
}

std::optional<Spectrum> estimated_spectrum(const PhotonMeans& means, std::span<const double> counts) {
  assert(counts.size() == means.wavelengths_nm.size());
  double total = 0;
  for (std::size_t i = 0; i < counts.size(); ++i) total += counts[i] / means.wavelengths_nm[i];
  if (!(total > 0)) return std::nullopt;
  std::vector<double> values(counts.size());
  for (std::size_t i = 0; i < counts.size(); ++i) {
    values[i] = counts[i] / means.wavelengths_nm[i] / (means.widths_nm[i] * total);
  }
  auto spectrum = Spectrum::of(means.wavelengths_nm, std::move(values));
  assert(spectrum && "counts are finite and bins come from a spectrum");
  return *std::move(spectrum);
}

double spectral_distance(const Spectrum& a, const Spectrum& b) {
  assert(std::ranges::equal(a.wavelengths_nm(), b.wavelengths_nm()));
  const std::vector<double> widths = bin_widths_nm(a);
  double sum = 0;
  for (std::size_t i = 0; i < widths.size(); ++i) {
    const double difference = a.values()[i] - b.values()[i];
    sum += widths[i] * difference * difference;
  }
  return std::sqrt(sum);
}

std::optional<double> expected_squared_distance(const PhotonMeans& means) {
  double total = 0, squares = 0;
  for (std::size_t i = 0; i < means.photons.size(); ++i) {
    const double weight = means.photons[i] / means.wavelengths_nm[i];
    total += weight;
    squares += weight / means.wavelengths_nm[i];
  }
  if (!(total > 0)) return std::nullopt;
  double sum = 0;
  for (std::size_t i = 0; i < means.photons.size(); ++i) {
    const double weight = means.photons[i] / means.wavelengths_nm[i];
    const double share = weight / total;
    const double variance =
        (weight / means.wavelengths_nm[i] * (1 - 2 * share) + share * share * squares) / total / total;
    sum += variance / means.widths_nm[i];
  }
  return sum;
}

}  // namespace lowlux::isp
