#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>

#include "tests/hard_cases/mosaics.h"

namespace lowlux::hard_cases {

void measure(HardCase& row, const MosaicBounds& bounds, const std::function<double(const PathRun&)>& error) {
  using denoise::Level;
  const auto fast = [&](Level level) {
    return
        [&error, level](Denormals m) { return error([=](const MosaicCase& c) { return by_denoiser(c, level, m); }); };
  };
  if (bounds.reference.value >= 0) {
    row.on(Path::reference, bounds.reference, [&](Denormals m) {
      return error([m](const MosaicCase& c) { return by_reference(c, Level::standard, m); });
    });
  }
  if (bounds.fast.value >= 0) {
    for (std::size_t i = 0; i < levels.size(); ++i) row.on(levels[i], bounds.fast, fast(denoise::all_levels[i]));
    row.on_each_set(bounds.fast, fast(Level::standard));
  }
  if (bounds.file.value >= 0) {
    row.on(Path::file, bounds.file,
           [&](Denormals m) { return error([m](const MosaicCase& c) { return by_file(c, m); }); });
  }
  if (bounds.live.value >= 0) {
    row.on(Path::live, bounds.live,
           [&](Denormals m) { return error([m](const MosaicCase& c) { return by_live(c, m); }); });
  }
}

void measure(HardCase& row, const MosaicCase& c, const MosaicBounds& bounds, const MosaicError& error) {
  measure(row, bounds, [&](const PathRun& run) { return error(run(c).view()); });
}

MosaicError change_of_means(const MosaicCase& c) {
  const auto before = denoise_testing::colour_means(c.raw_e.view(), c.phase);
  std::array<double, 3> dark_e{}, sites{};
  for (int y = 0; y < c.raw_e.height(); ++y) {
    for (int x = 0; x < c.raw_e.width(); ++x) {
      const auto k = static_cast<std::size_t>(colour_at(c.phase, x, y));
      dark_e[k] += c.noise.dark_mean_e[site_of(x, y)];
      sites[k] += 1;
    }
  }
  std::array<double, 3> expected{}, error{};
  for (int k = 0; k < 3; ++k) {
    expected[k] = before[k] - dark_e[k] / sites[k];
    error[k] = std::sqrt((std::max(before[k], 0.0) + c.noise.variance_e2[k]) / sites[k]);
  }
  return [phase = c.phase, expected, error](PlaneView<const double> signal_e) {
    const auto after = denoise_testing::colour_means(signal_e, phase);
    double worst = 0;
    for (int k = 0; k < 3; ++k) {
      keep_worst(worst, std::abs(after[k] - expected[k]) / error[k]);
    }
    return worst;
  };
}

MosaicError distance_from(double value_e) {
  return [value_e](PlaneView<const double> signal_e) {
    double worst = 0;
    for (int y = 0; y < signal_e.height; ++y) {
      for (int x = 0; x < signal_e.width; ++x) {
        keep_worst(worst, std::abs(signal_e.at(x, y) - value_e));
      }
    }
    return worst;
  };
}

double largest_difference(const Plane<double>& a, const Plane<double>& b) {
  double worst = 0;
  for (std::size_t i = 0; i < a.size(); ++i) keep_worst(worst, std::abs(a.data()[i] - b.data()[i]));
  return worst;
}

}  // namespace lowlux::hard_cases
