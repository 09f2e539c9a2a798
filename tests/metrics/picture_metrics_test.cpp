#include "isp/metrics/picture_metrics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "isp/base/random/random.h"
#include "isp/render/output_space.h"

namespace lowlux::isp::picture_metrics_test {
namespace {

constexpr int width = 64, height = 48;

/// A picture of one colour function of the patch that a pixel is in.
template <class OfPatch>
SceneLinear of_patches(const OfPatch& of_patch) {
  SceneLinear out(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const std::array<double, 3> rgb = of_patch(x / metric_patch_px, y / metric_patch_px);
      for (std::size_t c = 0; c < 3; ++c) out.plane[c].at(x, y) = static_cast<float>(rgb[c]);
    }
  }
  return out;
}

SceneLinear colours() {
  return of_patches([](int px, int py) { return std::array{0.1 + 0.1 * px, 0.3, 0.1 + 0.15 * py}; });
}

SceneLinear copy_of(const SceneLinear& in) {
  SceneLinear out;
  for (std::size_t c = 0; c < 3; ++c) out.plane[c] = in.plane[c].clone();
  return out;
}

RenderedPicture shown(const SceneLinear& in) { return {copy_of(in), copy_of(in)}; }

PictureTruth truth_of(const SceneLinear& in) {
  InlineExecutor one;
  return {in.view(), one};
}

PictureError error_of(const SceneLinear& in, const PictureTruth& truth) {
  InlineExecutor one;
  return picture_error(shown(in), truth, one);
}

TEST(PictureMetrics, TheTruthHasNoError) {
  const SceneLinear picture = colours();
  const PictureError error = error_of(picture, truth_of(picture));
  EXPECT_TRUE(std::isinf(error.psnr_db));
  EXPECT_EQ(error.ciede2000, 0);
  EXPECT_EQ(error.chroma_rmse, 0);
  EXPECT_EQ(error.box_chroma_rmse, 0);
  EXPECT_EQ(error.uv_shift, 0);
  EXPECT_NEAR(error.saturation_ratio, 1, 1e-12);  // relative: double sums
}

TEST(PictureMetrics, PsnrIsThatOfTheSrgbCodes) {
  const auto flat = [](double code) {
    const double v = decode_transfer(OutputSpace::srgb, code);
    return of_patches([v](int, int) { return std::array{v, v, v}; });
  };
  // All channels differ by 0.1: 20 dB. 1e-4 dB: float codes, 1e-7 of 0.1, are far below.
  EXPECT_NEAR(error_of(flat(0.6), truth_of(flat(0.5))).psnr_db, 20, 1e-4);
  EXPECT_NEAR(error_of(flat(0.01), truth_of(flat(0.11))).psnr_db, 20, 1e-4);  // on the curve's straight part too
}

TEST(PictureMetrics, DisplayValuesOutsideCountAsTheNearest) {
  const auto grey = [](double v) { return of_patches([v](int, int) { return std::array{v, v, v}; }); };
  const PictureTruth white = truth_of(grey(1)), black = truth_of(grey(0));
  EXPECT_TRUE(std::isinf(error_of(grey(7), white).psnr_db));
  EXPECT_TRUE(std::isinf(error_of(grey(-7), black).psnr_db));
  EXPECT_EQ(error_of(grey(std::numeric_limits<double>::infinity()), white).ciede2000, 0);
  EXPECT_EQ(error_of(grey(std::numeric_limits<double>::quiet_NaN()), black).ciede2000, 0);
}

TEST(PictureMetrics, Ciede2000OfGreysIsTheirsAndMeansOverPixels) {
  const auto half = [](double left, double right) {
    return of_patches([=](int px, int) {
      const double v = px < 2 ? left : right;
      return std::array{v, v, v};
    });
  };
  // Y = 0.18418651851244416 is L* = 50, Y = 1 L* = 100: on the neutral axis CIEDE2000 is |dL| / S_L.
  const double mid = 0.18418651851244416;
  const double s_l = 1 + 0.015 * 25 * 25 / std::sqrt(20.0 + 25 * 25);
  const PictureError error = error_of(half(mid, mid), truth_of(half(1, mid)));
  EXPECT_NEAR(error.ciede2000, 0.5 * 50 / s_l, 2e-4);  // float lightness of 100: 4e-6; the matrix's rounding of white
  EXPECT_NEAR(error.chroma_rmse, 0, 1e-4);
}

TEST(PictureMetrics, ChromaNoiseOfZeroMeanIsInThePixelsAndNotInTheBoxes) {
  // Two colours in a chequerboard against their reverse: every pixel is wrong, every box is right.
  const auto board = [](int odd) {
    SceneLinear out(width, height);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const bool red = ((x + y) & 1) == odd;
        out.plane[0].at(x, y) = red ? 0.5f : 0.2f;
        out.plane[1].at(x, y) = 0.3f;
        out.plane[2].at(x, y) = red ? 0.2f : 0.5f;
      }
    }
    return out;
  };
  const SceneLinear even = board(0);
  const PictureTruth truth = truth_of(even);
  const PictureError error = error_of(board(1), truth);
  const double da = truth.lab().plane[1].at(0, 0) - truth.lab().plane[1].at(1, 0);
  const double db = truth.lab().plane[2].at(0, 0) - truth.lab().plane[2].at(1, 0);
  EXPECT_NEAR(error.chroma_rmse, std::hypot(da, db), 1e-4);  // Lab units; float Lab
  EXPECT_NEAR(error.box_chroma_rmse, 0, 1e-4);
  EXPECT_NEAR(error.uv_shift, 0, 1e-7);
}

