#include "isp/render/local_tone.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <random>
#include <utility>
#include <vector>

#include "tests/support/executors.h"

namespace lowlux::isp::local_tone_test {
namespace {

constexpr unsigned seed = 20261126;
constexpr double grey = 0.18, floor_e = 0x1p-12 * grey;

double log_uniform(std::mt19937& random, double low, double high) {
  return low * std::pow(high / low, std::uniform_real_distribution<double>()(random));
}

SceneLinear copy_of(const SceneLinear& in) {
  SceneLinear out;
  for (int c = 0; c < 3; ++c) out.plane[c] = in.plane[c].clone();
  return out;
}

/// Variances of cells; without data if the noise is unknown.
Plane<float> cells_of(int width, int height, double variance) {
  Plane<float> out((width + 3) / 4, (height + 3) / 4);
  std::fill_n(out.data(), out.size(), static_cast<float>(variance));
  return out;
}

SceneLinear changed(const SceneLinear& in, const LocalTone& how, const Plane<float>& variance,
                    Executor& executor = test::one_thread) {
  SceneLinear out = copy_of(in);
  apply_local_tone(how, variance.size() > 0 ? variance.view() : PlaneView<const float>(), out.view(), executor);
  return out;
}

SceneLinear filled(int width, int height, double r, double g, double b) {
  SceneLinear out(width, height);
  const double value[]{r, g, b};
  for (int c = 0; c < 3; ++c) std::fill_n(out.plane[c].data(), out.plane[c].size(), static_cast<float>(value[c]));
  return out;
}

double lightness(double y) { return y > 216.0 / 24389 ? 116 * std::cbrt(y) - 16 : 24389.0 / 27 * y; }

/// The change in EV by the documented formulas, without the limit by noise.
double expected_ev(double share, double base, double limit) {
  if (base < 0) return share * -base / (1 - base / 6);
  const double white = std::log2(limit / grey), b = std::min(base, white);
  return -share * b * (1 - b / white);
}

/// Noise of a lifted flat in CIE L* behind a tone curve y(x) >= 0.7 x with y' <= 1.3, by the difference quotient.
double noise_lightness(double y, double gain, double sigma) {
  const double shown = 0.7 * gain * y, step = 1e-4 * gain * sigma;
  return (lightness(shown + step) - lightness(shown - step)) / (2 * step) * 1.3 * gain * sigma;
}

TEST(LocalTone, FlatsFollowTheFormulaAndTheirNoiseStaysBelowTheLimit) {
  std::mt19937 random(seed);
  int limited = 0, free = 0;
  for (int i = 0; i < 400; ++i) {
    const double limit = i % 3 == 0 ? 1 : log_uniform(random, 1, 4096),
                 share = std::uniform_real_distribution<>()(random);
    const double y = log_uniform(random, 1e-6, limit), sigma = i % 4 == 0 ? 0 : log_uniform(random, 1e-7, 0.1);
    const auto how = LocalTone{static_cast<float>(share), {0.5f, 1, 0.5f}, static_cast<float>(limit)};
    const auto level = y / limit / 2;  // weights add up to 2
    const SceneLinear out = changed(filled(9, 7, level, level, level), how, cells_of(9, 7, std::pow(sigma / limit, 2)));
    const double gain = out.plane[1].at(4, 3) / static_cast<double>(static_cast<float>(level));
    const double n = std::max(sigma, floor_e), free_ev = expected_ev(share, std::log2((y + n) / grey), limit);
    if (free_ev <= 0 || noise_lightness(y, std::exp2(free_ev), n) < local_tone_noise * 0.999) {
      EXPECT_NEAR(std::log2(gain), free_ev, 2e-5) << i << " y " << y << " sigma " << sigma;
      ++free;
    } else {
      EXPECT_LT(std::log2(gain), free_ev + 1e-5) << i;
      if (gain > 1.0001) {
        EXPECT_NEAR(noise_lightness(y, gain, n), local_tone_noise, 0.002) << i << " y " << y << " sigma " << sigma;
      } else {
        EXPECT_NEAR(gain, 1, 1e-6) << i;
        EXPECT_GT(noise_lightness(y, 1, n), local_tone_noise * 0.999) << i;
      }
      ++limited;
    }
  }
  EXPECT_GT(limited, 40);
  EXPECT_GT(free, 40);
}

TEST(LocalTone, FlatsKeepTheirOrderAndGreyBlackAndWhiteStay) {
  for (const float share : {0.1f, 0.5f, 1.0f}) {
    for (const float limit : {1.0f, 8.0f, 4096.0f}) {
      const LocalTone how{share, {0.25f, 0.5f, 0.25f}, limit};
      double before = 0;
      for (double y = 1e-5; y < 1.2; y *= 1.1) {
        const SceneLinear out = changed(filled(5, 5, y, y, y), how, {});
        EXPECT_GE(out.plane[0].at(2, 2), before * (1 - 1e-6)) << share << " " << limit << " " << y;
        before = out.plane[0].at(2, 2);
      }
      for (const double kept : {grey / limit, 0.0, 1.0, 3.0}) {
        const SceneLinear out = changed(filled(5, 5, kept, kept, kept), how, {});
        EXPECT_NEAR(out.plane[2].at(1, 1), kept, 1e-3 * kept) << share << " " << limit;
      }
    }
  }
}

/// Patches of levels over many EV, with noise below and above zero.
SceneLinear patches(int width, int height, std::mt19937& random) {
  SceneLinear out(width, height);
  std::vector<double> level(64);
  for (double& value : level) value = log_uniform(random, 1e-4, 1);
  std::normal_distribution<double> noise(0, 1e-3);
  const int side = 1 + static_cast<int>(random() % 60);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double value = level[static_cast<std::size_t>((x / side + 7 * (y / side)) % 64)];
      for (int c = 0; c < 3; ++c) out.plane[c].at(x, y) = static_cast<float>((1 + 0.3 * c) * value + noise(random));
    }
  }
  return out;
}

