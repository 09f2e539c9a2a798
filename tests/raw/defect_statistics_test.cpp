#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "isp/raw/black_point.h"
#include "isp/raw/repair.h"
#include "tests/support/frames.h"

// How many defects one picture tells, and that no star is taken for one. Electrons, Poisson; 0.8 DN/e-, read noise 2
// e-.
namespace lowlux::isp::defect_statistics_test {
namespace {

constexpr int side = 512;
constexpr double gain = 0.8, read_e = 2, sky_e = 20, black_dn = 512;
const double sigma_e = std::sqrt(sky_e + read_e * read_e);

struct Sky {
  std::vector<double> mean_e = std::vector<double>(static_cast<std::size_t>(side) * side, sky_e);
  std::mt19937 engine;
  explicit Sky(unsigned seed) : engine(seed) {}
  double& at(int x, int y) { return mean_e[static_cast<std::size_t>(y) * side + x]; }

  RawDn expose() {
    std::normal_distribution<double> normal(0, read_e);
    RawDn raw = test::bayer_frame(side, side, BayerPhase::rggb, [&](int x, int y) {
      const double electrons = std::poisson_distribution<int>(at(x, y))(engine) + normal(engine);
      return static_cast<int>(std::clamp(std::lround(black_dn + gain * electrons), 0L, 16383L));
    });
    raw.black_tag->pattern_dn = {black_dn};
    raw.white_dn = {16383, 16383, 16383};
    return raw;
  }
};

std::vector<Pixel> found_in(const RawDn& raw) {
  InlineExecutor executor;
  const DefectNoise noise{gain * read_e, gain};
  return find_defects(raw, *choose_black(raw, {BlackChoice::metadata}), noise, executor);
}

struct Tally {
  double truth = 0, found = 0, both = 0;
  double recall() const { return both / truth; }
  double precision() const { return both / found; }
};

// Hot pixels, a share of 0.002, their charge exponential; those above 8 standard deviations count as truth.
Tally defects_found(double mean_e, int frames) {
  Tally tally;
  for (int f = 0; f < frames; ++f) {
    Sky sky(1 + static_cast<unsigned>(f));
    std::vector<Pixel> truth, any;
    std::exponential_distribution<double> charge(1 / mean_e);
    std::uniform_int_distribution<int> place(2, side - 3);
    for (int i = 0; i < side * side / 500; ++i) {
      const Pixel p{place(sky.engine), place(sky.engine)};
      if (std::ranges::find(any, p) != any.end()) continue;
      const double extra_e = charge(sky.engine);
      sky.at(p.x, p.y) += extra_e;
      any.push_back(p);
      if (extra_e > 8 * sigma_e) truth.push_back(p);
    }
    const std::vector<Pixel> found = found_in(sky.expose());
    const auto in = [](const std::vector<Pixel>& list) {
      return [&list](const Pixel& p) { return std::ranges::find(list, p) != list.end(); };
    };
    tally.truth += static_cast<double>(truth.size());
    // A hot pixel of less than 8 deviations that is found is a hot pixel all the same.
    tally.found += static_cast<double>(found.size()) - static_cast<double>(std::ranges::count_if(found, in(any))) +
                   static_cast<double>(std::ranges::count_if(found, in(truth)));
    tally.both += static_cast<double>(std::ranges::count_if(found, in(truth)));
  }
  return tally;
}

TEST(DefectStatistics, OneImageFindsNineTenthsOfTheHotPixelsAndHardlyAnyOther) {
  // 1200 e- are the hot sensor of tests/sensor_bench after 4 s.
  for (const double mean_e : {300.0, 1200.0}) {
    const Tally t = defects_found(mean_e, 6);
    const double error = std::sqrt(0.9 * 0.1 / t.truth);
    RecordProperty("recall_" + std::to_string(static_cast<int>(mean_e)), std::to_string(t.recall()));
    RecordProperty("precision_" + std::to_string(static_cast<int>(mean_e)), std::to_string(t.precision()));
    EXPECT_GT(t.recall(), mean_e > 1000 ? 0.9 + 5 * error : 0.9) << mean_e << ", " << t.truth << " defects";
    EXPECT_GT(t.precision(), 0.98) << mean_e;
  }
}

TEST(DefectStatistics, NoiseWhoseSizeIsKnownIsHardlyEverADefect) {
  std::size_t found = 0;
  for (unsigned seed = 50; seed < 56; ++seed) found += found_in(Sky(seed).expose()).size();
  EXPECT_LE(found,
            3U);  // of 1.6 million pixels: one in a million, and Poisson's five standard errors are 3 + 5 sqrt(1.6)
}

struct Star {
  double x, y, flux_e;
};

// Light within a pixel of a Gaussian spot.
double fraction_within(double pixel, double centre, double spread) {
  const auto below = [&](double edge) { return std::erf((edge - centre) / (std::sqrt(2.0) * spread)); };
  return (below(pixel + 0.5) - below(pixel - 0.5)) / 2;
}

// Flux with which a star has this signal-to-noise ratio over the 4 pi spread^2 pixels that matter.
double flux_of_snr(double snr, double spread) {
  const double background = 4 * std::numbers::pi * spread * spread * sigma_e * sigma_e;
  return (snr * snr + std::sqrt(std::pow(snr, 4) + 4 * snr * snr * background)) / 2;
}

// Stars of SNR 5 to 1000, one in each 16 x 16 pixels, anywhere on the grid. @return stars that a defect was found in
int stars_altered(double spread, const std::array<double, 3>& colour, unsigned seed) {
  Sky sky(seed);
  std::uniform_real_distribution<double> off(-0.5, 0.5), log_snr(std::log(5.0), std::log(1000.0));
  std::vector<Star> stars;
  for (int y = 8; y < side; y += 16) {
    for (int x = 8; x < side; x += 16) {
      const int shift = (x / 16) % 2;  // green and coloured sites in turn
      stars.push_back(
          {x + shift + off(sky.engine), y + off(sky.engine), flux_of_snr(std::exp(log_snr(sky.engine)), spread)});
    }
  }
  for (const Star& s : stars) {
    for (int y = static_cast<int>(s.y) - 6; y <= static_cast<int>(s.y) + 7; ++y) {
      for (int x = static_cast<int>(s.x) - 6; x <= static_cast<int>(s.x) + 7; ++x) {
        if (x < 0 || y < 0 || x >= side || y >= side) continue;
        const auto c = static_cast<std::size_t>(colour_at(BayerPhase::rggb, x, y));
        sky.at(x, y) += colour[c] * s.flux_e * fraction_within(x, s.x, spread) * fraction_within(y, s.y, spread);
      }
    }
  }
  const std::vector<Pixel> found = found_in(sky.expose());
  return static_cast<int>(std::ranges::count_if(stars, [&](const Star& s) {
    return std::ranges::any_of(found, [&](const Pixel& p) { return std::hypot(p.x - s.x, p.y - s.y) < 4; });
  }));
}

TEST(DefectStatistics, NoStarOfOneAndAHalfPixelsIsTakenForADefect) {
  // Camera values of a white star under daylight, and of one like a lamp.
  const std::array<std::array<double, 3>, 2> colours{{{0.5, 1, 0.6}, {0.8, 1, 0.3}}};
  int undersampled = 0;
  for (const auto& colour : colours) {
    for (const double fwhm : {1.5, 2.0, 3.5}) {
      int altered = 0;
      for (unsigned seed = 0; seed < 3; ++seed) altered += stars_altered(fwhm / 2.3548, colour, 200 + seed);
      EXPECT_EQ(altered, 0) << "of 3072 stars, FWHM " << fwhm << ", blue " << colour[2];
    }
    undersampled += stars_altered(0.6, colour, 300);
  }
  RecordProperty("altered_of_2048_of_spread_0.6", undersampled);
  EXPECT_LE(undersampled, 5);  // no lens and Bayer filter give so small a spot without aliasing; a quarter percent
}

}  // namespace
}  // namespace lowlux::isp::defect_statistics_test