TEST(PictureMetrics, SaturationIsScaledByChromaAndNotByBrightness) {
  const SceneLinear picture = colours();
  const PictureTruth truth = truth_of(picture);
  const Vector3 w = luminance_weights(OutputSpace::linear_srgb).value();
  for (const double k : {0.0, 0.4, 1.3}) {
    // Along the line to the neutral of the same X + 15 Y + 3 Z, in which u'v' is linear.
    const SceneLinear changed = of_patches([&](int px, int py) {
      const std::array rgb{0.1 + 0.1 * px, 0.3, 0.1 + 0.15 * py};
      const Matrix3 to_xyz = rgb_to_xyz(primaries_rec709).value();
      const Vector3 xyz = to_xyz * rgb, white = to_xyz * Vector3{1, 1, 1};
      const double grey = (xyz[0] + 15 * xyz[1] + 3 * xyz[2]) / (white[0] + 15 * white[1] + 3 * white[2]);
      return std::array{grey + k * (rgb[0] - grey), grey + k * (rgb[1] - grey), grey + k * (rgb[2] - grey)};
    });
    EXPECT_NEAR(error_of(changed, truth).saturation_ratio, k, 1e-6);  // float pixels
  }
  const SceneLinear dimmed = of_patches([](int px, int py) {
    return std::array{0.1 * (0.1 + 0.1 * px), 0.1 * 0.3, 0.1 * (0.1 + 0.15 * py)};
  });
  EXPECT_NEAR(error_of(dimmed, truth).saturation_ratio, 1, 1e-6);
  EXPECT_NEAR(error_of(dimmed, truth).uv_shift, 0, 1e-7);
  EXPECT_GT(w[1], 0.7);
}

TEST(PictureMetrics, NeutralLightDesaturatesByItsAlpha) {
  const std::vector<Xyz> truth{{0.3, 0.2, 0.1}, {0.1, 0.2, 0.3}};
  const Xyz white = *xyz_of(white_d65, 0.1);
  std::vector<Xyz> lit;
  double light = 0;
  for (const Xyz& c : truth) {
    lit.push_back({c.x + white.x, c.y + white.y, c.z + white.z});
    light += c.x + 15 * c.y + 3 * c.z;
  }
  const double added = 2 * (white.x + 15 * white.y + 3 * white.z);
  EXPECT_NEAR(saturation_ratio(lit, truth), light / (light + added), 1e-12);
}

