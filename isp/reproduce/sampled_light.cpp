#include "isp/reproduce/sampled_light.h"

#include <cassert>
#include <cmath>
#include <utility>

#include "isp/model/spectrum/cie_data.h"

namespace lowlux::isp {

double poisson_count(const DrawStream& stream, std::uint32_t x, std::uint32_t y, double mean) {
  assert(mean >= 0);
  const std::uint32_t word = words_at(stream, x, y)[0];
  if (mean <= poisson_max_mean) return poisson_of_word(word, static_cast<float>(mean));
  return std::round(mean + std::sqrt(mean) * normal_of_word(word));
}

std::vector<double> draw_photons(const PhotonMeans& means, const DrawPlace& place) {
  std::vector<double> counts(means.photons.size());
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const DrawStream stream{place.seed, place.frame, draw_purpose::wavelength_bin + static_cast<std::uint32_t>(i)};
    counts[i] = poisson_count(stream, place.sample, place.source, means.photons[i]);
  }
  return counts;
}

std::vector<double> photon_levels_w() { return {1, 1e-3, 1e-6, 1e-9, 1e-12, 1e-13, 1e-14, 6e-15}; }

Series spectral_locus() {
  Series out{"spectral locus", {}, {}, Mark::line};
  const auto& observer = cie_1931_observer();
  const auto add = [&](double nm) {
    const auto xy = xy_of(Xyz{observer[0].at(nm), observer[1].at(nm), observer[2].at(nm)});
    out.x.push_back(xy->x);
    out.y.push_back(xy->y);
  };
  for (int nm = 390; nm <= 690; nm += 2) add(nm);
  add(390);
  return out;
}

}  // namespace lowlux::isp
