#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>

#include "isp/raw/kernel/demosaic.h"
#include "tests/hard_cases/hard_case.h"
#include "tests/reference/demosaic_ref.h"
#include "tests/support/float_mode.h"

namespace lowlux::hard_cases {
namespace {

using isp::DemosaicMethod;

constexpr std::string_view demosaic_group = "Demosaicing";
constexpr std::string_view oracle = "plain double of every method";
constexpr std::string_view unit = "of the cube root of white";
constexpr std::string_view same_kernel = "the same kernels as in the columns of instruction sets";
constexpr std::array phases{BayerPhase::rggb, BayerPhase::grbg, BayerPhase::gbrg, BayerPhase::bggr};

/// Value of a mosaic at a column and row of a phase.
using Scene = std::function<double(BayerPhase phase, int x, int y)>;

/// Largest difference of codes cbrt(x + 0.001) from plain double, over all methods.
double distance(const isp::SignedMosaic& mosaic, DemosaicMethod method, float clip, Denormals mode) {
  isp::SignedMosaic in = mosaic;
  in.demosaic = {.method = method, .offset = 1e-3f};
  const int width = in.value.width, height = in.value.height;
  PoolExecutor pool(2);
  test::ExecutorInMode executor(pool, mode);
  SceneLinear out(width, height);
  in_mode(mode,
          [&] { isp::RawToRgb(width, 2).linear(in, {.clip = clip, .move_into_gamut = false}, out.view(), executor); });
  const auto expected = reference::demosaiced(reference::linearised(in), in.demosaic, clip);
  const auto code = [](double x) { return x < 0 ? 0.1 + x / 0.03 : std::cbrt(x + 1e-3); };
  double worst = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const auto& want =
          expected[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
      for (std::size_t c = 0; c < 3; ++c) {
        const double found = out.plane[c].at(x, y);
        keep_worst(worst, std::abs(code(found) - code(std::min<double>(want[c], clip))));
      }
    }
  }
  return worst;
}

double distance_of(const Scene& scene, int width, int height, Denormals mode, const PerSite<float>& gain = {1, 1, 1, 1},
                   float clip = 1) {
  double worst = 0;
  for (const BayerPhase phase : phases) {
    Plane<float> mosaic(width, height);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) mosaic.at(x, y) = static_cast<float>(scene(phase, x, y));
    }
    for (const DemosaicMethod method : isp::all_demosaic_methods) {
      keep_worst(worst, distance({mosaic.view(), phase, gain}, method, clip, mode));
    }
  }
  return worst;
}

void measure(std::string_view name, const Bound& bound, const Measure& error) {
  HardCase row({demosaic_group, name, oracle, unit});
  row.none(Path::reference, "is the reference itself").none(levels, "demosaicing comes after");
  row.on_each_set(bound, error);
  row.none(pipelines, same_kernel);
}

double scattered(int x, int y) { return ((x * 40503U) ^ (y * 30011U)) % 1000U * 1e-3; }

// Gradients of opposite sides that are alike to rounding weigh as much as the floor of 1e-4 lets them.
constexpr Bound rounding_bound{5e-5, rounding};

TEST(HardCaseDemosaic, FramesOfOneRowOrColumn) {
  measure("frames of 1 x 1 to 1 x 40 and 40 x 1", rounding_bound, [](Denormals m) {
    double worst = 0;
    for (const int n : {1, 2, 3, 7, 12, 13, 40}) {
      const Scene scene = [](BayerPhase, int x, int y) { return scattered(x, y); };
      keep_worst(worst, distance_of(scene, n, 1, m));
      keep_worst(worst, distance_of(scene, 1, n, m));
    }
    return worst;
  });
}

TEST(HardCaseDemosaic, SaturatedFramesAndChannels) {
  measure("all samples saturated; one colour saturated everywhere", rounding_bound, [](Denormals m) {
    double worst = distance_of([](BayerPhase, int, int) { return 3.0; }, 40, 30, m);
    for (const CfaColour colour : {CfaColour::red, CfaColour::green, CfaColour::blue}) {
      const Scene scene = [colour](BayerPhase phase, int x, int y) {
        return colour_at(phase, x, y) == colour ? 3.0 : 0.2 * scattered(x, y);
      };
      keep_worst(worst, distance_of(scene, 40, 30, m));
    }
    return worst;
  });
}

TEST(HardCaseDemosaic, OneBrightSite) {
  measure("one site a hundred thousand times brighter than the rest", rounding_bound, [](Denormals m) {
    double worst = 0;
    for (int site = 0; site < 4; ++site) {
      const Scene scene = [site](BayerPhase, int x, int y) {
        return x == 20 + (site & 1) && y == 14 + site / 2 ? 1.0 : 1e-5;
      };
      keep_worst(worst, distance_of(scene, 41, 29, m));
    }
    return worst;
  });
}

TEST(HardCaseDemosaic, CheckerboardsAndLinesAtNyquist) {
  measure("checkerboards, rows and columns at the Nyquist frequency, every phase", rounding_bound, [](Denormals m) {
    double worst = 0;
    for (const double low : {0.0, 0.3}) {
      keep_worst(worst,
                 distance_of([low](BayerPhase, int x, int y) { return ((x + y) & 1) != 0 ? 0.9 : low; }, 40, 30, m));
      keep_worst(worst, distance_of([low](BayerPhase, int x, int) { return (x & 1) != 0 ? 0.9 : low; }, 40, 30, m));
      keep_worst(worst, distance_of([low](BayerPhase, int, int y) { return (y & 1) != 0 ? 0.9 : low; }, 40, 30, m));
    }
    return worst;
  });
}

TEST(HardCaseDemosaic, ValuesBelowBlack) {
  measure("values of -0.3 to 0, and around 0 by denormals",
          {1e-3, "rounding, and below black codes have a slope of 33"}, [](Denormals m) {
            double worst = distance_of([](BayerPhase, int x, int y) { return -0.3 * scattered(x, y); }, 40, 30, m);
            keep_worst(worst, distance_of([](BayerPhase, int x, int y) { return 1e-40 * (scattered(x, y) - 0.5); }, 40,
                                          30, m));
            return worst;
          });
}

TEST(HardCaseDemosaic, WhiteBalanceGainsFromOne64thTo64) {
  measure("white balance gains of 1/64 to 64", {1e-3, "rounding, of codes up to 4"}, [](Denormals m) {
    double worst = 0;
    const Scene scene = [](BayerPhase, int x, int y) { return scattered(x, y); };
    for (const PerSite<float>& gain :
         {PerSite<float>{64, 1, 1, 1.0f / 64}, PerSite<float>{1.0f / 64, 64, 64, 1}, PerSite<float>{1, 1, 1, 64}}) {
      keep_worst(worst, distance_of(scene, 40, 30, m, gain));
      keep_worst(worst, distance_of(scene, 40, 30, m, gain, std::numeric_limits<float>::infinity()));
    }
    return worst;
  });
}

}  // namespace
}  // namespace lowlux::hard_cases