TEST(PictureMetrics, NoiseLeavesTheSaturationRatioWhereItIs) {
  // 2000 patches of one colour, each with normal noise of up to its own strength. The ratio of sums is
  // 1 + (error of the chroma's mean) / |t| - (error of W's mean) / W: standard error below.
  constexpr std::size_t patches = 2000;
  constexpr double sigma = 0.1;
  const Xyz colour{0.3, 0.2, 0.1};
  const std::vector<Xyz> truth(patches, colour);
  std::vector<float> n[3];
  for (std::uint32_t c = 0; c < 3; ++c) {
    n[c].resize(patches);
    normal_row({.seed = 7, .frame = c, .purpose = draw_purpose::scene}, 0, 0, 0, n[c]);
  }
  std::vector<Xyz> noisy;
  for (std::size_t i = 0; i < patches; ++i) {
    noisy.push_back({colour.x + sigma * n[0][i], colour.y + sigma * n[1][i], colour.z + sigma * n[2][i]});
  }
  // Coefficients of X, Y, Z in the ratio, to first order.
  const UvPrime white = uv_prime_of(white_d65).value();
  const std::array<double, 3> w{1, 15, 3};
  const double light = colour.x + 15 * colour.y + 3 * colour.z;
  const double tu = 4 * colour.x - white.u * light, tv = 9 * colour.y - white.v * light, t = std::hypot(tu, tv);
  double variance = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    const double ru = (c == 0 ? 4 : 0) - white.u * w[c], rv = (c == 1 ? 9 : 0) - white.v * w[c];
    variance += std::pow((ru * tu + rv * tv) / (t * t) - w[c] / light, 2);
  }
  const double error = sigma * std::sqrt(variance / patches);
  EXPECT_NEAR(saturation_ratio(noisy, truth), 1, 5 * error);
  EXPECT_LT(5 * error, 0.15);  // a bias of Var(W) / W^2, as means of ratios have, would be above
}

TEST(PictureMetrics, WithoutColourOrLightThereIsNoRatio) {
  const std::vector<Xyz> grey{*xyz_of(white_d65, 0.2)}, red{{0.4, 0.2, 0.02}}, black{{}};
  EXPECT_TRUE(std::isnan(saturation_ratio(red, grey)));
  EXPECT_TRUE(std::isnan(saturation_ratio(red, black)));
  EXPECT_TRUE(std::isnan(saturation_ratio(black, red)));
  EXPECT_FALSE(std::isnan(saturation_ratio(grey, red)));
}

TEST(PictureMetrics, UvShiftIsTheMedianAndAPatchWithoutColourIsFar) {
  const Xyz at{0.3, 0.2, 0.1};
  const auto moved = [&](double du) {  // u' = 4 X / W with W kept, v' kept
    const double w = at.x + 15 * at.y + 3 * at.z;
    return Xyz{at.x + du * w / 4, at.y, at.z - du * w / 12};
  };
  const std::vector<Xyz> truth(3, at);
  EXPECT_NEAR(median_uv_shift({moved(0.01), moved(0.02), moved(0.3)}, truth), 0.02, 1e-12);
  EXPECT_TRUE(std::isinf(median_uv_shift({at, Xyz{}, Xyz{-1, -1, -1}}, truth)));
  EXPECT_EQ(median_uv_shift({at, at, Xyz{}}, truth), 0);
  EXPECT_TRUE(std::isnan(median_uv_shift({at}, {Xyz{}})));  // the truth has no colour
}

TEST(PictureMetrics, PatchesAreWholeOnes) {
  SceneLinear picture(2 * metric_patch_px + 15, metric_patch_px + 1);
  for (auto& plane : picture.plane) std::fill_n(plane.data(), plane.size(), 0.25f);
  const SceneLinear& view = picture;
  const std::vector<Xyz> patches = patch_means(view.view());
  ASSERT_EQ(patches.size(), 2u);
  EXPECT_NEAR(patches[0].y, 0.25, 1e-12);
}

TEST(PictureMetrics, ThreadsChangeNoBit) {
  const SceneLinear picture = colours();
  const PictureTruth truth = truth_of(picture);
  SceneLinear other = copy_of(picture);
  for (std::size_t i = 0; i < other.plane[0].size(); ++i) other.plane[0].data()[i] *= 0.5f + 0.01f * (i % 97);
  PoolExecutor three(3);
  const PictureError alone = error_of(other, truth), shared = picture_error(shown(other), truth, three);
  EXPECT_EQ(alone.psnr_db, shared.psnr_db);
  EXPECT_EQ(alone.ciede2000, shared.ciede2000);
  EXPECT_EQ(alone.chroma_rmse, shared.chroma_rmse);
}

}  // namespace
}  // namespace lowlux::isp::picture_metrics_test
