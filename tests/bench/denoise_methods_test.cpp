#include "isp/bench/peers/denoise_methods.h"

#include <gtest/gtest.h>

#include <cmath>

#include "isp/bench/peers/gat_denoise.h"
#include "isp/render/output_space.h"

namespace lowlux::isp::denoise_methods_test {
namespace {

BenchPicture picture_of(int width, int height, double contrast) {
  BenchPicture out{"waves", SceneLinear(width, height)};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double wave = contrast * std::sin(0.13 * x) * std::cos(0.11 * y);
      out.linear.plane[0].at(x, y) = static_cast<float>(0.4 + 0.3 * wave);
      out.linear.plane[1].at(x, y) = static_cast<float>(0.3 + 0.2 * wave);
      out.linear.plane[2].at(x, y) = static_cast<float>(0.2 - 0.1 * wave);
    }
  }
  return out;
}

double mean_of(const Plane<float>& plane) {
  double sum = 0;
  for (std::size_t i = 0; i < plane.size(); ++i) sum += static_cast<double>(plane.data()[i]);
  return sum / static_cast<double>(plane.size());
}

TEST(ChromaticFilter, WindowsOfOnePixelChangeNothing) {
  const BenchPicture picture = picture_of(24, 20, 1);
  const SceneLinear out = chromatic_filtered(picture.linear.view(), {0, 0});
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < out.plane[c].size(); ++i) {
      ASSERT_NEAR(out.plane[c].data()[i], picture.linear.plane[c].data()[i], 1e-6);  // float quotients
    }
  }
}

TEST(ChromaticFilter, ChromaticityIsThatOfTheWindowsMeanLightAndLuminanceStays) {
  // Left half red and dim, right half blue and bright; one window spans all.
  SceneLinear in(8, 1);
  for (int x = 0; x < 8; ++x) {
    in.plane[0].at(x, 0) = x < 4 ? 0.2f : 0.1f;
    in.plane[1].at(x, 0) = 0.1f;
    in.plane[2].at(x, 0) = x < 4 ? 0.1f : 0.9f;
  }
  const SceneLinear& const_in = in;
  const SceneLinear out = chromatic_filtered(const_in.view(), {8, 0});
  const Vector3 w = luminance_weights(OutputSpace::linear_srgb).value();
  for (const int x : {0, 7}) {
    EXPECT_NEAR(out.plane[2].at(x, 0) / out.plane[0].at(x, 0), 0.5 / 0.15, 1e-5);  // means of B and R
    double y_in = 0, y_out = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      y_in += w[c] * in.plane[c].at(x, 0);
      y_out += w[c] * out.plane[c].at(x, 0);
    }
    EXPECT_NEAR(y_out, y_in, 1e-6);
  }
}

TEST(ChromaticFilter, WhereThereIsNoLightThereIsNoColour) {
  SceneLinear in(4, 4);
  for (std::size_t c = 0; c < 3; ++c) std::fill_n(in.plane[c].data(), in.plane[c].size(), c == 0 ? 0.5f : -0.5f);
  const SceneLinear& const_in = in;
  const SceneLinear out = chromatic_filtered(const_in.view(), {1, 1});
  EXPECT_EQ(out.plane[0].at(2, 2), out.plane[1].at(2, 2));
  EXPECT_EQ(out.plane[0].at(2, 2), out.plane[2].at(2, 2));
  EXPECT_LT(out.plane[0].at(2, 2), 0);
}

TEST(GatDenoise, FlatLightKeepsItsMeanAndLosesItsNoise) {
  constexpr int side = 256;
  InlineExecutor one;
  for (const DenoiseLight& light : {DenoiseLight{20, 2, 1.5}, DenoiseLight{4, 200, 4}}) {
    const DenoiseShot shot = take(picture_of(side, side, 0), light, 11);
    denoise::Denoiser denoiser(side, side, 1);
    Plane<float> out(side, side);
    gat_denoise(denoiser, shot, denoise::Level::standard, {1, 1, 1}, out.view(), one);
    const double variance = light.mean_e + light.dark_e + light.read_noise_e * light.read_noise_e;
    // The mean of stabilised values is kept, which is as good an estimate as the mean of the values to a few percent;
    // the inverse's bias is below 1e-3 e-.
    EXPECT_NEAR(mean_of(out), mean_of(shot.signal_e), 5 * 1.05 * std::sqrt(variance) / side + 1e-3);
    double squares = 0;
    for (std::size_t i = 0; i < out.size(); ++i) squares += std::pow(out.data()[i] - shot.signal_e.data()[i], 2);
    EXPECT_LT(squares / static_cast<double>(out.size()),
              0.05 * variance);  // a twentieth: sixty-fourths are what is left
  }
}

TEST(DenoiseMethods, AreOthersAndEveryLevelOfOurs) {
  const auto with = denoise_methods(true), without = denoise_methods(false);
  EXPECT_EQ(with.size(), without.size() + 1);
  std::size_t ours = 0;
  for (const DenoiseMethod& method : without) {
    EXPECT_NE(method.name, name_of_nl_means);
    if (method.kind == MethodKind::ours) {
      EXPECT_EQ(method.name, denoise::name_of(denoise::all_levels[ours++]));
    }
  }
  EXPECT_EQ(ours, denoise::all_levels.size());
  EXPECT_EQ(without.front().kind, MethodKind::ceiling);
}

TEST(DenoiseMethods, EachComesCloserToTheTruthThanNoneButTheDarkThatStays) {
  constexpr int side = 96;
  const BenchPicture picture = picture_of(side, side, 1);
  const DenoiseLight light{20, 2, 1.5};
  const DenoiseShot shot = take(picture, light, 5);
  InlineExecutor one;
  const PictureTruth truth(picture.linear.view(), one);
  MethodMemory memory(side, side, one);
  const TunedParameters tuned{.windows = {3, 2}};
  const NlMeans* const nl_means = lowlux_nl_means();
  const MethodInput input{picture, shot, tuned, nl_means, {20, 20}, 2};
  double none_db = 0;
  for (const DenoiseMethod& method : denoise_methods(true)) {
    const auto result = method.run(input, method.level, memory);
    ASSERT_TRUE(result.has_value()) << method.name;
    const PictureError error = picture_error(result->picture, truth, one);
    EXPECT_EQ(result->cpu_s > 0, method.kind != MethodKind::ceiling) << method.name;
    if (method.name == name_of_none) none_db = error.psnr_db;
    if (method.name == "noise-free") {
      EXPECT_GT(error.psnr_db, 35);
    } else if (method.name == "dark-left-in" || method.name == "chromatic") {
      // alpha of this scene: mean W over mean W with dark, about 0.9
      EXPECT_LT(error.saturation_ratio, 0.97) << method.name;
    } else if (method.name != name_of_none) {
      EXPECT_GT(error.psnr_db, none_db + 3) << method.name;
    }
  }
}

TEST(DenoiseMethods, TuningChoosesLargerWindowsForLessLight) {
  std::vector<BenchPicture> pictures;
  pictures.push_back(picture_of(64, 64, 1));
  InlineExecutor one;
  const ChromaticWindows bright = tune(pictures, {20000, 2, 1.5}, one).windows;
  const ChromaticWindows dark = tune(pictures, {20, 2, 1.5}, one).windows;
  EXPECT_LT(bright.luminance_radius, dark.luminance_radius);
}

}  // namespace
}  // namespace lowlux::isp::denoise_methods_test
