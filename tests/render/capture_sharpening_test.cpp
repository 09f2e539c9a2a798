#include "isp/render/capture_sharpening.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "tests/support/executors.h"

namespace lowlux::isp::capture_sharpening_test {
namespace {

constexpr int width = 192, height = 160;

SceneLinear copy_of(const SceneLinear& in) {
  SceneLinear out;
  for (int c = 0; c < 3; ++c) out.plane[c] = in.plane[c].clone();
  return out;
}

Plane<float> variance_plane(double variance) {
  Plane<float> out((width + 3) / 4, (height + 3) / 4);
  std::fill_n(out.data(), out.size(), static_cast<float>(variance));
  return out;
}

SceneLinear sharpened(const SceneLinear& in, const CaptureSharpening& how, double variance,
                      Executor& executor = test::one_thread) {
  SceneLinear out = copy_of(in);
  const Plane<float> noise = variance_plane(variance);
  sharpen_capture(how, noise.view(), out.view(), executor);
  return out;
}

/// Returns grey of `level` with independent noise in each pixel and channel.
SceneLinear noise_image(double level, double std, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal(static_cast<float>(level), static_cast<float>(std));
  SceneLinear out(width, height);
  for (auto& plane : out.plane) {
    for (std::size_t i = 0; i < plane.size(); ++i) plane.data()[i] = normal(random);
  }
  return out;
}

double luminance(const SceneLinear& in, int x, int y) {
  return 0.25 * in.plane[0].at(x, y) + 0.5 * in.plane[1].at(x, y) + 0.25 * in.plane[2].at(x, y);
}

double variance_of(const SceneLinear& in) {
  double sum = 0, squares = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double v = luminance(in, x, y);
      sum += v, squares += v * v;
    }
  }
  const double n = width * height;
  return squares / n - (sum / n) * (sum / n);
}

constexpr double luminance_fraction = 0.25 * 0.25 + 0.5 * 0.5 + 0.25 * 0.25;  // of independent channels

TEST(CaptureSharpening, TheNoiseOfAFlatImageIsNotRaised) {
  for (const float blur : {0.3f, 0.6f, 0.9f, 1.5f}) {
    for (const double std : {1e-4, 3e-3, 0.05}) {
      for (const double level : {0.0, 0.3}) {
        const SceneLinear in = noise_image(level, std, 5);
        const double before = variance_of(in);
        const double after = variance_of(sharpened(in, {.blur_px = blur}, std * std * luminance_fraction));
        EXPECT_LE(after, 1.01 * before) << blur << " " << std << " seed 5";
        EXPECT_GE(after, before) << "sharpening takes nothing away";
      }
    }
  }
}

/// Returns bars, a disc and a fine grating.
double scene(double x, double y) {
  const double bars = std::fmod(x, 23) < 9 ? 0.55 : 0.12, disc = std::hypot(x - 120, y - 80) < 30 ? 0.25 : 0;
  const double grating = y > 120 ? 0.1 * std::sin(2 * std::numbers::pi * x / 5) : 0;
  return bars + disc + grating;
}

/// Returns the scene through pixels, and then a Gaussian blur by its definition, in double.
SceneLinear blurred_scene(double blur) {
  std::vector<double> sharp(static_cast<std::size_t>(width) * height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      double sum = 0;
      for (int k = 0; k < 64; ++k) sum += scene(x + (k % 8) / 8.0 - 0.4375, y + (k / 8) / 8.0 - 0.4375) / 64;
      sharp[static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x)] = sum;
    }
  }
  const int reach = static_cast<int>(std::ceil(5 * blur));
  SceneLinear out(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      double sum = 0, weights = 0;
      for (int j = -reach; j <= reach; ++j) {
        for (int i = -reach; i <= reach; ++i) {
          const double w = blur > 0 ? std::exp(-0.5 * (i * i + j * j) / (blur * blur)) : (i == 0 && j == 0);
          const int u = std::clamp(x + i, 0, width - 1), v = std::clamp(y + j, 0, height - 1);
          sum += w * sharp[static_cast<std::size_t>(v) * width + static_cast<std::size_t>(u)], weights += w;
        }
      }
      for (int c = 0; c < 3; ++c) out.plane[c].at(x, y) = static_cast<float>(sum / weights);
    }
  }
  return out;
}

