#include "capture/synthetic/scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "isp/model/spectrum/cie_data.h"
#include "tests/support/numbers.h"
#include "tests/support/synthetic_camera.h"

namespace lowlux::capture {
namespace {

using test::inf;
using test::nan;

void expect_refused(const auto& result, const std::string& part) {
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::invalid_argument);
  EXPECT_NE(result.error().message.find(part), std::string::npos) << result.error().message;
}

TEST(SyntheticScene, AFlatHasTheLuminanceAskedForAndTheColourOfItsLight) {
  for (const char* light : {"D65", "A", "HPS_generic"}) {
    const Scene scene = *flat_scene(test::setup_of(7, 5, 0.03, light));
    const isp::Xy expected = *isp::xy_of(isp::xyz_of(*isp::light_named(light)));
    ASSERT_EQ(scene.xyz_cd_m2.width(), 7);
    ASSERT_EQ(scene.xyz_cd_m2.height(), 5);
    for (int i = 0; i < 35; ++i) {
      const isp::Xyz c{scene.xyz_cd_m2.plane[0].data()[i], scene.xyz_cd_m2.plane[1].data()[i],
                       scene.xyz_cd_m2.plane[2].data()[i]};
      EXPECT_NEAR(c.y / 0.03, 1, 1e-6) << "float planes";
      EXPECT_NEAR(isp::xy_of(c)->x, expected.x, 1e-6);
      EXPECT_NEAR(isp::xy_of(c)->y, expected.y, 1e-6);
    }
    EXPECT_NEAR(isp::xyz_cd_m2(scene.white).y, 0.03, 1e-15);
    EXPECT_NEAR(isp::xyz_cd_m2(scene.radiances[scene.patch.at(3, 2)]).y, 0.03, 1e-15);
  }
}

TEST(SyntheticScene, ADarkSceneHasNoLightButKnowsItsWhite) {
  const Scene scene = *dark_scene(test::setup_of(9, 4, 2));
  for (const Plane<float>& plane : scene.xyz_cd_m2.plane) {
    EXPECT_EQ(std::count(plane.data(), plane.data() + plane.size(), 0.0f), 36);
  }
  EXPECT_EQ(scene.radiances.size(), 1u);
  EXPECT_EQ(std::count(scene.patch.data(), scene.patch.data() + scene.patch.size(), 0), 36);
  EXPECT_NEAR(isp::xyz_cd_m2(scene.white).y, 2, 1e-14);
}

/// How many pixels each patch has.
std::map<int, int> areas(const Scene& scene) {
  std::map<int, int> count;
  for (std::size_t i = 0; i < scene.patch.size(); ++i) ++count[scene.patch.data()[i]];
  return count;
}

TEST(SyntheticScene, AChartShowsEveryPatchOnceEquallyLargeInABlackFrame) {
  const auto chips = isp::spectra_of(isp::SpectrumSet::colorchecker);
  for (const auto& [width, height] : {std::pair{600, 400}, {400, 600}, {1200, 100}, {100, 1200}}) {
    const Scene scene = *chart_scene(test::setup_of(width, height, 10), chips);
    const auto area = areas(scene);
    ASSERT_EQ(area.size(), 25u);
    int smallest = width * height, largest = 0;
    for (int i = 0; i < 24; ++i) {
      smallest = std::min(smallest, area.at(i));
      largest = std::max(largest, area.at(i));
    }
    EXPECT_LT(largest - smallest, 0.1 * largest) << "edges fall on whole pixels";
    EXPECT_EQ(scene.patch.at(0, 0), 24);
    EXPECT_EQ(scene.patch.at(width - 1, height - 1), 24);
    EXPECT_EQ(isp::xyz_cd_m2(scene.radiances[24]).y, 0);
  }
}

TEST(SyntheticScene, PatchesOfAChartHaveTheColoursOfTheirReflectances) {
  const auto chips = isp::spectra_of(isp::SpectrumSet::colorchecker);
  const Spectrum light = *isp::light_named("A");
  const Scene scene = *chart_scene(test::setup_of(120, 80, 10, "A"), chips);
  for (int y = 0; y < 80; ++y) {
    for (int x = 0; x < 120; ++x) {
      const int patch = scene.patch.at(x, y);
      if (patch == 24) continue;
      const isp::Xyz expected = *isp::xyz_of_reflectance(chips[patch].spectrum, light);
      ASSERT_NEAR(scene.xyz_cd_m2.plane[1].at(x, y), 10 * expected.y, 1e-5) << "float of at most 10 cd/m2";
      ASSERT_NEAR(scene.xyz_cd_m2.plane[2].at(x, y), 10 * expected.z, 1e-5);
    }
  }
}

TEST(SyntheticScene, ChartsSmallerThanTheirPatchesAreStillMade) {
  const auto chips = isp::spectra_of(isp::SpectrumSet::colorchecker);
  for (const auto& [width, height] : {std::pair{1, 1}, {1, 9}, {9, 1}, {3, 3}}) {
    const auto scene = chart_scene(test::setup_of(width, height, 1), chips);
    ASSERT_TRUE(scene);
    for (std::size_t i = 0; i < scene->patch.size(); ++i) EXPECT_LE(scene->patch.data()[i], 24);
  }
  EXPECT_EQ(areas(*chart_scene(test::setup_of(50, 50, 1), {chips[0]})).size(), 2u);
}

TEST(SyntheticScene, APictureIsScaledSoThatItsWhiteHasTheLuminance) {
  const Scene scene = *picture_scene(test::even_picture(3, 2, {0.2, 0.25, 0.1}), 8);
  EXPECT_FLOAT_EQ(scene.xyz_cd_m2.plane[0].at(2, 1), 1.6f);
  EXPECT_FLOAT_EQ(scene.xyz_cd_m2.plane[1].at(2, 1), 2.0f);
  EXPECT_NEAR(isp::xyz_cd_m2(scene.white).y, 8, 8e-5) << "the lift's smoothing";
  EXPECT_TRUE(picture_scene(test::even_picture(3, 2, {0.2, 0.25, 0.1}), 0)) << "no light is a scene too";
}

TEST(SyntheticScene, SizesAndLuminancesOutsideTheirRangeAreRefused) {
  for (const auto& make : {dark_scene, flat_scene}) {
    EXPECT_TRUE(make(test::setup_of(1, 1, 0)));
    EXPECT_TRUE(make(test::setup_of(1, 1, 1e12)));
    expect_refused(make(test::setup_of(0, 1, 1)), "pixels");
    expect_refused(make(test::setup_of(1, -1, 1)), "pixels");
    expect_refused(make(test::setup_of(1 << 14, (1 << 14) + 1, 1)), "pixels");
    expect_refused(make(test::setup_of(std::numeric_limits<int>::max(), std::numeric_limits<int>::max(), 1)), "pixels");
    for (const double luminance : {-1e-9, 1.01e12, nan, inf, -inf}) {
      expect_refused(make(test::setup_of(1, 1, luminance)), "luminance");
    }
  }
  for (const double luminance : {-1e-9, 1.01e12, nan, inf}) {
    expect_refused(picture_scene(test::even_picture(1, 1, {1, 1, 1}), luminance), "luminance");
  }
  expect_refused(picture_scene(SceneLinear(), 1), "pixel");
}

TEST(SyntheticScene, LightsThatCannotLightAreRefused) {
  SceneSetup setup = test::setup_of(2, 2, 1);
  setup.light = *Spectrum::of({400, 500, 600}, {1, -0.1, 1});
  expect_refused(flat_scene(setup), "negative");
  setup.light = *Spectrum::of({400, 600}, {0, 0});
  expect_refused(flat_scene(setup), "needs power");
  setup.light = *Spectrum::of({900, 1000}, {1, 1});
  expect_refused(flat_scene(setup), "needs power");
  setup.light = *Spectrum::of({400, 700}, {1e308, 1e308});  // its luminance is beyond double
  expect_refused(flat_scene(setup), "needs power");
  setup.light = *Spectrum::of({400, 700}, {1e300, 1e300});  // this one is not, and scale does not matter
  setup.luminance_cd_m2 = 1e12;
  EXPECT_TRUE(flat_scene(setup));
}

TEST(SyntheticScene, PicturesOfImpossibleLightAreRefusedWithTheirPixel) {
  for (const float bad :
       {-1e-6f, std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), 3e12f}) {
    for (int c = 0; c < 3; ++c) {
      SceneLinear xyz = test::even_picture(3, 2, {1, 1, 1});
      xyz.plane[c].at(2, 1) = bad;
      expect_refused(picture_scene(std::move(xyz), 1), "(2, 1)");
    }
  }
}