/// The documented method, window by window, in double precision.
SceneLinear reference(const SceneLinear& in, const LocalTone& how, const Plane<float>& variance) {
  const int width = in.width(), height = in.height(), across = (width + 3) / 4, down = (height + 3) / 4;
  const int reach = std::max(1, std::max(across, down) / 40);
  using Grid = std::vector<double>;
  const auto luminance = [&](int x, int y) {
    double sum = 0;
    for (int c = 0; c < 3; ++c) sum += static_cast<double>(how.luminance[c]) * in.plane[c].at(x, y);
    return sum * how.limit;
  };
  const auto averaged = [&](const Grid& grid) {
    Grid out(grid.size());
    for (int y = 0; y < down; ++y) {
      for (int x = 0; x < across; ++x) {
        double sum = 0, count = 0;
        for (int j = std::max(0, y - reach); j <= std::min(down - 1, y + reach); ++j) {
          for (int i = std::max(0, x - reach); i <= std::min(across - 1, x + reach); ++i)
            sum += grid[j * across + i], ++count;
        }
        out[y * across + x] = sum / count;
      }
    }
    return out;
  };
  Grid noise(across * down, 0), l(across * down), square(across * down), a(across * down), b(across * down),
      most(across * down, 1e9);
  for (int i = 0; variance.size() > 0 && i < across * down; ++i) noise[i] = variance.data()[i];
  Grid log_noise(across * down);
  for (int i = 0; i < across * down; ++i) {
    noise[i] = std::max(how.limit * std::sqrt(noise[i]), floor_e);
    log_noise[i] = std::log2(noise[i]);
  }
  log_noise = averaged(log_noise);
  for (int i = 0; i < across * down; ++i) {
    noise[i] = std::min(noise[i], std::exp2(log_noise[i]));
    double sum = 0, count = 0;
    for (int y = 4 * (i / across); y < std::min(height, 4 * (i / across) + 4); ++y) {
      for (int x = 4 * (i % across); x < std::min(width, 4 * (i % across) + 4); ++x) sum += luminance(x, y), ++count;
    }
    l[i] = std::log2((std::max(sum / count, 0.0) + noise[i]) / grey);
    square[i] = l[i] * l[i];
  }
  const Grid mean = averaged(l), mean_square = averaged(square);
  for (int i = 0; i < across * down; ++i) {
    const double v = std::max(0.0, mean_square[i] - mean[i] * mean[i]);
    a[i] = v / (v + 0.25);
    b[i] = (1 - a[i]) * mean[i];
  }
  a = averaged(a), b = averaged(b);
  for (int i = 0; variance.size() > 0 && i < across * down; ++i) {  // by bisection of what the header promises
    const double y = std::max(0.0, grey * std::exp2(a[i] * l[i] + b[i]) - noise[i]);
    double low = 0, high = 6;
    if (noise_lightness(y, std::exp2(high), noise[i]) < local_tone_noise) low = high;
    while (high - low > 1e-9) {
      const double ev = (low + high) / 2;
      (noise_lightness(y, std::exp2(ev), noise[i]) < local_tone_noise ? low : high) = ev;
    }
    most[i] = low;
  }
  const Grid own_most = most;
  for (int i = 0; i < across * down; ++i) {
    for (int k = 0; k < 9; ++k) {
      const int x = i % across + k % 3 - 1, y = i / across + k / 3 - 1;
      if (x >= 0 && y >= 0 && x < across && y < down) most[i] = std::max(most[i], own_most[y * across + x]);
    }
  }
  SceneLinear out = copy_of(in);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double px = std::clamp((x + 0.5) / 4 - 0.5, 0.0, across - 1.0),
                   py = std::clamp((y + 0.5) / 4 - 0.5, 0.0, down - 1.0);
      const int x0 = static_cast<int>(px), y0 = static_cast<int>(py), x1 = std::min(x0 + 1, across - 1),
                y1 = std::min(y0 + 1, down - 1);
      const auto at = [&](const Grid& grid) {
        const double top = grid[y0 * across + x0] + (px - x0) * (grid[y0 * across + x1] - grid[y0 * across + x0]);
        const double low = grid[y1 * across + x0] + (px - x0) * (grid[y1 * across + x1] - grid[y1 * across + x0]);
        return top + (py - y0) * (low - top);
      };
      const double base = at(a) * std::log2((std::max(luminance(x, y), 0.0) + at(noise)) / grey) + at(b);
      double ev = expected_ev(how.share, base, how.limit);
      if (base < 0) ev = std::min(ev, at(most));
      for (int c = 0; c < 3; ++c) out.plane[c].at(x, y) = static_cast<float>(in.plane[c].at(x, y) * std::exp2(ev));
    }
  }
  return out;
}

