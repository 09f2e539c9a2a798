#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "denoise/denoiser.h"
#include "isp/model/colour/chroma_bound.h"
#include "isp/model/colour/dark_desaturation.h"
#include "tests/denoise/draws.h"
#include "tests/denoise/flat_charts.h"

namespace lowlux::denoiser_colour_test {
namespace {

using namespace denoise_testing;
using denoise::Level;
using test::MeanOf;

bool nightly() { return std::getenv("LOWLUX_NIGHTLY") != nullptr; }
std::string named(Level level) { return std::string(name_of(level)); }

/// The table's camera, balanced for its neutral.
Camera balanced_camera(double dark_e) {
  Camera camera = camera_over(dark_e);
  for (int k = 0; k < 3; ++k) camera.white_gain[k] = 1 / test::table_neutral[k];
  return camera;
}

Scene flat(const Vector3& e) { return denoise_testing::flat(e[0], e[1], e[2]); }
Vector3 times(double factor, const Vector3& v) { return {factor * v[0], factor * v[1], factor * v[2]}; }
double balanced_luma(const Camera& camera, const std::array<double, 3>& e) {
  return luma_of({camera.white_gain[0] * e[0], camera.white_gain[1] * e[1], camera.white_gain[2] * e[2]});
}

isp::UvPrime uv_of(const Vector3& signal_e) {
  const Vector3 c = test::table_camera * signal_e;
  const double weight = c[0] + 15 * c[1] + 3 * c[2];
  return {4 * c[0] / weight, 9 * c[1] / weight};
}

isp::FlatPatch patch_of(const Camera& camera, const Vector3& signal_e, double cells) {
  const double dark_e = camera.dark_e[0];
  return {.signal_e = signal_e,
          .dark_e = {dark_e, dark_e, dark_e},
          .noise_std_e = camera.read_noise_e,
          .pixels = {cells, 2 * cells, cells},
          .dark_pixels = {}};
}

struct PixelSpread {
  double effective_cells = 0;  // that a denoised cell is the mean of, by the error of its luma
  double rss = 0;              // standard deviation of u'v' of single cells
  double robust = 0;           // half the range that holds 68 %, rss: without tails
};

/// Half of what lies between the 15.9th and the 84.1st hundredth: one standard deviation of normal figures.
double half_range(std::vector<double>& x) {
  const auto at = [&x](double share) {
    const auto place = x.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(x.size()));
    std::nth_element(x.begin(), place, x.end());
    return *place;
  };
  return (at(0.841345) - at(0.158655)) / 2;
}

PixelSpread spread_of(const Denoised& out, const Camera& camera, const Vector3& signal_e) {
  MeanOf u, v;
  std::vector<double> all_u, all_v;
  double squared = 0;
  constexpr int margin = 32;
  const int columns = out.signal.width() / 2, rows = out.signal.height() / 2;
  all_u.reserve(static_cast<std::size_t>(columns) * rows);
  all_v.reserve(all_u.capacity());
  for (int y = margin; y < rows - margin; ++y) {
    for (int x = margin; x < columns - margin; ++x) {
      const auto cell = out.cell(x, y);
      const auto uv = uv_of({cell[0], cell[1], cell[2]});
      u.add(uv.u);
      v.add(uv.v);
      all_u.push_back(uv.u);
      all_v.push_back(uv.v);
      squared += std::pow(balanced_luma(camera, cell) - balanced_luma(camera, signal_e), 2);
    }
  }
  double variance = 0;
  constexpr std::array weight{0.04, 0.18, 0.04};  // two greens of 0.3
  for (int k = 0; k < 3; ++k) {
    const double site = signal_e[k] + camera.dark_e[0] + camera.read_noise_e * camera.read_noise_e;
    variance += weight[k] * std::pow(camera.white_gain[k], 2) * site;
  }
  return {variance * u.count / squared, std::sqrt(u.variance() + v.variance()),
          std::hypot(half_range(all_u), half_range(all_v))};
}

// Per cell, not per patch: whoever looks at a pixel sees this. Chroma is averaged further than luma, so that the spread
// is mostly below the bound for as many cells as luma is the mean of. 1.15 is what is asked for. What passes the
// thresholds is no normal noise: at 4 e- over 200 it takes nearly all light from one cell in some thousands, and their
// ratios have any value. From 5 on the spread is therefore that without tails, from 20 on the whole.
TEST(DenoiserColour, OfSingleCellsScattersAsTheBoundOfTheirEffectiveNumberHasIt) {
  std::printf(
      "u'v' of single cells: effective cells N, standard deviation; over the bound for N; without prior and tails; "
      "with\n");
  const std::array<std::pair<const char*, Vector3>, 3> colours{
      {{"neutral", test::table_neutral}, {"red", test::table_red}, {"blue", test::table_blue}}};
  int compared = 0;
  for (const double dark_e : {2.0, 200.0}) {
    const Camera camera = balanced_camera(dark_e);
    for (const double mean_e : {4.0, 20.0, 200.0, 2000.0}) {
      for (const auto& [name, colour] : colours) {
        const Vector3 signal_e = times(mean_e, colour);
        const auto raw = exposed(camera, flat(signal_e), 640, 512, 301);
        for (const Level level : levels_for_flats()) {
          const PixelSpread got = spread_of(Denoised(raw, camera, {.level = level, .rho = no_prior}), camera, signal_e);
          const auto bound = isp::chroma_crb(test::table_camera, patch_of(camera, signal_e, got.effective_cells));
          const double one = rss_std(bound->uv_covariance);
          std::printf("%5.0f over %3.0f e-  %-8s %-8s N %4.0f  %.5f  %5.2f  %.2f  (W / std(W) %.0f)\n", mean_e, dark_e,
                      name, named(level).c_str(), got.effective_cells, got.rss, got.rss / one, got.robust / one,
                      bound->weight_snr);
          if (bound->weight_snr < 5) continue;
          EXPECT_LT(got.robust / one, 1.15) << mean_e << " over " << dark_e << ' ' << name << ' ' << named(level);
          if (bound->weight_snr > 20) {
            EXPECT_LT(got.rss / one, 1.15) << name << ' ' << named(level);
          }
          ++compared;
        }
      }
    }
  }
  EXPECT_GE(compared, 60) << "of 24 for each level";
}

struct Bias {
  MeanOf u, v;
  double largest(const isp::UvPrime& truth) const {
    return std::max(std::abs(u.mean() - truth.u), std::abs(v.mean() - truth.v));
  }
};

// Frames of 65536 cells, 16 times the 4096 of the limit: the mean of one scatters by a quarter of that bound and a
// tenth more (cells near the border weigh differently), that of 40 by 0.043 of it. A fifth is 4.6 standard errors.
TEST(DenoiserColour, OfTheMeanIsUnbiasedWithoutPriorHoweverMuchDarkIsSubtracted) {
  const Vector3 signal_e = times(4, test::table_red);
  const isp::UvPrime truth = uv_of(signal_e);
  const int frames = nightly() ? 400 : 40;
  for (const double dark_e : {20.0, 40.0}) {
    const Camera camera = balanced_camera(dark_e);
    std::array<Bias, denoise::all_levels.size()> bias;
    for (int i = 0; i < frames; ++i) {
      const auto raw = exposed(camera, flat(signal_e), 512, 512, 400 + static_cast<std::uint64_t>(i));
      for (const Level level : levels_for_flats()) {
        const Denoised out(raw, camera, {.level = level, .rho = no_prior});
        const auto uv = uv_of(colour_means(out.signal.view(), camera.phase));
        bias[static_cast<std::size_t>(level)].u.add(uv.u);
        bias[static_cast<std::size_t>(level)].v.add(uv.v);
      }
    }
    const double bound = rss_std(isp::chroma_crb(test::table_camera, patch_of(camera, signal_e, 4096))->uv_covariance);
    for (const Level level : levels_for_flats()) {
      const double largest = bias[static_cast<std::size_t>(level)].largest(truth);
      std::printf("dark %.0f e-  %-8s bias of u'v' %.6f, %.3f of the bound at 4096 cells\n", dark_e,
                  named(level).c_str(), largest, largest / bound);
      EXPECT_LT(largest, bound / 5) << dark_e << ' ' << named(level);
    }
  }
}

// Eq. 4.23 and 4.24: left in, the dark pulls the mean chromaticity to its own by alpha.
TEST(DenoiserColour, OfANaiveMeanIsOffByWhatAlphaPredicts) {
  const Vector3 signal_e = times(4, test::table_red);
  const isp::Xyz signal = isp::xyz_of(test::table_camera * signal_e);
  for (const double dark_e : {20.0, 40.0}) {
    const Camera camera = balanced_camera(dark_e);
    const auto raw = exposed(camera, flat(signal_e), 512, 512, 501);
    Camera unaware = camera;
    unaware.dark_e = {};
    const isp::Xyz dark = isp::xyz_of(test::table_camera * Vector3{dark_e, dark_e, dark_e});
    const isp::Xy predicted =
        isp::desaturated(*isp::xy_of(signal), *isp::xy_of(dark), *isp::signal_fraction(signal, dark));
    const auto patch = patch_of(camera, signal_e, 65536);
    const double error = rss_std(isp::chroma_crb(test::table_camera, patch)->xy_covariance);
    for (const Level level : levels_for_flats()) {
      const Denoised out(raw, unaware, {.level = level, .rho = no_prior});
      const isp::Xy got = *isp::xy_of(isp::xyz_of(test::table_camera * colour_means(out.signal.view(), camera.phase)));
      // The sum is (S + n) / S times as large and its noise the same: this error is above the true one.
      EXPECT_LT(std::hypot(got.x - predicted.x, got.y - predicted.y), 5 * error) << named(level);
      EXPECT_GT(std::hypot(got.x - isp::xy_of(signal)->x, got.y - isp::xy_of(signal)->y), 20 * error) << named(level);
    }
  }
}

/// White-balanced C1 and C2.
std::array<double, 2> chroma_of(const Camera& camera, const std::array<double, 3>& e) {
  const auto& g = camera.white_gain;
  return {(g[0] * e[0] + g[2] * e[2]) / 2 - g[1] * e[1], (g[0] * e[0] - g[2] * e[2]) / std::numbers::sqrt2};
}

struct Saturation {
  double free = 0;       // without a prior, over the truth: 1 but for noise
  double kept = 0;       // with it, over that without
  double predicted = 0;  // mean of the confidence, weighted by that without
};

Saturation saturation_of(const Plane<float>& raw, const Camera& camera, const Vector3& signal_e, Level level) {
  const Denoised free(raw, camera, {.level = level, .rho = no_prior}), shrunk(raw, camera, {.level = level});
  const auto truth = chroma_of(camera, signal_e);
  double of_free = 0, of_shrunk = 0, predicted = 0, cells = 0;
  for (int y = 0; y < raw.height() / 2; ++y) {
    for (int x = 0; x < raw.width() / 2; ++x, ++cells) {
      const auto a = chroma_of(camera, free.cell(x, y)), b = chroma_of(camera, shrunk.cell(x, y));
      const double along = a[0] * truth[0] + a[1] * truth[1];
      of_free += along;
      of_shrunk += b[0] * truth[0] + b[1] * truth[1];
      predicted += along * static_cast<double>(shrunk.confidence.at(x, y));
    }
  }
  const double square = truth[0] * truth[0] + truth[1] * truth[1];
  return {of_free / cells / square, of_shrunk / of_free, predicted / of_free};
}

// The prior takes C r / (L^2 rho^2 + r): always towards neutral, and as much as the confidence says. That is of the
// mean variance of C1 and C2, which differ by the site variances of green and of red and blue: a tenth of the loss, and
// 1e-4 for floats.
TEST(DenoiserColour, LosesSaturationByThePriorAsItsConfidenceSaysAndNotOtherwise) {
  std::printf("saturation: without prior over truth; with rho = 1.5 over that, and as predicted\n");
  struct Light {
    double signal_e, dark_e;
  };
  for (const Light light : {Light{0.3, 2}, Light{1, 2}, Light{1, 200}, Light{4, 200}, Light{20, 2}, Light{200, 2}}) {
    const Camera camera = balanced_camera(light.dark_e);
    for (const auto& [name, colour] : {std::pair{"red", test::table_red}, std::pair{"blue", test::table_blue}}) {
      const Vector3 signal_e = times(light.signal_e, colour);
      const auto raw = exposed(camera, flat(signal_e), 512, 512, 601);
      // Standard error of the mean chroma along its direction: at most that of the noisiest white-balanced colour.
      const double gain = *std::max_element(camera.white_gain.begin(), camera.white_gain.end());
      const double site = 2 * light.signal_e + light.dark_e + camera.read_noise_e * camera.read_noise_e;
      const auto truth = chroma_of(camera, signal_e);
      const double error = 1.1 * gain * std::sqrt(site / 65536) / std::hypot(truth[0], truth[1]);
      for (const Level level : levels_for_flats()) {
        const Saturation got = saturation_of(raw, camera, signal_e, level);
        std::printf("%5.1f over %3.0f e-  %-5s %-8s %.4f  %.4f  %.4f\n", light.signal_e, light.dark_e, name,
                    named(level).c_str(), got.free, got.kept, got.predicted);
        EXPECT_NEAR(got.free, 1, 5 * error);
        EXPECT_LT(got.kept, 1);
        EXPECT_NEAR(got.kept, got.predicted, 0.1 * (1 - got.predicted) + 1e-4);
      }
    }
  }
}

}  // namespace
}  // namespace lowlux::denoiser_colour_test
