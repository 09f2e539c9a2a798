#include "isp/pipeline/plan/framing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>

#include "isp/pipeline/plan/plan_develop.h"
#include "isp/pipeline/render/frame_tiles.h"
#include "isp/pipeline/render/picture_view.h"
#include "isp/pipeline/render/pipeline.h"
#include "isp/render/area_mean.h"
#include "tests/pipeline/night_frames.h"
#include "tests/support/executors.h"

namespace lowlux::isp {
namespace {

using test::one_thread;

constexpr TileLimits small_tiles{.max_whole_px = 0, .side_px = 256};
constexpr TileLimits never{.max_whole_px = std::int64_t{1} << 40};

/// Returns the pixel of the stored image that is shown at (x, y) of the upright one, by the EXIF definition: which
/// sides of the upright image row 0 and column 0 are.
std::pair<int, int> stored_at(int x, int y, const PictureSize& upright, Orientation orientation) {
  const int from_right = upright.width - 1 - x, from_below = upright.height - 1 - y;
  switch (orientation) {
    case Orientation::normal:
      return {x, y};
    case Orientation::mirror_horizontal:  // row 0 top, column 0 right
      return {from_right, y};
    case Orientation::rotate_180:  // bottom, right
      return {from_right, from_below};
    case Orientation::mirror_vertical:  // bottom, left
      return {x, from_below};
    case Orientation::transpose:  // left, top
      return {y, x};
    case Orientation::rotate_90:  // right, top
      return {y, from_right};
    case Orientation::transverse:  // right, bottom
      return {from_below, from_right};
    case Orientation::rotate_270:  // left, bottom
      return {from_below, x};
  }
  return {};
}

TEST(Framing, CropsAreOfTheUprightImage) {
  std::mt19937 random(7);
  const PictureSize upright{31, 19};
  for (int o = 1; o <= 8; ++o) {
    const auto orientation = static_cast<Orientation>(o);
    for (int draw = 0; draw < 20; ++draw) {
      Rect region{static_cast<int>(random() % 31), static_cast<int>(random() % 19)};
      region.width = 1 + static_cast<int>(random() % static_cast<unsigned>(31 - region.x));
      region.height = 1 + static_cast<int>(random() % static_cast<unsigned>(19 - region.y));
      const auto a = stored_at(region.x, region.y, upright, orientation);
      const auto b = stored_at(region.x + region.width - 1, region.y + region.height - 1, upright, orientation);
      const Rect expected{std::min(a.first, b.first), std::min(a.second, b.second), std::abs(a.first - b.first) + 1,
                          std::abs(a.second - b.second) + 1};
      EXPECT_EQ(before_orientation(region, upright, orientation), expected) << "orientation " << o << ", seed 7";
    }
  }
}

Result<std::optional<Framing>> framed(std::optional<PictureCrop> crop, std::optional<int> max_size,
                                      Orientation orientation = Orientation::normal) {
  DevelopOptions options;
  options.crop = crop;
  options.max_size = max_size;
  return decide_framing({4000, 3000}, orientation, options);
}

TEST(Framing, PercentAreOfTheUprightSidesAndSizesAreRounded) {
  EXPECT_FALSE(framed({}, {})->has_value());
  EXPECT_FALSE(framed({}, 4000)->has_value());
  EXPECT_FALSE(framed({}, 60000)->has_value()) << "nothing is enlarged";
  EXPECT_FALSE(framed(PictureCrop{0, 0, 100, 100, true}, {})->has_value());
  const Framing turned = **framed(PictureCrop{0, 50, 10, 50, true}, {}, Orientation::rotate_90);
  EXPECT_EQ(turned.pixels, (Rect{2000, 2700, 2000, 300}));  // the upright image has 3000 x 4000 pixels
  EXPECT_FALSE(turned.shrinks());
  const Framing small = **framed(PictureCrop{100, 0, 1000, 333}, 100);
  EXPECT_EQ(small.size.width, 100);
  EXPECT_EQ(small.size.height, 33);
  EXPECT_TRUE(small.shrinks());
  EXPECT_EQ((**framed(PictureCrop{0, 0, 4000, 1}, 10)).size.height, 1);
  EXPECT_EQ((**framed({}, 1)).size.width, 1);
}

TEST(Framing, CropsBeyondTheImageOrWithoutAPixelAreErrors) {
  for (const PictureCrop& crop : {PictureCrop{3999, 0, 2, 1}, PictureCrop{0, 3000, 1, 1}, PictureCrop{0, 0, 4001, 1},
                                  PictureCrop{60, 0, 41, 10, true}, PictureCrop{50, 50, 0.001, 10, true}}) {
    const auto result = framed(crop, {});
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().code, ErrorCode::invalid_argument);
  }
}

denoise_testing::Scene scene_of(double mean_e) {
  return [mean_e](int x, int y) {
    auto light = denoise_testing::waves(mean_e)(x, y);
    if (std::hypot(x - 300, y - 200) < 20) light.fill(5000);  // saturates
    return light;
  };
}

/// Returns a frame that is not rendered directly from codes, so that it can be rendered in tiles.
RawFrame frame_with_gains() {
  RawFrame frame = test::night_frame({}, scene_of(60), 701, 523);
  frame.corrections.gain_maps = {{.bottom = 523, .right = 701, .gain = {1.1f}}};
  return frame;
}

DevelopOptions options_for(SampleType samples) {
  DevelopOptions options{.exposure_ev = 1, .samples = samples};
  if (samples == SampleType::f32) {
    options.tone = ToneCurve::none;
    options.space = OutputSpace::linear_srgb;
  }
  return options;
}

Picture rendered(const RawFrame& frame, const DevelopOptions& options, const TileLimits& limits = never,
                 Executor& with = one_thread) {
  Result<DevelopPlan> plan = plan_develop(frame, options, one_thread);
  EXPECT_TRUE(plan) << plan.error().message;
  EXPECT_EQ(is_tiled(frame.raw, *plan, limits), limits.max_whole_px == 0);
  Picture out = make_picture(*plan);
  Pipeline(with, limits).render(frame, *plan, out);
  return out;
}

template <class T>
bool same(const PlaneView<T>& a, const PlaneView<T>& b) {
  if (a.width != b.width || a.height != b.height) return false;
  for (int y = 0; y < a.height; ++y) {
    if (std::memcmp(a.row(y), b.row(y), sizeof(T) * static_cast<std::size_t>(a.width)) != 0) return false;
  }
  return true;
}

bool same_bits(const PictureView& a, const PictureView& b) {
  return std::visit(
      [&](const auto& p) {
        const auto& q = std::get<std::remove_cvref_t<decltype(p)>>(b);
        if constexpr (std::is_same_v<std::remove_cvref_t<decltype(p)>, RgbView<float>>) {
          return same(p[0], q[0]) && same(p[1], q[1]) && same(p[2], q[2]);
        } else {
          return same(p, q);
        }
      },
      a);
}

TEST(Framing, ACropIsThatPartOfTheWholeImageBitForBit) {
  const RawFrame frame = frame_with_gains();
  for (const SampleType samples : {SampleType::u8, SampleType::u16, SampleType::f32}) {
    DevelopOptions options = options_for(samples);
    Picture whole = rendered(frame, options);
    options.crop = PictureCrop{201, 33, 313, 401};
    Picture part = rendered(frame, options);
    EXPECT_TRUE(same_bits(view_of(part), crop_of(view_of(whole), {201, 33, 313, 401})));
    Picture tiled = rendered(frame, options, small_tiles);
    EXPECT_TRUE(same_bits(view_of(part), view_of(tiled)));
  }
}

TEST(Framing, ShrinkingIsDoneInSignedLightAndHasTheSameBitsInTilesAndThreads) {
  const RawFrame frame = frame_with_gains();
  for (const SampleType samples : {SampleType::u8, SampleType::u16, SampleType::f32}) {
    DevelopOptions options = options_for(samples);
    options.crop = PictureCrop{201, 33, 313, 401};
    options.max_size = 97;
    Picture whole = rendered(frame, options), tiled = rendered(frame, options, small_tiles);
    Picture threads = rendered(frame, options, never, test::two_threads);
    EXPECT_TRUE(same_bits(view_of(whole), view_of(tiled)));
    EXPECT_TRUE(same_bits(view_of(whole), view_of(threads)));
    if (samples != SampleType::f32) continue;
    Picture all = rendered(frame, options_for(samples));
    const auto part = std::get<RgbView<float>>(crop_of(view_of(all), {201, 33, 313, 401}));
    SceneLinear expected(76, 97);
    shrink_by_area({part[0], part[1], part[2]}, expected.view(), one_thread);
    Picture small = std::move(expected);
    EXPECT_TRUE(same_bits(view_of(whole), view_of(small)));
  }
}

/// Returns the mean sRGB light of an 8-bit image.
double mean_light(const Encoded8& image) {
  double sum = 0;
  for (std::size_t i = 0; i < image.codes.size(); ++i) {
    const double v = image.codes.data()[i] / 255.0;
    sum += v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
  }
  return sum / static_cast<double>(image.codes.size());
}

TEST(Framing, BlackNoiseIsNotRectifiedBeforeTheMean) {
  const RawFrame frame = test::night_frame({.read_noise_e = 8}, denoise_testing::flat(0, 0, 0), 256, 256);
  DevelopOptions options = options_for(SampleType::u8);
  options.exposure_ev = 6;
  const double full = mean_light(std::get<Encoded8>(rendered(frame, options)));
  options.max_size = 16;
  const double small = mean_light(std::get<Encoded8>(rendered(frame, options)));
  // Means of 256 values have a sixteenth of the noise, demosaicing leaves a little more; clipped first, they would keep
  // all of what clipping adds.
  EXPECT_GT(full, 1e-3);
  EXPECT_LT(small, full / 6);
}

}  // namespace
}  // namespace lowlux::isp