TEST(LocalTone, AgreesWithTheReferenceAtAnySizeAndThreadsChangeNoBit) {
  std::mt19937 random(seed + 1);
  double worst = 0;
  for (int i = 0; i < 40; ++i) {
    const int width = static_cast<int>(log_uniform(random, 1, 400)),
              height = static_cast<int>(log_uniform(random, 1, 400));
    const SceneLinear in = patches(width, height, random);
    const LocalTone how{static_cast<float>(std::uniform_real_distribution<>(0.05, 1)(random)),
                        {0.2f, 0.7f, 0.1f},
                        static_cast<float>(log_uniform(random, 1, 64))};
    Plane<float> variance;
    if (i % 3 != 0) {
      variance = cells_of(width, height, 0);
      for (std::size_t k = 0; k < variance.size(); ++k)
        variance.data()[k] = static_cast<float>(log_uniform(random, 1e-12, 1e-4));
    }
    const SceneLinear out = changed(in, how, variance), expected = reference(in, how, variance);
    for (const int threads : {2, 3, 7}) {
      PoolExecutor pool(threads);
      const SceneLinear again = changed(in, how, variance, pool);
      for (int c = 0; c < 3; ++c) {
        ASSERT_TRUE(std::equal(out.plane[c].data(), out.plane[c].data() + out.plane[c].size(), again.plane[c].data()))
            << width << " x " << height << ", " << threads << " threads";
      }
    }
    for (int c = 0; c < 3; ++c) {
      for (std::size_t k = 0; k < out.plane[c].size(); ++k) {
        const double want = expected.plane[c].data()[k], is = out.plane[c].data()[k];
        worst = std::max(worst, std::fabs(is - want) / std::max(std::fabs(want), 1e-12));
      }
    }
  }
  std::printf("  largest relative difference to the reference: %.2g, seed %u\n", worst, seed + 1);
  EXPECT_LT(worst, 5e-5);
}

TEST(LocalTone, ColoursStayAndNothingIsNoLocalTone) {
  std::mt19937 random(seed + 2);
  const SceneLinear in = patches(160, 120, random);
  const SceneLinear out = changed(in, {.share = 0.7f}, cells_of(160, 120, 1e-6)), same = changed(in, {.share = 0}, {});
  for (std::size_t i = 0; i < in.plane[0].size(); ++i) {
    const double gain = out.plane[0].data()[i] / static_cast<double>(in.plane[0].data()[i]);
    for (int c = 0; c < 3; ++c) {
      ASSERT_NEAR(out.plane[c].data()[i], gain * in.plane[c].data()[i], 1e-6 * std::fabs(out.plane[c].data()[i])) << i;
      ASSERT_EQ(same.plane[c].data()[i], in.plane[c].data()[i]);
    }
  }
}

