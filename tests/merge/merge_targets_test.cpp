#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <tuple>
#include <utility>
#include <vector>

#include "isp/merge/align/align.h"
#include "isp/merge/block_test.h"
#include "isp/merge/placement.h"
#include "tests/merge/merge_scene.h"
#include "tests/support/only_target.h"

namespace lowlux::merge {
namespace {

/// Everything that merging computes of two frames, as bits.
std::vector<std::uint32_t> merged_bits(int width, int height, double turn) {
  Plane<float> mean(width, height), moved(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const auto colour = static_cast<int>(colour_at(BayerPhase::grbg, x, y));
      mean.at(x, y) = static_cast<float>(test::smooth_scene(x, y, colour, 40));
      moved.at(x, y) = static_cast<float>(test::smooth_scene(x - 3.4 + turn * y, y + 2.7 - turn * x, colour, 40));
    }
  }
  Plane<float> reference = test::noisy_frame(mean, 1, 2, 3, 0), frame = test::noisy_frame(moved, 1, 2, 3, 1);
  reference.at(width / 2, height / 2) = frame.at(width / 3, height / 3) = std::nanf("");
  const auto variance = test::dark_variance_e2(1, 2);
  const FrameView a{std::as_const(reference).view(), BayerPhase::grbg, variance};
  const FrameView b{std::as_const(frame).view(), BayerPhase::grbg, variance};
  InlineExecutor executor;
  const Motion motion = find_motion(AlignReference(a, executor), b, 1, {}, executor);
  EXPECT_TRUE(motion.found);
  CameraRgb prediction(width, height);
  for (Plane<float>& plane : prediction.plane) plane = mean.clone();
  const RgbView<const float> expected = std::as_const(prediction).view();
  Plane<float> differences(width, height), placed(width, height);
  subtract_prediction(b, 1, motion, expected, differences.view(), executor);
  place_nearest(std::as_const(differences).view(), a.phase, motion, expected, placed.view(), executor);
  std::vector<std::uint32_t> out;
  const auto keep = [&out](const float* values, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      out.push_back(std::isnan(values[i]) ? 1 : std::bit_cast<std::uint32_t>(values[i]));
    }
  };
  for (const Plane<float>* plane : {&motion.dx_px, &motion.dy_px}) keep(plane->data(), plane->size());
  DropRows drops(std::as_const(differences).view(), a.phase, motion, expected, 1.5);
  for (int y = 0; y < height; ++y) {
    const DropRows::Row& row = drops.row(y);
    keep(row.value.data(), row.value.size());
    keep(row.weight.data(), row.weight.size());
    keep(differences.row(y), static_cast<std::size_t>(width));
    keep(placed.row(y), static_cast<std::size_t>(width));
  }
  const Comparison found = compare_mosaics(a.signal_e, {variance}, placed.view(), {variance},
                                           {.site_false_alarm = 1e-3, .displacement_error_px = 0.3}, executor);
  for (std::size_t i = 0; i < found.block_matches.size(); ++i) out.push_back(found.block_matches.data()[i]);
  for (int y = 0; y < height; ++y) keep(placed.row(y), static_cast<std::size_t>(width));
  out.push_back(static_cast<std::uint32_t>(found.outliers));
  out.push_back(std::bit_cast<std::uint32_t>(static_cast<float>(found.mean_chi_square)));
  return out;
}

TEST(MergeTargets, EveryInstructionSetGivesTheSameBits) {
  const std::vector<std::int64_t> targets = test::kernel_targets();
  ASSERT_FALSE(targets.empty());
  for (const auto& [width, height, turn] : {std::tuple{203, 131, 0.0}, {160, 96, 0.02}, {91, 77, -0.01}}) {
    std::vector<std::uint32_t> first;
    for (const std::int64_t target : targets) {
      const test::OnlyTarget only(target);
      const std::vector<std::uint32_t> bits = merged_bits(width, height, turn);
      if (first.empty()) first = bits;
      EXPECT_EQ(bits, first) << width << " x " << height << ", target " << target;
    }
  }
}

}  // namespace
}  // namespace lowlux::merge
