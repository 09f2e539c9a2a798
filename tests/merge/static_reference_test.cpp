#include "isp/merge/static_reference.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/merge/merge_scene.h"

namespace lowlux::merge {
namespace {

constexpr double read_noise_e = 2;

struct Frames {
  Plane<float> reference;
  std::vector<Plane<float>> others;
};

Frames frames_of(const Plane<float>& scene, std::uint64_t seed) {
  Frames out{test::noisy_frame(scene, 0, read_noise_e, seed, 0), {}};
  for (std::uint32_t k = 1; k < 5; ++k) out.others.push_back(test::noisy_frame(scene, 0, read_noise_e, seed, k));
  return out;
}

StaticReference reference_of(Frames frames, double block_false_alarm, Scene scene = Scene::reference) {
  InlineExecutor executor;
  return make_static_reference(std::move(frames.reference), std::move(frames.others),
                               {test::dark_variance_e2(0, read_noise_e), 1},
                               {.block_false_alarm = block_false_alarm, .site_false_alarm = 1e-5}, scene, executor);
}

double count_of(const Plane<std::uint8_t>& mask) {
  double count = 0;
  for (std::size_t i = 0; i < mask.size(); ++i) count += mask.data()[i];
  return count;
}

TEST(StaticReference, OfAStaticSceneIsTheMeanOfAllFrames) {
  const Plane<float> scene = test::flat_mosaic(512, 512, 20);
  double single = 0, blocks = 0, squared = 0, sites = 0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const StaticReference found = reference_of(frames_of(scene, seed), 1e-4);
    single += count_of(found.is_single);
    blocks += static_cast<double>(found.is_single.size());
    for (std::size_t i = 0; i < found.mosaic.size(); ++i) {
      squared += std::pow(static_cast<double>(found.mosaic.data()[i]) - 20, 2);
      sites += 1;
    }
  }
  EXPECT_LT(single, 4 * 9 * 1e-4 * blocks + 5 * 9 * std::sqrt(4e-4 * blocks));  // four positions, nine blocks each
  EXPECT_NEAR(squared / sites / (24.0 / 5), 1, 0.05);  // robust_mean rejects some values, and some blocks are single
}

TEST(StaticReference, OfAnObjectIsTheReferenceFrameAlone) {
  for (const float difference : {-40.0F, -4.0F, 4.0F, 40.0F}) {
    const Plane<float> scene = test::flat_mosaic(128, 128, 50);
    Frames frames = frames_of(scene, 3);
    for (int y = 43; y < 61; ++y) {
      for (int x = 51; x < 69; ++x) frames.reference.at(x, y) += difference;
    }
    const Plane<float> reference = frames.reference.clone();
    const StaticReference found = reference_of(std::move(frames), 1e-5);
    for (int y = 43; y < 61; ++y) {
      for (int x = 51; x < 69; ++x) ASSERT_EQ(found.mosaic.at(x, y), reference.at(x, y)) << difference;
    }
    EXPECT_LE(count_of(found.is_single), 7 * 7) << difference;  // two blocks around the 3 x 3 that it touches
  }
}

/// Adds light to a square of a frame, whose noise stays: it is less than the noise model states.
void add_object(Plane<float>& frame, float difference) {
  for (int y = 40; y < 72; ++y) {
    for (int x = 48; x < 80; ++x) frame.at(x, y) += difference;
  }
}

double mean_inside(const Plane<float>& mosaic) {
  double sum = 0;
  for (int y = 40; y < 72; ++y) {
    for (int x = 48; x < 80; ++x) sum += static_cast<double>(mosaic.at(x, y)) / (32 * 32);
  }
  return sum;
}

TEST(StaticReference, TheMajorityDecidesWhereItAgrees) {
  const Plane<float> scene = test::flat_mosaic(128, 128, 50);
  for (const float difference : {20.0F, 40.0F, 200.0F}) {
    const double tolerance = 5 * std::sqrt((50 + difference + read_noise_e * read_noise_e) / (32.0 * 32));
    Frames walker = frames_of(scene, 3);  // in the reference alone
    add_object(walker.reference, difference);
    const StaticReference without = reference_of(std::move(walker), 1e-5, Scene::majority);
    EXPECT_NEAR(mean_inside(without.mosaic), 50, tolerance) << difference;
    EXPECT_EQ(count_of(without.is_single), 0) << difference;
    for (const bool in_reference : {true, false}) {  // two of four others show an object: the reference decides
      Frames half = frames_of(scene, 4);
      for (const int k : {0, 2}) add_object(half.others[k], difference);
      if (in_reference) add_object(half.reference, difference);
      const double expected = 50 + (in_reference ? difference : 0);
      EXPECT_NEAR(mean_inside(reference_of(std::move(half), 1e-5, Scene::majority).mosaic), expected, tolerance);
    }
    Frames parked = frames_of(scene, 5);  // gone from the reference before the others were taken
    for (Plane<float>& other : parked.others) add_object(other, difference);
    EXPECT_NEAR(mean_inside(reference_of(std::move(parked), 1e-5, Scene::majority).mosaic), 50 + difference, tolerance);
  }
}

TEST(StaticReference, LosesCosmicRaysAndSatellitesOfTheReference) {
  const Plane<float> scene = test::flat_mosaic(128, 128, 50);
  Frames frames = frames_of(scene, 4);
  for (int x = 0; x < 128; ++x) frames.reference.at(x, x / 2) += 500;
  const StaticReference found = reference_of(std::move(frames), 1e-5);
  EXPECT_EQ(count_of(found.is_single), 0);
  for (int x = 0; x < 128; ++x) EXPECT_LT(found.mosaic.at(x, x / 2), 80);
}

TEST(StaticReference, HasAnySize) {
  for (const auto& [width, height] : {std::pair{1, 1}, {1, 40}, {40, 1}, {4, 4}, {5, 3}, {37, 23}}) {
    const StaticReference found = reference_of(frames_of(test::flat_mosaic(width, height, 20), 5), 1e-6);
    EXPECT_EQ(found.mosaic.width(), width);
    EXPECT_EQ(found.is_single.height(), (height + 7) / 8);
  }
}

}  // namespace
}  // namespace lowlux::merge
