#include "isp/raw/kernel/demosaic.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <vector>

#include "tests/raw/raw_to_rgb_support.h"
#include "tests/reference/demosaic_ref.h"

namespace lowlux {
namespace {

using isp::Demosaic;
using isp::DemosaicMethod;
using raw_to_rgb_testing::all_phases;
using raw_to_rgb_testing::Strided;
using reference::Rgb;

constexpr std::array encoded_methods{DemosaicMethod::encoded_malvar, DemosaicMethod::residual,
                                     DemosaicMethod::residual_median};

constexpr isp::RgbTransform unchanged_below(float clip) { return {.clip = clip, .move_into_gamut = false}; }

/// Edges and texture in colours that are correlated, as scenes have them, and noise; some samples are saturated or
/// below black.
Strided<float> random_scene(int width, int height, BayerPhase phase, unsigned seed) {
  Strided<float> out(width, height, 3, 1e6f);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> any(0, 1);
  std::normal_distribution<double> normal;
  const double fx = 3 * any(random), fy = 3 * any(random), noise = 0.1 * any(random),
               light = std::pow(10, -2 * any(random));
  const std::array<double, 3> colour{any(random), any(random), any(random)};
  const int edge = static_cast<int>(width * any(random));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double wave = 0.5 + 0.5 * std::sin(fx * x + fy * y),
                   tint = colour[static_cast<std::size_t>(colour_at(phase, x, y))];
      const double value = light * ((x < edge ? 1.3 : 0.4) * wave * tint + noise * normal(random));
      out.view().at(x, y) = static_cast<float>(value);
    }
  }
  return out;
}

std::vector<Strided<float>> kernel_result(const isp::SignedMosaic& in, float clip, int threads = 1) {
  const int width = in.value.width, height = in.value.height;
  InlineExecutor one;
  PoolExecutor pool(threads);
  std::vector<Strided<float>> planes(3, Strided<float>(width, height, 7, -777));
  isp::RawToRgb(width, threads)
      .linear(in, unchanged_below(clip), {planes[0].view(), planes[1].view(), planes[2].view()},
              threads == 1 ? static_cast<Executor&>(one) : pool);
  return planes;
}

struct Distance {
  double largest = 0;
  double squares = 0;
  std::size_t samples = 0;
  void add(double difference) {
    if (!(difference <= largest)) largest = difference;  // not a number counts too
    squares += difference * difference;
    ++samples;
  }
  double rms() const { return std::sqrt(squares / static_cast<double>(samples)); }
};

/// Adds the differences of encoded values: where light is little, less light counts.
void compare(const std::vector<Strided<float>>& planes, const std::vector<Rgb>& expected, float clip,
             const Demosaic& how, Distance& out) {
  const double offset = std::clamp<double>(how.offset, 1e-6, 1), root = std::cbrt(offset);
  const auto encoded = [&](double x) { return x < 0 ? root + x / (3 * root * root) : std::cbrt(x + offset); };
  for (int c = 0; c < 3; ++c) {
    const auto plane = planes[static_cast<std::size_t>(c)].view();
    for (int y = 0; y < plane.height; ++y) {
      for (int x = 0; x < plane.width; ++x) {
        const double want = std::min<double>(
            expected[static_cast<std::size_t>(y) * static_cast<std::size_t>(plane.width) + static_cast<std::size_t>(x)]
                    [static_cast<std::size_t>(c)],
            clip);
        out.add(std::fabs(encoded(plane.at(x, y)) - encoded(want)));
      }
    }
  }
}

std::vector<std::array<int, 2>> sizes() {
  std::vector<std::array<int, 2>> out;
  for (int w = 1; w <= 6; ++w) {
    for (int h = 1; h <= 6; ++h) out.push_back({w, h});
  }
  for (const auto& size : {std::array{15, 4}, {4, 15}, {33, 31}, {63, 40}, {1023, 3}, {1025, 2}, {2051, 5}, {3, 130}}) {
    out.push_back(size);
  }
  return out;
}

/// Largest and root mean square difference of codes. Rounding of 1e-7 adds up to 5e-6 in a sum of gradients, which is a
/// tenth of the least floor of 3e-5: where sides have no gradient at all, as in frames of a few pixels, weights differ
/// by as much, and the mean by a fiftieth of what the sides differ.
constexpr double max_tolerance = 1e-3, rms_tolerance = 2e-6;

