#include "isp/reproduce/clouds/observed_clouds.h"

#include <cassert>
#include <cstddef>
#include <utility>

#include <fmt/format.h>

#include "isp/model/spectrum/cie_data.h"
#include "isp/reproduce/sampled_light.h"

namespace lowlux::isp {
namespace {

constexpr double energy_unit_j = 1e-19;  // keeps squares of photon energies far from the limits of double
constexpr int first_nm = 380, last_nm = 780, step_nm = 5;

/// Returns the XYZ of one photon of each bin, in units of 1e-19 J.
std::vector<Vector3> xyz_per_photon(const Observer& observer, const PhotonMeans& means) {
  std::vector<Vector3> out;
  out.reserve(means.wavelengths_nm.size());
  for (const double nm : means.wavelengths_nm) {
    const double energy = photon_energy_j(nm) / energy_unit_j;
    out.push_back({energy * observer.xyz[0].at(nm), energy * observer.xyz[1].at(nm), energy * observer.xyz[2].at(nm)});
  }
  return out;
}

Xyz xyz_of_counts(const std::vector<Vector3>& per_photon, const std::vector<double>& counts) {
  Vector3 sum{};
  for (std::size_t n = 0; n < counts.size(); ++n) {
    for (std::size_t i = 0; i < 3; ++i) sum[i] += counts[n] * per_photon[n][i];
  }
  return xyz_of(sum);
}

Result<Cloud> sample_cloud(const Colour& colour, const Observer& observer, double power_w, DrawPlace place,
                           std::uint32_t samples) {
  const auto means = mean_photons(colour.light, power_w, photon_exposure_s);
  if (!means) return tl::make_unexpected(means.error());
  const auto predicted = predicted_cloud_by(observer, *means);
  const std::vector<Vector3> per_photon = xyz_per_photon(observer, *means);
  Cloud out{power_w, {}, {}, predicted.value_or(ChromaticityCloud{})};
  for (place.sample = 0; place.sample < samples; ++place.sample) {
    if (const auto xy = xy_of(xyz_of_counts(per_photon, draw_photons(*means, place)))) out.samples.push_back(*xy);
  }
  const auto sampled = cloud_of(out.samples);
  if (!sampled || !predicted) {
    return fail(ErrorCode::insufficient, fmt::format("too few photons at {} W for a cloud of chromaticities", power_w));
  }
  out.sampled = *sampled;
  return out;
}

}  // namespace

Observer standard_observer() { return {"CIE 1931", cie_1931_observer()}; }

Observer cone_observer(ConeSet cones) {
  const bool smith_pokorny = cones == ConeSet::smith_pokorny_1975;
  return {smith_pokorny ? "Smith & Pokorny" : "Stockman & Sharpe",
          nearest_sums(cone_fundamentals(cones), cie_1931_observer())};
}

std::array<Spectrum, 3> nearest_sums(const std::array<Spectrum, 3>& from, const std::array<Spectrum, 3>& to) {
  std::vector<double> wavelengths_nm;
  Matrix3 squares{}, products{};
  for (int nm = first_nm; nm <= last_nm; nm += step_nm) {
    wavelengths_nm.push_back(nm);
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) {
        squares[i][j] += from[i].at(nm) * from[j].at(nm);
        products[i][j] += to[i].at(nm) * from[j].at(nm);
      }
    }
  }
  const auto inverted = inverse(squares);
  assert(inverted);
  const Matrix3 weights = products * *inverted;
  const Spectrum nodes = *resample(from[0], wavelengths_nm);
  const auto sum = [&](std::size_t i) {
    return nodes.mapped([&](double nm, double) {
      return dot(weights[i], {from[0].at(nm), from[1].at(nm), from[2].at(nm)});
    });
  };
  return {sum(0), sum(1), sum(2)};
}

std::optional<ChromaticityCloud> predicted_cloud_by(const Observer& observer, const PhotonMeans& means) {
  const std::vector<Vector3> per_photon = xyz_per_photon(observer, means);
  Matrix3 covariance{};
  for (std::size_t n = 0; n < per_photon.size(); ++n) {
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) covariance[i][j] += means.photons[n] * per_photon[n][i] * per_photon[n][j];
    }
  }
  return propagated_cloud(xyz_of_counts(per_photon, means.photons), covariance);
}

Result<void> sample_colours(std::vector<Colour>& colours, const Observer& observer, const CloudDraws& draws) {
  const std::vector<double> levels = photon_levels_w();
  for (std::uint32_t c = 0; c < colours.size(); ++c) {
    for (std::uint32_t l = 0; l < levels.size(); ++l) {
      auto cloud =
          sample_cloud(colours[c], observer, levels[l], {draws.seed, draws.first_frame + l, c, 0}, draws.samples);
      if (!cloud) return tl::make_unexpected(cloud.error());
      colours[c].clouds.push_back(*std::move(cloud));
    }
  }
  return {};
}

std::vector<Colour> colours_under(const Spectrum& light, SpectrumSet set) {
  std::vector<Colour> out;
  for (const NamedSpectrum& chip : spectra_of(set)) {
    out.push_back({std::string(chip.name), reflected(light, chip.spectrum), {}});
  }
  return out;
}

}  // namespace lowlux::isp
