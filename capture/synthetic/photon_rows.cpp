#include "capture/synthetic/photon_rows.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "isp/base/random/random.h"
#include "isp/model/sensor/photon.h"
#include "isp/model/spectrum/cie_data.h"

namespace lowlux::capture {
PhotonRows::PhotonRows(const Scene& scene, const SpectralResponse& response, const isp::LiftTable* table,
                       BayerPhase phase, int masked_columns)
    : scene_(scene), table_(table), phase_(phase), masked_columns_(masked_columns) {
  const auto bins_of = [&](const Spectrum& radiance) {
    std::vector<Bin> bins;
    const auto nm = radiance.wavelengths_nm();
    const std::vector<double> width_nm = isp::bin_widths_nm(radiance);
    for (std::size_t i = 0; i < nm.size(); ++i) {
      Bin bin{};
      bin.photons_per_s =
          static_cast<float>(radiance.values()[i] * width_nm[i] / isp::photon_energy_j(nm[i]) * response.etendue_m2_sr);
      for (int k = 0; k < 3; ++k) bin.efficiency[k] = static_cast<float>(response.quantum_efficiency[k].at(nm[i]));
      bins.push_back(bin);
    }
    return bins;
  };
  for (const Spectrum& radiance : scene.radiances) patches_.push_back(bins_of(radiance));
  std::vector<double> nm, ones;
  for (int i = 0; i < isp::lift_nodes; ++i) {
    nm.push_back(isp::lift_wavelength_nm(i));
    ones.push_back(1);
  }
  lifted_ = bins_of(*Spectrum::of(std::move(nm), std::move(ones)));
}

double PhotonRows::largest_mean_per_s(Executor& executor) const {
  double largest = 0;
  for (const std::vector<Bin>& bins : patches_) {
    for (const Bin& bin : bins) largest = std::max<double>(largest, bin.photons_per_s);
  }
  if (!scene_.patch.empty()) return largest;
  std::vector<float> of_band(static_cast<std::size_t>(executor.width()), 0.0f);
  for_each_band(executor, scene_.xyz_cd_m2.height(), [&](RowBand band, int index) {
    for (int y = band.first; y < band.last; ++y) {
      for (int x = 0; x < scene_.xyz_cd_m2.width(); ++x) {
        const auto power = power_at(x, y);
        for (int bin = 0; bin < isp::lift_nodes; ++bin) {
          of_band[index] = std::max(of_band[index], lifted_[bin].photons_per_s * power[bin]);
        }
      }
    }
  });
  return *std::max_element(of_band.begin(), of_band.end());
}

std::array<float, isp::lift_nodes> PhotonRows::power_at(int x, int y) const {
  return isp::lifted_power(*table_, {scene_.xyz_cd_m2.plane[0].row(y)[x], scene_.xyz_cd_m2.plane[1].row(y)[x],
                                     scene_.xyz_cd_m2.plane[2].row(y)[x]});
}

void PhotonRows::collect(std::uint64_t seed, std::uint32_t frame, int x0, int y, double time_s,
                         std::span<float> charge_e) const {
  const std::uint16_t* patches = scene_.patch.empty() ? nullptr : scene_.patch.row(y);
  const int count = static_cast<int>(charge_e.size());
  const int masked = std::clamp(masked_columns_ - x0, 0, count);
  std::fill_n(charge_e.begin(), masked, 0.0f);
  if (patches == nullptr) {
    collect_lifted(seed, frame, x0 + masked, y, time_s, charge_e.subspan(masked));
    return;
  }
  const auto patch_at = [&](int i) { return patches[x0 + i - masked_columns_]; };
  for (int begin = masked; begin < count;) {
    int end = begin + 1;
    while (end < count && patch_at(end) == patch_at(begin)) ++end;
    collect_patch(patches_[patch_at(begin)], seed, frame, x0 + begin, y, time_s, charge_e.subspan(begin, end - begin));
    begin = end;
  }
}

void PhotonRows::collect_patch(const std::vector<Bin>& bins, std::uint64_t seed, std::uint32_t frame, int x0, int y,
                               double time_s, std::span<float> charge_e) const {
  std::vector<float> photons(charge_e.size());
  std::fill(charge_e.begin(), charge_e.end(), 0.0f);
  for (std::size_t bin = 0; bin < bins.size(); ++bin) {
    std::fill(photons.begin(), photons.end(), static_cast<float>(bins[bin].photons_per_s * time_s));
    poisson_row({seed, frame, draw_purpose::wavelength_bin + static_cast<std::uint32_t>(bin)},
                static_cast<std::uint32_t>(x0), static_cast<std::uint32_t>(y), photons, photons);
    for (std::size_t i = 0; i < charge_e.size(); ++i) {
      charge_e[i] +=
          photons[i] * bins[bin].efficiency[static_cast<int>(colour_at(phase_, x0 + static_cast<int>(i), y))];
    }
  }
}

void PhotonRows::collect_lifted(std::uint64_t seed, std::uint32_t frame, int x0, int y, double time_s,
                                std::span<float> charge_e) const {
  const std::size_t count = charge_e.size();
  std::vector<float> power(isp::lift_nodes * count), photons(count);  // radiance by bin, then by pixel
  for (std::size_t i = 0; i < count; ++i) {
    const int x = x0 + static_cast<int>(i) - masked_columns_;
    const auto colour = power_at(x, y);
    for (int bin = 0; bin < isp::lift_nodes; ++bin) power[bin * count + i] = colour[bin];
  }
  std::fill(charge_e.begin(), charge_e.end(), 0.0f);
  for (int bin = 0; bin < isp::lift_nodes; ++bin) {
    const auto scale = static_cast<float>(lifted_[bin].photons_per_s * time_s);
    for (std::size_t i = 0; i < count; ++i) photons[i] = scale * power[bin * count + i];
    poisson_row({seed, frame, draw_purpose::wavelength_bin + static_cast<std::uint32_t>(bin)},
                static_cast<std::uint32_t>(x0), static_cast<std::uint32_t>(y), photons, photons);
    for (std::size_t i = 0; i < count; ++i) {
      charge_e[i] +=
          photons[i] * lifted_[bin].efficiency[static_cast<int>(colour_at(phase_, x0 + static_cast<int>(i), y))];
    }
  }
}

}  // namespace lowlux::capture