TEST(Demosaic, EqualsTheReferenceInEveryPhaseAndSize) {
  Distance all;
  for (const BayerPhase phase : all_phases) {
    for (const auto& [w, h] : sizes()) {
      for (const DemosaicMethod method : encoded_methods) {
        SCOPED_TRACE(testing::Message() << "phase " << static_cast<int>(phase) << ", " << w << " x " << h << ", "
                                        << name_of(method));
        const Strided<float> value = random_scene(w, h, phase, static_cast<unsigned>(100 * w + h));
        const Demosaic how{method, 2e-3f, w % 2 == 0 ? 1.0f : 0.02f, h % 2 == 0 ? 0.0f : 0.01f};
        const isp::SignedMosaic in{value.view(), phase, {1.0f, 0.8f, 0.81f, 0.9f}, how};
        const float clip = h % 3 == 0 ? std::numeric_limits<float>::infinity() : 0.5f;
        Distance distance;
        compare(kernel_result(in, clip), reference::demosaiced(reference::linearised(in), how, clip), clip, how,
                distance);
        EXPECT_LT(distance.largest, max_tolerance);
        all.squares += distance.squares;
        all.samples += distance.samples;
      }
    }
  }
  EXPECT_LT(all.rms(), rms_tolerance);
}

TEST(Demosaic, GivesTheSameBytesWithAnyNumberOfThreads) {
  for (const auto& [w, h] : {std::array{101, 75}, {1030, 19}, {64, 2}, {7, 1}}) {
    const Strided<float> value = random_scene(w, h, BayerPhase::gbrg, 7);
    for (const DemosaicMethod method : encoded_methods) {
      const isp::SignedMosaic in{value.view(), BayerPhase::gbrg, {1, 1, 1, 1}, {method, 1e-3f, 1, 0}};
      const auto expected = kernel_result(in, 1);
      for (const int threads : {2, 3, 7}) {
        const auto shared = kernel_result(in, 1, threads);
        for (std::size_t c = 0; c < 3; ++c) {
          EXPECT_EQ(shared[c].memory, expected[c].memory) << name_of(method) << ", " << threads << " threads";
        }
      }
    }
  }
}

TEST(Demosaic, GivesTheSameBitsInATileWithAMarginOf12Pixels) {
  constexpr int width = 1400, height = 90;
  const Strided<float> value = random_scene(width, height, BayerPhase::grbg, 11);
  std::mt19937 random(5);
  for (const DemosaicMethod method : encoded_methods) {
    const Demosaic how{method, 1e-3f, 1, 0.001f};
    const auto whole = kernel_result({value.view(), BayerPhase::grbg, {1, 1, 1, 1}, how}, 1);
    for (int i = 0; i < 20; ++i) {
      const int x = 2 * static_cast<int>(random() % 500), y = 2 * static_cast<int>(random() % 20);
      const int w = 40 + static_cast<int>(random() % 300), h = 30 + static_cast<int>(random() % 20);
      const auto tile = kernel_result({value.view().crop(x, y, w, h), BayerPhase::grbg, {1, 1, 1, 1}, how}, 1);
      constexpr int margin = 12;
      for (int c = 0; c < 3; ++c) {
        for (int row = margin; row < h - margin; ++row) {
          for (int column = margin; column < w - margin; ++column) {
            ASSERT_EQ(tile[static_cast<std::size_t>(c)].view().at(column, row),
                      whole[static_cast<std::size_t>(c)].view().at(x + column, y + row))
                << name_of(method) << ", tile " << x << ' ' << y << ' ' << w << ' ' << h;
          }
        }
      }
    }
  }
}

TEST(Demosaic, KeepsMeasuredSamplesBitForBit) {
  constexpr int width = 130, height = 37;
  for (const BayerPhase phase : all_phases) {
    const Strided<float> value = random_scene(width, height, phase, 3);
    for (const DemosaicMethod method : encoded_methods) {
      const auto planes = kernel_result({value.view(), phase, {1, 1, 1, 1}, {method, 1e-3f, 1, 0}},
                                        std::numeric_limits<float>::infinity());
      for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
          const auto measured = static_cast<std::size_t>(colour_at(phase, x, y));
          ASSERT_EQ(planes[measured].view().at(x, y), value.view().at(x, y)) << name_of(method);
        }
      }
    }
  }
}

