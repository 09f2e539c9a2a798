#include "denoise/spatial/point_sources.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "tests/denoise/frames.h"
#include "tests/denoise/searcher.h"

namespace lowlux {
namespace {

using namespace denoise_testing;
using denoise::Level;

// Four windows a cell, each with a probability of 1.7e-7 (normal tail at 5.1 standard deviations; Bennett's bound makes
// up for the heavier tail of few counts). The limit is 1e-6 of the cells and five standard errors of that count.
TEST(PointSources, AreFoundInFlatNoiseInLessThanOneCellInAMillion) {
  const int side = std::getenv("LOWLUX_NIGHTLY") == nullptr ? 1500 : 6000;
  Searcher search(side);
  struct Case {
    double signal_e, dark_e, read_noise_e;
  };
  for (const Case c : {Case{0, 0.3, 1}, Case{0.5, 2, 1.5}, Case{20, 2, 1.5}, Case{4, 200, 4}, Case{2000, 2, 2}}) {
    const Camera camera{.dark_e = {c.dark_e, c.dark_e, c.dark_e, c.dark_e}, .read_noise_e = c.read_noise_e};
    const auto raw = exposed(camera, flat(c.signal_e, 2 * c.signal_e, c.signal_e), side, side, 21);
    const double expected = 1e-6 * side * side / 4;
    // Each source marks up to 3 x 3 cells.
    EXPECT_LE(static_cast<double>(marked(search(raw, camera))) / 9, expected + 5 * std::sqrt(expected))
        << c.signal_e << " over " << c.dark_e;
  }
}

TEST(PointSources, AreNoSingleHotSites) {
  const Camera camera{.dark_e = {2, 2, 2, 2}};
  auto raw = exposed(camera, flat(3, 4, 3), 1200, 400, 22);
  const double sigma = cell_sigma_e(camera, 3.5);
  int hot = 0;
  for (int y = 20; y < 380; y += 20) {
    for (int x = 20; x < 1180; x += 20, ++hot) raw.at(x + y / 20 % 2, y) += static_cast<float>(30 * sigma);
  }
  Searcher search(1200);
  // The other three sites exceed 2.5 standard deviations by chance with probability 0.6 %, in the best of four windows.
  const double expected = 4 * 0.0062 * hot;
  EXPECT_LE(static_cast<double>(marked(search(raw, camera))) / 9, expected + 5 * std::sqrt(expected));
}

TEST(PointSources, AreNoEdges) {
  const Camera camera{.dark_e = {2, 2, 2, 2}};
  const auto raw = exposed(
      camera,
      [](int x, int y) {
        const double level = (x / 40 + y / 40) % 2 == 0 ? 20 : 400;
        return std::array{level, level, level};
      },
      800, 400, 23);
  EXPECT_EQ(marked(Searcher(800)(raw, camera)), 0);
}

TEST(PointSources, AreFoundAtAnyPlaceOfTheMosaicAndOnlyThere) {
  const Camera camera{.dark_e = {2, 2, 2, 2}};
  for (const int dx : {0, 1}) {
    for (const int dy : {0, 1}) {
      auto raw = exposed(camera, flat(3, 4, 3), 120, 80, 24);
      const auto each = static_cast<float>(12 * cell_sigma_e(camera, 3.5) / 4);
      for (int i = 0; i < 4; ++i) raw.at(60 + dx + i % 2, 40 + dy + i / 2) += each;
      const auto cells = Searcher(120)(raw, camera);
      EXPECT_EQ(marked(cells), (dx == 0 ? 3 : 2) * (dy == 0 ? 3 : 2));
      EXPECT_EQ(cells.at(30, 20), 1);
    }
  }
}

TEST(PointSources, AreNotLookedForInFramesSmallerThanTheirSurroundings) {
  const Camera camera;
  Plane<float> raw(13, 9);
  std::fill(raw.data(), raw.data() + raw.size(), 0.0f);
  raw.at(6, 4) = raw.at(7, 4) = 1000;
  EXPECT_EQ(marked(Searcher(13)(raw, camera)), 0);
}

struct Star {
  double snr;  // by the CCD equation, flux / sqrt(flux + variance of its cell without it)
  double dark_e;
  Level level = Level::standard;
};

/// Mean share of the flux of stars of one cell that is left in their 3 x 3 cells.
double flux_kept(const Star& star, bool keep, int seed, int width = 960, int height = 640) {
  const Camera camera{.dark_e = {star.dark_e, star.dark_e, star.dark_e, star.dark_e}};
  const double signal_e = 5, variance_e2 = std::pow(cell_sigma_e(camera, signal_e), 2), q = star.snr * star.snr;
  const double flux_e = q / 2 + std::sqrt(q * q / 4 + q * variance_e2);
  constexpr int pitch = 32;
  const auto in_star = [](int i) { return i % pitch == 16 || i % pitch == 17; };
  const Scene scene = [&](int x, int y) {
    const double e = signal_e + (in_star(x) && in_star(y) ? flux_e / 4 : 0);
    return std::array{e, e, e};
  };
  const auto raw = exposed(camera, scene, width, height, seed);
  Plane<float> out(width, height);
  denoise::Denoiser denoiser(width, height, 1, star.level);
  InlineExecutor one;
  const denoise::DenoiseOptions options{.level = star.level, .keep_point_sources = keep};
  denoiser.run({raw.view(), camera.phase}, camera.noise(), options, out.view(), {}, one);
  double sum = 0;
  int stars = 0;
  for (int y = 16; y < height; y += pitch) {
    for (int x = 16; x < width; x += pitch, ++stars) {
      for (int j = -2; j < 4; ++j) {
        for (int i = -2; i < 4; ++i) sum += static_cast<double>(out.at(x + i, y + j)) - signal_e;
      }
    }
  }
  return sum / stars / flux_e;
}

// 600 stars, each with the noise of 9 cells: 5 standard errors are 5 * 3 / (6 sqrt(600)) = 0.10 of the flux at a ratio
// of 6, less above it.
TEST(PointSources, KeepNineTenthsOfTheirFlux) {
  for (const double dark_e : {2.0, 200.0}) {
    for (const double snr : {6.0, 7.0, 8.0, 10.0, 20.0}) {
      const double kept = flux_kept({snr, dark_e}, true, 31);
      EXPECT_GE(kept, 0.9) << snr << " over " << dark_e;
      EXPECT_LE(kept, 1.1) << snr << " over " << dark_e;
    }
  }
}

// 240 stars: as above, 5 standard errors are 5 * 3 / (10 sqrt(240)) = 0.097 of the flux.
TEST(PointSources, KeepNineTenthsOfTheirFluxOnEveryLevel) {
  for (const Level level : denoise::all_levels) {
    for (const double dark_e : {2.0, 200.0}) {
      const double kept = flux_kept({10, dark_e, level}, true, 33, 512, 480);
      EXPECT_GE(kept, 0.9) << name_of(level) << " over " << dark_e;
      EXPECT_LE(kept, 1.1) << name_of(level) << " over " << dark_e;
    }
  }
}

TEST(PointSources, LoseMostOfItIfTheyAreNotKept) {
  EXPECT_LT(flux_kept({6, 200}, false, 32), 0.5);
  EXPECT_LT(flux_kept({10, 200}, false, 32), 0.7);
}

}  // namespace
}  // namespace lowlux
