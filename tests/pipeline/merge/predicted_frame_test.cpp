#include "isp/pipeline/merge/predicted_frame.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <utility>

#include "isp/merge/add_to_mean.h"
#include "isp/merge/motion.h"
#include "tests/pipeline/merge/merge_bursts.h"
#include "tests/support/executors.h"

namespace lowlux::isp {
namespace {

using test::Burst;

constexpr int frames = 12;

Burst scene(int width, int height) {
  Burst burst{.width = width, .height = height, .mean_e = 20};
  burst.scene = [](double x, double y, int colour) {
    return (1 + 0.3 * colour) * (20 + 8 * std::sin(0.9 * x + 0.4 * y) * std::sin(0.11 * x - 0.2 * y));
  };
  return burst;
}

/// Returns the mean of noisy frames whose displacements cover every pixel in all colours.
merge::ColourMean mean_of_frames(const Burst& burst, const CameraRgb& nothing) {
  merge::ColourMean mean(burst.width, burst.height);
  for (int i = 0; i < frames; ++i) {
    const double dx = 0.37 * i - 2, dy = 0.61 * i - 3;
    Plane<float> expected(burst.width, burst.height);
    for (int y = 0; y < burst.height; ++y) {
      for (int x = 0; x < burst.width; ++x) {
        const auto colour = static_cast<int>(colour_at(BayerPhase::grbg, x, y));
        expected.at(x, y) = static_cast<float>(burst.scene(x - dx, y - dy, colour));
      }
    }
    const Plane<float> frame = test::noisy_frame(expected, 0, burst.read_noise_e, 9, static_cast<std::uint32_t>(i));
    merge::Motion motion = merge::no_motion(burst.width, burst.height);
    for (std::size_t k = 0; k < motion.dx_px.size(); ++k) {
      motion.dx_px.data()[k] = static_cast<float>(dx);
      motion.dy_px.data()[k] = static_cast<float>(dy);
    }
    merge::add_colour_drops(frame.view(), BayerPhase::grbg, motion, nothing.view(), {}, mean, test::one_thread);
  }
  return mean;
}

CameraRgb black(const Burst& burst) {
  CameraRgb out;
  for (Plane<float>& plane : out.plane) {
    plane = Plane<float>(burst.width, burst.height);
    std::fill_n(plane.data(), plane.size(), 0.0F);
  }
  return out;
}

CameraRgb predicted(const Burst& burst, Executor& executor) {
  const RawFrame frame = burst.frame(0);
  const auto reference = frame_electrons(frame, burst.options(), executor);
  EXPECT_TRUE(reference);
  CameraRgb out = black(burst);
  const merge::ColourMean mean = mean_of_frames(burst, out);
  EXPECT_TRUE(predict_electrons(mean, *reference, frame, burst.options(), out, executor));
  return out;
}

TEST(PredictedFrame, AMeanOfAllColoursIsDevelopedInElectronsOfAFrame) {
  const Burst burst = scene(257, 190);
  const CameraRgb found = predicted(burst, test::one_thread);
  constexpr int border = 12;
  for (std::size_t c = 0; c < 3; ++c) {
    double sum = 0, squares = 0, truth = 0, pixels = 0;
    for (int y = border; y < burst.height - border; ++y) {
      for (int x = border; x < burst.width - border; ++x) {
        const double expected = burst.scene(x, y, static_cast<int>(c));
        const double error = static_cast<double>(found.plane[c].at(x, y)) - expected;
        sum += error;
        squares += error * error;
        truth += expected;
        pixels += 1;
      }
    }
    const double samples = frames * pixels * (c == 1 ? 0.5 : 0.25), variance = truth / pixels + 4;
    std::printf("colour %zu: mean error %.4f e-, rms %.3f e-, noise of the mean %.3f e-\n", c, sum / pixels,
                std::sqrt(squares / pixels), std::sqrt(variance * pixels / samples));
    EXPECT_NEAR(sum / pixels, 0, 5 * std::sqrt(variance / samples) + 0.002 * truth / pixels) << c;
    EXPECT_LT(squares / pixels, 0.8 * variance * pixels / samples) << c;
  }
}

// A wide frame is predicted in strips of 256 rows, a narrow one of the same content at once. Noise reduction depends on
// the figures of the whole frame, so that both differ everywhere: at the seam no more than elsewhere.
TEST(PredictedFrame, StripsOfRowsLeaveNoSeams) {
  const Burst wide = scene(9000, 330), narrow = scene(700, 330);
  const CameraRgb in_strips = predicted(wide, test::one_thread), at_once = predicted(narrow, test::one_thread);
  for (std::size_t c = 0; c < 3; ++c) {
    double elsewhere = 0, at_seam = 0;
    int pixels = 0, pixels_at_seam = 0;
    for (int y = 0; y < narrow.height; ++y) {
      const bool is_at_seam = std::abs(y - 256) <= 8;
      for (int x = 0; x < 400; ++x) {  // farther from the edge of the narrow frame than noise reduction reaches
        const double square = std::pow(in_strips.plane[c].at(x, y) - at_once.plane[c].at(x, y), 2);
        (is_at_seam ? at_seam : elsewhere) += square;
        ++(is_at_seam ? pixels_at_seam : pixels);
      }
    }
    const double rms = std::sqrt(elsewhere / pixels), rms_at_seam = std::sqrt(at_seam / pixels_at_seam);
    std::printf("colour %zu: rms difference %.4f e-, at the seam %.4f e-\n", c, rms, rms_at_seam);
    EXPECT_LT(rms_at_seam, 1.3 * rms) << c;
  }
}

TEST(PredictedFrame, IsTheSameForAnyNumberOfThreads) {
  const Burst burst = scene(301, 203);
  const CameraRgb expected = predicted(burst, test::one_thread);
  for (const int threads : {2, 3, 7}) {
    PoolExecutor pool(threads);
    const CameraRgb found = predicted(burst, pool);
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_EQ(std::memcmp(found.plane[c].data(), expected.plane[c].data(), sizeof(float) * found.plane[c].size()), 0);
    }
  }
}

}  // namespace
}  // namespace lowlux::isp