TEST(Demosaic, KeepsFlatFramesFlatAtAnyLevel) {
  std::mt19937 random(17);
  std::uniform_real_distribution<double> log_level(-5, 0);
  for (int i = 0; i < 40; ++i) {
    const auto level = static_cast<float>((i % 4 == 0 ? -0.02 : 1) * std::pow(10, log_level(random)));
    Strided<float> value(41, 27, 0, level);
    for (const DemosaicMethod method : encoded_methods) {
      const auto planes = kernel_result({value.view(), BayerPhase::rggb, {1, 1, 1, 1}, {method, 1e-3f, 1, 0}}, 1);
      for (const auto& plane : planes) {
        // Encoding and decoding round to about 1e-6 of the value plus the offset.
        for (const float out : plane.memory) {
          if (out == -777) continue;  // beyond the row
          ASSERT_NEAR(out, level, 3e-6 * (std::fabs(level) + 1e-3)) << name_of(method);
        }
      }
    }
  }
}

TEST(Demosaic, ScalesWithTheLightWhereOffsetAndWhiteDo) {
  constexpr int width = 90, height = 70;
  const Strided<float> value = random_scene(width, height, BayerPhase::rggb, 23);
  for (const DemosaicMethod method : encoded_methods) {
    const auto bright = kernel_result({value.view(), BayerPhase::rggb, {1, 1, 1, 1}, {method, 1e-2f, 1, 0}},
                                      std::numeric_limits<float>::infinity());
    constexpr float factor = 1.0f / 64;
    const auto dim = kernel_result(
        {value.view(), BayerPhase::rggb, {factor, factor, factor, factor}, {method, 1e-2f * factor, factor, 0}},
        std::numeric_limits<float>::infinity());
    for (std::size_t c = 0; c < 3; ++c) {
      for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
          ASSERT_NEAR(dim[c].view().at(x, y) / factor, bright[c].view().at(x, y), 2e-4) << name_of(method);
        }
      }
    }
  }
}

TEST(Demosaic, StaysFiniteForAnySamplesAndParameters) {
  std::mt19937 random(29);
  constexpr float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
  const std::array<float, 12> odd{nan, infinity, -infinity, 0, -0.0f, 1e-40f, -1e-40f, 1e9f, -1e9f, 3e38f, 1, -1};
  const auto any = [&] { return odd[random() % odd.size()]; };
  for (int i = 0; i < 200; ++i) {
    const int width = 1 + static_cast<int>(random() % 40), height = 1 + static_cast<int>(random() % 30);
    Strided<float> value(width, height, 0, 0);
    for (float& v : value.memory) v = random() % 3 == 0 ? any() : static_cast<float>(random() % 1000) * 1e-3f;
    for (const DemosaicMethod method : encoded_methods) {
      const Demosaic how{method, any(), any(), any()};
      const isp::SignedMosaic in{value.view(), all_phases[random() % 4], {any(), 1, any(), 64}, how};
      for (const auto& plane : kernel_result(in, random() % 2 == 0 ? 1 : std::fabs(any()))) {
        for (const float out : plane.memory) ASSERT_TRUE(std::isfinite(out)) << name_of(method);
      }
    }
  }
}

/// Returns a mosaic whose sites have the values light(x, y, colour).
template <class Light>
Strided<float> mosaic_of(int width, int height, BayerPhase phase, const Light& light) {
  Strided<float> out(width, height, 0, 0);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) out.view().at(x, y) = light(x, y, colour_at(phase, x & 1, y & 1));
  }
  return out;
}

// Detail of red and blue that green does not share shall not become a mesh of greens.
TEST(Demosaic, KeepsFlatGreenFlatAmongTextureOfRedAndBlue) {
  std::mt19937 random(31);
  std::uniform_real_distribution<float> log_level(-2, -0.3f), any(0, 1);
  for (int i = 0; i < 24; ++i) {
    const float green = std::pow(10.0f, log_level(random)), texture = std::pow(10.0f, log_level(random));
    const BayerPhase phase = all_phases[i % 4];
    const Strided<float> value = mosaic_of(64, 48, phase, [&](int, int, CfaColour colour) {
      return colour == CfaColour::green ? green : texture * (0.05f + 0.95f * any(random));
    });
    for (const DemosaicMethod method : {DemosaicMethod::residual, DemosaicMethod::residual_median}) {
      const auto planes = kernel_result({value.view(), phase, {1, 1, 1, 1}, {method, 1e-3f, 1, 0}}, 1);
      for (const float out : planes[1].memory) {
        if (out == -777) continue;  // beyond the row
        ASSERT_NEAR(out, green, 0.01f * green) << name_of(method) << ", texture up to " << texture;
      }
    }
  }
}