/// A texture of 0.3 EV keeps nearly all of its contrast; tone by pixels would leave 1 - share / (1 + 4/6)^2.
TEST(LocalTone, TextureInTheShadowsKeepsItsContrast) {
  SceneLinear in(320, 240);
  for (int y = 0; y < 240; ++y) {
    for (int x = 0; x < 320; ++x) {
      const double value = grey / 16 * std::exp2((x / 4 + y / 4) % 2 == 0 ? 0.15 : -0.15);
      for (int c = 0; c < 3; ++c) in.plane[c].at(x, y) = static_cast<float>(value);
    }
  }
  const SceneLinear out = changed(in, {.share = 1}, {});
  const double contrast = std::log2(out.plane[0].at(161, 121) / out.plane[0].at(157, 121));
  std::printf("  contrast %.3f of 0.3 EV\n", std::fabs(contrast));
  EXPECT_GT(std::fabs(contrast), 0.3 * (1 - 0.36 * 0.09));  // a = 0.0225 / (0.0225 + 0.25) = 0.083
  EXPECT_GT(out.plane[0].at(160, 120), 2 * in.plane[0].at(160, 120));
}

/// Next to an edge of 6 EV both sides are changed as far from it, but for a rest.
TEST(LocalTone, EdgesHaveNoHalos) {
  SceneLinear in(800, 80);
  for (int y = 0; y < 80; ++y) {
    for (int x = 0; x < 800; ++x) {
      for (int c = 0; c < 3; ++c) in.plane[c].at(x, y) = static_cast<float>(grey * (x < 400 ? 1.0 / 32 : 2));
    }
  }
  const SceneLinear out = changed(in, {.share = 0.5f}, {});
  const auto ev = [&](int x) { return std::log2(static_cast<double>(out.plane[1].at(x, 40)) / in.plane[1].at(x, 40)); };
  double halo = 0;
  for (int x = 0; x < 400; ++x) halo = std::max(halo, std::fabs(ev(x) - ev(0)));
  for (int x = 400; x < 800; ++x) halo = std::max(halo, std::fabs(ev(x) - ev(799)));
  std::printf("  largest halo %.3f EV of %.3f\n", halo, ev(0));
  EXPECT_GT(ev(0), 1);
  EXPECT_LT(halo, 0.1);
}

/// Noise reduction leaves more noise in the blocks beside a lamp: there the lift is nearly that of the other shadows.
TEST(LocalTone, LampsHaveNoDarkDiscs) {
  SceneLinear in(800, 600);
  Plane<float> variance = cells_of(800, 600, 1e-10);
  for (int y = 0; y < 600; ++y) {
    for (int x = 0; x < 800; ++x) {
      for (int c = 0; c < 3; ++c)
        in.plane[c].at(x, y) = static_cast<float>(grey * (std::hypot(x - 400, y - 300) < 3 ? 8 : 1.0 / 64));
    }
  }
  for (int y = 72; y < 78; ++y) {
    for (int x = 97; x < 103; ++x) variance.at(x, y) = 1e-6F;
  }
  const SceneLinear out = changed(in, {.share = 0.5F}, variance);
  const auto ev = [&](int x) {
    return std::log2(static_cast<double>(out.plane[1].at(x, 300)) / in.plane[1].at(x, 300));
  };
  EXPECT_GT(ev(10), 1);
  for (int x = 404; x < 790; ++x) EXPECT_GT(ev(x), ev(10) - 0.25) << x;
}

TEST(LocalTone, AnyFiniteLightGivesFiniteLight) {
  SceneLinear in = filled(70, 50, 0, 0, 0);
  const float extremes[]{0, -1e30f, 1e30f, std::numeric_limits<float>::denorm_min(), -0.0f, 1, -1e-6f};
  for (int c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < in.plane[c].size(); ++i)
      in.plane[c].data()[i] = extremes[(i * (c + 1)) % std::size(extremes)];
  }
  for (const double variance : {0.0, 1e-38, 1.0, 1e30}) {
    const SceneLinear out = changed(in, {.share = 1, .limit = 4096}, cells_of(70, 50, variance));
    for (int c = 0; c < 3; ++c) {
      for (std::size_t i = 0; i < out.plane[c].size(); ++i) {
        ASSERT_TRUE(std::isfinite(out.plane[c].data()[i])) << variance << " " << in.plane[c].data()[i];
      }
    }
  }
}

}  // namespace
}  // namespace lowlux::isp::local_tone_test