double rms(const SceneLinear& a, const SceneLinear& b) {
  double sum = 0;
  for (int y = 8; y < height - 8; ++y) {
    for (int x = 8; x < width - 8; ++x) sum += std::pow(luminance(a, x, y) - luminance(b, x, y), 2);
  }
  return std::sqrt(sum / ((width - 16) * (height - 16)));
}

void add_noise(SceneLinear& image, double std, unsigned seed) {
  const SceneLinear noise = noise_image(0, std, seed);
  for (int c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < noise.plane[c].size(); ++i) image.plane[c].data()[i] += noise.plane[c].data()[i];
  }
}

TEST(CaptureSharpening, EdgesOfAKnownBlurComeNearerToTheTruth) {
  const SceneLinear truth = blurred_scene(0);
  for (const double blur : {0.5, 0.7, 1.0}) {
    for (const double std : {1e-4, 0.005, 0.02}) {
      SceneLinear in = blurred_scene(blur);
      add_noise(in, std, 17);
      const SceneLinear out = sharpened(in, {.blur_px = static_cast<float>(blur)}, std * std * luminance_fraction);
      const double before = rms(in, truth), after = rms(out, truth);
      std::printf("  blur %.1f px, noise %.4f: rms %.4f, sharpened %.4f\n", blur, std, before, after);
      // At 0.02 most detail that blur took is below the noise, and is left.
      EXPECT_LT(after, (std < 0.01 ? 0.65 : 0.95) * before) << blur << " " << std << " seed 17";
    }
  }
}

TEST(CaptureSharpening, TheNoiseGainIsTheMeanSquareOfTheFiltersResponse) {
  for (const double blur : {0.8, 1.1, 1.5}) {  // wide enough for the sampled Gaussian to have a Gaussian response
    constexpr int n = 400;
    double sum = 0;
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) {
        const double u = std::numbers::pi * (i + 0.5) / n, v = std::numbers::pi * (j + 0.5) / n;
        const double left = std::exp(-0.5 * blur * blur * (u * u + v * v)), rest = 1 - left;
        sum += std::pow(1.5 * left * (rest + rest * rest + rest * rest * rest), 2);
      }
    }
    const double expected = sum / (n * n);
    EXPECT_NEAR(detail_noise_gain(static_cast<float>(blur)), expected, 0.05 * expected) << blur;  // aliasing at 0.8
  }
}

TEST(CaptureSharpening, LeavesTheFinestWavesNearlyAsTheyAre) {
  SceneLinear in(width, height);  // as errors of demosaicing along edges
  for (auto& plane : in.plane) {
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) plane.at(x, y) = 0.4f + ((x + y) % 2 == 0 ? 0.05f : -0.05f);
    }
  }
  // The response of the sampled Gaussian to this wave, squared because it is along both axes; without the factor H the
  // wave would be 3.4 times as strong for 0.6 px.
  for (const double blur : {0.5, 0.6, 1.0}) {
    double sum = 1, alternating = 1;
    for (int i = 1; i <= std::ceil(3.5 * blur); ++i) {
      const double coefficient = 2 * std::exp(-0.5 * i * i / (blur * blur));
      sum += coefficient, alternating += i % 2 == 0 ? coefficient : -coefficient;
    }
    const double left = std::pow(alternating / sum, 2), rest = 1 - left;
    const double gain = 1 + 1.5 * left * (rest + rest * rest + rest * rest * rest);
    EXPECT_LT(gain, 1.75);
    const double before = variance_of(in);
    EXPECT_NEAR(std::sqrt(variance_of(sharpened(in, {.blur_px = static_cast<float>(blur)}, 1e-12)) / before), gain,
                0.01);
  }
}

TEST(CaptureSharpening, ColourDifferencesStay) {
  SceneLinear in = blurred_scene(0.7);
  for (std::size_t i = 0; i < in.plane[0].size(); ++i) in.plane[0].data()[i] *= 1.7f;
  const SceneLinear out = sharpened(in, {.blur_px = 0.7f}, 1e-9);
  double changed = 0;
  for (std::size_t i = 0; i < in.plane[0].size(); ++i) {
    const auto difference = [&](const SceneLinear& of) { return of.plane[0].data()[i] - of.plane[1].data()[i]; };
    EXPECT_NEAR(difference(out), difference(in), 1e-6);
    changed = std::max<double>(changed, std::fabs(out.plane[1].data()[i] - in.plane[1].data()[i]));
  }
  EXPECT_GT(changed, 0.02);
}