// Detail of grey is that of all colours: green at red and blue is then far better than the mean of the greens beside.
TEST(Demosaic, TakesTheDetailOfGreyTextureFromEveryColour) {
  constexpr int width = 64, height = 48;
  std::mt19937 random(37);
  const auto drawn = [&](float low, float high) { return std::uniform_real_distribution<float>(low, high)(random); };
  for (int i = 0; i < 12; ++i) {
    const float level = drawn(0.02f, 0.5f);
    Strided<float> scene(width, height, 0, 0);
    // Radians per pixel: oblique stripes of 4.5 to 5.2 px along both axes, and steep ones of 3.3 to 3.8 px along the
    // row.
    const bool oblique = i % 2 == 0;
    const float turn_x = oblique ? drawn(1.2f, 1.4f) : drawn(1.65f, 1.9f);
    const float turn_y = oblique ? drawn(1.2f, 1.4f) : drawn(0.4f, 0.6f);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const float phase = turn_x * static_cast<float>(x) + turn_y * static_cast<float>(y);
        scene.view().at(x, y) = level * (1 + 0.4f * std::sin(phase));
      }
    }
    const auto at = [&](int x, int y) { return scene.view().at(x, y); };
    const Strided<float> value =
        mosaic_of(width, height, BayerPhase::grbg, [&](int x, int y, CfaColour) { return at(x, y); });
    const isp::SignedMosaic in{value.view(), BayerPhase::grbg, {1, 1, 1, 1}, {DemosaicMethod::residual, 1e-3f, 1, 0}};
    const auto planes = kernel_result(in, 1);
    Distance found, of_mean;
    for (int y = 8; y < height - 8; ++y) {
      for (int x = 8; x < width - 8; ++x) {
        if (colour_at(BayerPhase::grbg, x & 1, y & 1) == CfaColour::green) continue;
        found.add(std::fabs(planes[1].view().at(x, y) - at(x, y)));
        of_mean.add(std::fabs((at(x - 1, y) + at(x + 1, y) + at(x, y - 1) + at(x, y + 1)) / 4 - at(x, y)));
      }
    }
    EXPECT_LT(found.rms(), (oblique ? 0.25 : 0.05) * of_mean.rms())
        << "level " << level << ", " << turn_x << ", " << turn_y;
  }
}

/// Sum of the distances of red and blue from green.
double colour_of(const std::vector<Strided<float>>& planes) {
  double sum = 0;
  for (int y = 0; y < planes[0].height; ++y) {
    for (int x = 0; x < planes[0].width; ++x) {
      const float g = planes[1].view().at(x, y);
      sum += std::fabs(planes[0].view().at(x, y) - g) + std::fabs(planes[2].view().at(x, y) - g);
    }
  }
  return sum;
}

TEST(Demosaic, LeavesLessColourAroundSaturatedLampsThanLinearFilters) {
  constexpr int width = 80, height = 60;
  for (const double radius : {0.5, 3.0, 12.0}) {
    Strided<float> value(width, height, 0, 0);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {  // a lamp a thousand times brighter than its grey surroundings, behind a lens
        const double beyond = std::hypot(x - 40.3, y - 29.6) - radius;
        const double light = 0.005 + 5 / (1 + std::exp(beyond / 0.5));
        // Each channel saturates at its white balance gain.
        constexpr PerSite<double> saturation{2, 1, 1, 1.5};
        value.view().at(x, y) =
            static_cast<float>(std::min(light, saturation[static_cast<std::size_t>(site_of(x, y))]));
      }
    }
    const auto colour_by = [&](DemosaicMethod method) {
      return colour_of(kernel_result({value.view(), BayerPhase::rggb, {1, 1, 1, 1}, {method, 1e-3f, 1, 0}}, 1));
    };
    const double linear = colour_by(DemosaicMethod::malvar);
    RecordProperty("malvar", std::to_string(linear));
    EXPECT_LT(colour_by(DemosaicMethod::residual), 0.6 * linear) << radius;
    EXPECT_LT(colour_by(DemosaicMethod::residual_median), 0.6 * linear) << radius;
  }
}

}  // namespace
}  // namespace lowlux