TEST(SyntheticScene, ChartsWithoutPatchesOrWithTooManyAreRefused) {
  const Spectrum grey = *Spectrum::of({380, 780}, {0.5, 0.5});
  expect_refused(chart_scene(test::setup_of(10, 10, 1), {}), "patches");
  expect_refused(chart_scene(test::setup_of(10, 10, 1), std::vector<isp::NamedSpectrum>(4097, {"grey", grey})),
                 "patches");
  EXPECT_TRUE(chart_scene(test::setup_of(10, 10, 1), std::vector<isp::NamedSpectrum>(4096, {"grey", grey})));
  expect_refused(chart_scene(test::setup_of(10, 10, 1), {{"bad", *Spectrum::of({380, 780}, {0.5, -0.1})}}), "negative");
}

TEST(Stars, FollowTheirBrightnessLawAndAreSpreadEvenly) {
  Scene scene = *dark_scene(test::setup_of(640, 480, 1));
  constexpr int count = 20000;
  ASSERT_TRUE(add_stars(scene, count, 0.5, 42));
  ASSERT_EQ(scene.points.size(), static_cast<std::size_t>(count));
  const auto share = [&](const auto& is) {
    return std::count_if(scene.points.begin(), scene.points.end(), is) / static_cast<double>(count);
  };
  const auto flux = [](const PointSource& p) { return p.luminance_cd_m2; };
  EXPECT_EQ(share([&](const PointSource& p) { return flux(p) < 0.5 * (1 - 1e-9); }), 0) << "the faintest";
  for (const double ratio : {1.5, 4.0, 20.0, 100.0}) {
    const double p = std::pow(ratio, -1.5);  // more than `ratio` times the faintest
    EXPECT_NEAR(share([&](const PointSource& s) { return flux(s) > 0.5 * ratio; }), p,
                5 * std::sqrt(p * (1 - p) / count));
  }
  const double half = 5 * std::sqrt(0.25 / count);
  EXPECT_NEAR(share([](const PointSource& p) { return p.x_px < 319.5; }), 0.5, half);
  EXPECT_NEAR(share([](const PointSource& p) { return p.y_px < 239.5; }), 0.5, half);
  EXPECT_EQ(share([](const PointSource& p) { return p.x_px < -0.5 || p.x_px > 639.5; }), 0);
  EXPECT_EQ(share([](const PointSource& p) { return p.y_px < -0.5 || p.y_px > 479.5; }), 0);
}

TEST(Stars, AreTheSameForASeedAndOthersForAnother) {
  const auto first_x = [](std::uint64_t seed) {
    Scene scene = *dark_scene(test::setup_of(640, 480, 1));
    EXPECT_TRUE(add_stars(scene, 3, 1, seed));
    return scene.points[0].x_px;
  };
  EXPECT_EQ(first_x(1), first_x(1));
  EXPECT_NE(first_x(1), first_x(2));
}

TEST(Stars, OfImpossibleNumberOrLightAreRefused) {
  Scene scene = *dark_scene(test::setup_of(4, 4, 1));
  expect_refused(add_stars(scene, -1, 1, 1), "stars");
  expect_refused(add_stars(scene, 1000001, 1, 1), "stars");
  expect_refused(add_stars(scene, 1, nan, 1), "luminance");
  expect_refused(add_stars(scene, 1, -1, 1), "luminance");
  EXPECT_TRUE(add_stars(scene, 0, 1, 1));
  EXPECT_TRUE(scene.points.empty());
}

}  // namespace
}  // namespace lowlux::capture
