#include "isp/metrics/spectral_difference.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include "isp/model/spectrum/spectral_divergence.h"
#include "isp/model/spectrum/spectral_lift.h"

namespace lowlux::isp {
namespace {

std::optional<Spectrum> spectrum_at(const SceneLinear& xyz, std::size_t pixel) {
  const auto at = [&](int c) -> double { return xyz.plane[c].data()[pixel]; };
  const std::optional<Xy> xy = xy_of(Xyz{at(0), at(1), at(2)});
  if (!xy) return std::nullopt;
  const std::optional<Xyz> colour = xyz_of(liftable(*xy));
  return colour ? lift(*colour) : std::nullopt;
}

struct Divergences {
  double forward = 0;
  double both = 0;
};

std::optional<Divergences> at_pixel(const SceneLinear& reference, const SceneLinear& test, std::size_t pixel) {
  const auto a = spectrum_at(reference, pixel), b = spectrum_at(test, pixel);
  if (!a || !b) return std::nullopt;
  const auto forward = kullback_leibler(*a, *b), both = jeffreys(*a, *b);
  if (!forward || !both) return std::nullopt;
  return Divergences{*forward, *both};
}

}  // namespace

SpectralDifference spectral_difference(const SceneLinear& reference_xyz, const SceneLinear& test_xyz,
                                       Executor& executor) {
  const std::size_t pixels = reference_xyz.plane[0].size();
  const auto samples = static_cast<int>(std::min<std::size_t>(pixels, spectral_samples));
  std::vector<std::optional<Divergences>> found(static_cast<std::size_t>(samples));
  for_each_band(executor, samples, [&](RowBand band, int) {
    for (int i = band.first; i < band.last; ++i) {
      const auto k = static_cast<std::size_t>(i);
      found[k] = at_pixel(reference_xyz, test_xyz, k * pixels / static_cast<std::size_t>(samples));
    }
  });
  SpectralDifference out;
  for (const auto& one : found) {
    if (!one) continue;
    out.kullback_leibler += one->forward;
    out.jeffreys += one->both;
    ++out.pixels;
  }
  constexpr double none = std::numeric_limits<double>::quiet_NaN();
  out.kullback_leibler = out.pixels > 0 ? out.kullback_leibler / out.pixels : none;
  out.jeffreys = out.pixels > 0 ? out.jeffreys / out.pixels : none;
  return out;
}

}  // namespace lowlux::isp