TEST(CaptureSharpening, PixelsNearSaturationKeepTheirBits) {
  SceneLinear in = blurred_scene(0.6);
  for (auto& plane : in.plane) plane.at(60, 60) = 1;
  const SceneLinear out = sharpened(in, {.blur_px = 0.6f}, 1e-9);
  for (int c = 0; c < 3; ++c) {
    for (int y = 55; y <= 65; ++y) {
      for (int x = 55; x <= 65; ++x) EXPECT_EQ(out.plane[c].at(x, y), in.plane[c].at(x, y));
    }
  }
}

// A bright point on a dark background, and a hard edge between two strong colours.
TEST(CaptureSharpening, LeavesNoDarkRingsOrLines) {
  SceneLinear in(64, 64);
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) {
      const double away = std::hypot(x - 16, y - 32);
      const auto star = static_cast<float>(0.5 * std::exp(-0.5 * away * away / 0.64));
      const auto edge = static_cast<float>(1 / (1 + std::exp((x - 48) / 0.4)));
      in.plane[0].at(x, y) = 0.01F + star + 0.3F * (1 - edge);
      in.plane[1].at(x, y) = 0.01F + star;
      in.plane[2].at(x, y) = 0.01F + star + 0.6F * edge * (x > 32 ? 1 : 0);
    }
  }
  for (const float blur : {0.6F, 1.0F, 1.5F}) {
    const SceneLinear out = sharpened(in, {.blur_px = blur}, 1e-12);
    for (int c = 0; c < 3; ++c) {
      for (std::size_t i = 0; i < out.plane[c].size(); ++i) ASSERT_GE(out.plane[c].data()[i], 0.74F * 0.01F) << blur;
    }
    EXPECT_GT(out.plane[1].at(16, 32), 1.05F * in.plane[1].at(16, 32)) << "the point is sharpened";
  }
}

TEST(CaptureSharpening, APixelThatIsNoNumberChangesNoOther) {
  SceneLinear in(40, 40);
  for (auto& plane : in.plane) {
    std::fill_n(plane.data(), plane.size(), 0.2F);
    plane.at(20, 20) = std::numeric_limits<float>::quiet_NaN();
  }
  const SceneLinear out = sharpened(in, {.blur_px = 0.6F}, 1e-6);
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < 40; ++y) {
      for (int x = 0; x < 40; ++x) {
        if (x == 20 && y == 20) continue;
        ASSERT_EQ(out.plane[c].at(x, y), 0.2F) << x << " " << y;
      }
    }
  }
}

TEST(CaptureSharpening, BeginsGraduallyAwayFromSaturation) {
  SceneLinear in(160, 16);  // a line of constant contrast that ends in a saturated place
  for (int y = 0; y < 16; ++y) {
    for (int x = 0; x < 160; ++x) {
      const auto line = static_cast<float>(std::exp(-0.5 * (y - 8) * (y - 8) / 0.36));
      for (int c = 0; c < 3; ++c) in.plane[c].at(x, y) = x < 4 ? 1.0F : 0.2F + 0.3F * line;
    }
  }
  const SceneLinear out = sharpened(in, {.blur_px = 0.6F}, 1e-12);
  const auto change = [&](int x) { return out.plane[1].at(x, 8) - in.plane[1].at(x, 8); };
  EXPECT_EQ(change(10), 0);
  const float full = change(120);
  EXPECT_GT(full, 0.02F);
  for (int x = 4; x < 150; ++x) EXPECT_LT(std::fabs(change(x + 1) - change(x)), full / 6) << x;
}

TEST(CaptureSharpening, ThreadsChangeNothing) {
  SceneLinear in = blurred_scene(0.6);
  add_noise(in, 0.01, 3);
  PoolExecutor three(3);
  const SceneLinear one = sharpened(in, {}, 4e-5), several = sharpened(in, {}, 4e-5, three);
  for (int c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < one.plane[c].size(); ++i) ASSERT_EQ(one.plane[c].data()[i], several.plane[c].data()[i]);
  }
}

}  // namespace
}  // namespace lowlux::isp::capture_sharpening_test
