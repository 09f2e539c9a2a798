#include "isp/bench/scenes/denoise_scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "tests/support/scratch_directory.h"

namespace lowlux::isp::denoise_scene_test {
namespace {

BenchPicture flat_picture(int width, int height, std::array<float, 3> rgb) {
  BenchPicture out{"flat", SceneLinear(width, height)};
  for (std::size_t c = 0; c < 3; ++c) std::fill_n(out.linear.plane[c].data(), out.linear.plane[c].size(), rgb[c]);
  return out;
}

double mean_of(const Plane<float>& plane) {
  double sum = 0;
  for (std::size_t i = 0; i < plane.size(); ++i) sum += static_cast<double>(plane.data()[i]);
  return sum / static_cast<double>(plane.size());
}

TEST(DenoiseScene, AShotHasTheMeanAndTheVarianceOfItsLight) {
  constexpr int side = 200;
  for (const DenoiseLight& light : {DenoiseLight{20, 2, 1.5}, DenoiseLight{4, 200, 4}}) {
    // Gains that are undone make this grey.
    const DenoiseShot shot = take(flat_picture(side, side, {0.5f, 0.25f, 0.375f}), light, 3);
    EXPECT_NEAR(mean_of(shot.signal_e), light.mean_e, 1e-4 * light.mean_e);  // float sums of a flat picture
    const double n = 1.0 * side * side,
                 variance = light.mean_e + light.dark_e + light.read_noise_e * light.read_noise_e;
    const double mean = mean_of(shot.raw_e);
    EXPECT_NEAR(mean, light.mean_e + light.dark_e, 5 * std::sqrt(variance / n));
    double squares = 0;
    for (std::size_t i = 0; i < shot.raw_e.size(); ++i) squares += std::pow(shot.raw_e.data()[i] - mean, 2);
    // Fourth cumulant of Poisson(l) + normal: l.
    const double fourth = (light.mean_e + light.dark_e) / (variance * variance);
    EXPECT_NEAR(squares / (n - 1), variance, 5 * variance * std::sqrt((2 + fourth) / n));
  }
}

TEST(DenoiseScene, GainsAreUndoneSoThatGreyIsGrey) {
  const BenchPicture grey = flat_picture(32, 32, {0.5f, 0.5f, 0.5f});
  const DenoiseShot shot = take(grey, {20, 2, 1.5}, 1);
  EXPECT_NEAR(shot.signal_e.at(0, 0) * 2, shot.signal_e.at(1, 0), 1e-5);    // red's gain is 2
  EXPECT_NEAR(shot.signal_e.at(1, 1) * 1.5, shot.signal_e.at(1, 0), 1e-5);  // blue's 1.5
  InlineExecutor one;
  BenchRenderer renderer(32, one);
  const RenderedPicture picture = renderer.render(shot.signal_e.view(), shot, NoiseLeft::none);
  for (const auto& plane : picture.display.plane) EXPECT_NEAR(plane.at(10, 11), 0.5, 1e-5);  // float kernels
  EXPECT_NEAR(picture.light.plane[2].at(10, 11), 0.5, 1e-5);
}

TEST(DenoiseScene, EqualSeedsGiveEqualShotsAndOthersDoNot) {
  const BenchPicture grey = flat_picture(16, 16, {0.5f, 0.5f, 0.5f});
  const auto at = [&](std::uint64_t seed) { return take(grey, {20, 2, 1.5}, seed).raw_e.clone(); };
  const Plane<float> one = at(1), again = at(1), two = at(2);
  EXPECT_TRUE(std::equal(one.data(), one.data() + one.size(), again.data()));
  EXPECT_FALSE(std::equal(one.data(), one.data() + one.size(), two.data()));
}

TEST(DenoiseScene, NegativeLightIsBlackOnDisplayAndKeptAsLight) {
  const BenchPicture grey = flat_picture(16, 16, {0.5f, 0.5f, 0.5f});
  const DenoiseShot shot = take(grey, {20, 2, 1.5}, 1);
  Plane<float> dark(16, 16);
  std::fill_n(dark.data(), dark.size(), -3.0f);
  InlineExecutor one;
  BenchRenderer renderer(16, one);
  const RenderedPicture picture = renderer.render(dark.view(), shot, NoiseLeft::reduced);
  EXPECT_EQ(picture.display.plane[1].at(5, 5), 0);
  EXPECT_LT(picture.light.plane[1].at(5, 5), 0);
}

TEST(DenoiseScene, TheExposureWithDarkKeepsTheMeanLuminance) {
  const BenchPicture picture = flat_picture(32, 32, {0.6f, 0.3f, 0.2f});
  const DenoiseLight light{4, 200, 4};
  const DenoiseShot shot = take(picture, light, 1);
  Plane<float> mean_e = shot.signal_e.clone();
  for (std::size_t i = 0; i < mean_e.size(); ++i) mean_e.data()[i] += 200.0f;
  InlineExecutor one;
  BenchRenderer renderer(32, one);
  const auto with_dark = renderer.render(mean_e.view(), shot, NoiseLeft::none, exposure_with_dark(picture, shot)).light;
  const SceneLinear& linear = with_dark;
  const SceneLinear& truth = picture.linear;
  EXPECT_NEAR(patch_means(linear.view())[0].y, patch_means(truth.view())[0].y, 1e-5);  // float kernels
}

TEST(DenoiseScene, SaturatedSitesHaveTheChargeAndTheNoiseOfWhite) {
  BenchPicture scene{"lamp", SceneLinear(64, 64)};
  for (Plane<float>& plane : scene.linear.plane) {
    std::fill_n(plane.data(), plane.size(), 0.1F);
    for (int y = 16; y < 48; ++y) std::fill_n(plane.row(y) + 16, 32, 50.0F);
  }
  const DenoiseShot shot = take(scene, {200, 2, 1.5}, 1, true);
  EXPECT_NEAR(shot.noise().saturation_e[0], shot.white_e + 2, 1e-6 * shot.white_e);  // float
  EXPECT_EQ(shot.signal_e.at(32, 32), static_cast<float>(shot.white_e));
  EXPECT_EQ(shot.raw_e.at(32, 32), static_cast<float>(shot.white_e + 2));
  EXPECT_NEAR(shot.signal_e.at(3, 2), 0.1 * shot.white_e, 1e-4 * shot.white_e);  // green
  InlineExecutor one;
  BenchRenderer renderer(64, one);
  const RenderedPicture picture = renderer.render(shot.signal_e.view(), shot, NoiseLeft::none);
  for (const Plane<float>& plane : picture.light.plane) EXPECT_NEAR(plane.at(32, 32), 1, 1e-5);  // float kernels
}

TEST(BenchPicture, TheLensKeepsLightAndSpreadsAPointByItsSigma) {
  Plane<float> point(41, 41);
  std::fill_n(point.data(), point.size(), 0.0f);
  point.at(20, 20) = 1;
  const Plane<float> out = lens_blurred(point.view(), bench_lens_px);
  double sum = 0, squares = 0;
  for (int y = 0; y < 41; ++y) {
    for (int x = 0; x < 41; ++x) {
      sum += out.at(x, y);
      squares += (x - 20) * (x - 20) * out.at(x, y);
    }
  }
  EXPECT_NEAR(sum, 1, 1e-5);                                  // float samples
  EXPECT_NEAR(squares, bench_lens_px * bench_lens_px, 1e-3);  // a sampled Gaussian's is within 1e-6 at 0.9
  EXPECT_NEAR(out.at(20, 22) / out.at(20, 20), std::exp(-2 / 0.81), 1e-5);
  const Plane<float> same = lens_blurred(point.view(), 0);
  EXPECT_TRUE(std::equal(same.data(), same.data() + same.size(), point.data()));
}

TEST(BenchPicture, TheLensRepeatsTheEnds) {
  Plane<float> flat(9, 1);
  std::fill_n(flat.data(), flat.size(), 0.5f);
  const Plane<float> out = lens_blurred(flat.view(), bench_lens_px);
  for (int x = 0; x < 9; ++x) EXPECT_NEAR(out.at(x, 0), 0.5, 1e-6);
}

TEST(BenchPicture, TheSetsPartTheEightPictures) {
  EXPECT_EQ(files_of(PictureSet::tuning).size(), 4u);
  EXPECT_EQ(files_of(PictureSet::held_out).size(), 4u);
  EXPECT_EQ(files_of(PictureSet::all).size(), 8u);
  for (const auto file : files_of(PictureSet::held_out)) {
    EXPECT_EQ(std::ranges::count(files_of(PictureSet::tuning), file), 0);
  }
  EXPECT_EQ(name_of(PictureSet::held_out), "held-out");
  EXPECT_EQ(name_of(PictureSet::tuning), "tuning");
  EXPECT_EQ(name_of(PictureSet::all), "all");
}

TEST(BenchPicture, EveryPictureIsReadAsADisplayShowsIt) {
  InlineExecutor one;
  for (const auto file : files_of(PictureSet::all)) {
    const auto picture = read_bench_picture(LOWLUX_TESTDATA "/pictures/" + std::string(file), 64, 48, one);
    ASSERT_TRUE(picture.has_value()) << picture.error().message;
    EXPECT_EQ(picture->name, file);
    EXPECT_EQ(picture->linear.width(), 64);
    EXPECT_EQ(picture->linear.height(), 48);
    for (const auto& plane : picture->linear.plane) {
      const auto [least, most] = std::minmax_element(plane.data(), plane.data() + plane.size());
      EXPECT_GE(*least, 0);
      EXPECT_LE(*most, 1.00001f);  // sums of float weights
      EXPECT_GT(*most, 0);
    }
  }
}

TEST(BenchPicture, FilesThatAreNotImagesAreNamed) {
  const test::ScratchDirectory scratch;
  scratch.write("a.png", "no picture");
  scratch.write("a.exr", "no picture");
  InlineExecutor one;
  for (const char* name : {"a.png", "a.exr", "missing.png", "missing.exr"}) {
    const auto picture = read_bench_picture(scratch.file(name), 0, 0, one);
    ASSERT_FALSE(picture.has_value());
    EXPECT_NE((picture.error().where + picture.error().message).find(name), std::string::npos);
  }
}

}  // namespace
}  // namespace lowlux::isp::denoise_scene_test
