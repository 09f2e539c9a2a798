#include "isp/model/sensor/exposure_advice.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "isp/model/colour/chroma_bound.h"
#include "isp/model/sensor/noise_budget.h"
#include "tests/support/numbers.h"

namespace lowlux::isp {
namespace {

using test::inf;
using test::nan;

GainSetting setting(const char* name, double gain, double read_noise_e) {
  GainSetting out;
  out.name = name;
  out.sensor.name = "test";
  out.sensor.bits = 14;
  out.sensor.black_level_dn = 500;
  out.sensor.white_level_dn = 16383;
  out.sensor.full_well_e = 40000;
  out.sensor.system_gain_dn_per_e = gain;
  out.sensor.read_noise_e = read_noise_e;
  out.sensor.dark_current_e_per_s = {1, 1, 1};
  out.white_e_per_s = {600, 1000, 700};
  return out;
}

/// A camera whose read noise stops falling at its third gain.
AdviceRequest request_of(double midtone_cd_m2, double highlight_cd_m2, double longest_s) {
  AdviceRequest r;
  r.gains = {setting("ISO 100", 0.3, 6), setting("ISO 400", 1.2, 3), setting("ISO 1600", 4.8, 1.6),
             setting("ISO 6400", 19.2, 1.58)};
  r.camera_to_xyz = {{{1.2032, 0.2157, 0.1624}, {0.4179, 0.9182, -0.2211}, {0.0533, -0.3260, 2.2189}}};
  r.midtone_cd_m2 = midtone_cd_m2;
  r.highlight_cd_m2 = highlight_cd_m2;
  r.longest_exposure_s = longest_s;
  return r;
}

bool holds(const std::string& text, const std::string& words) { return text.find(words) != std::string::npos; }

TEST(ExposureAdvice, InTheDarkMotionLimitsAndTheGainIsTheLowestAtWhichReadNoiseIsDown) {
  const auto advice = advise_exposure(request_of(0.05, 1, 0.02));
  ASSERT_TRUE(advice) << advice.error().message;
  EXPECT_EQ(advice->best, 2u);  // ISO 6400 gains 0.05 dB at most
  const GainAdvice& best = advice->gains[2];
  EXPECT_EQ(best.limit, ExposureLimit::motion);
  EXPECT_EQ(best.at.exposure_s, 0.02);
  EXPECT_EQ(best.largest_noise, NoiseSource::read_noise);
  // 1 e- of signal in green: 2.56 of 1 + 0.02 + 2.56 + 1 / (12 4.8^2)
  EXPECT_NEAR(best.largest_noise_fraction, 2.56 / (3.58 + 1 / (12 * 4.8 * 4.8)), 1e-12);
  EXPECT_TRUE(holds(advice->reason, "the longest exposure allowed is 0.02 s")) << advice->reason;
  EXPECT_TRUE(holds(advice->reason, "above ISO 1600 noise no longer falls by 0.1 dB")) << advice->reason;
  EXPECT_TRUE(holds(advice->reason, "read noise is 71.4 % of the variance")) << advice->reason;
}

TEST(ExposureAdvice, InBrightLightTheHighlightLimitsAndTheLowestGainIsBest) {
  const auto advice = advise_exposure(request_of(10, 100, 10));
  ASSERT_TRUE(advice);
  EXPECT_EQ(advice->best, 0u);
  EXPECT_EQ(advice->gains[0].limit, ExposureLimit::full_well);
  for (const int gain : {1, 2, 3}) EXPECT_EQ(advice->gains[gain].limit, ExposureLimit::converter_range) << gain;
  EXPECT_TRUE(holds(advice->reason, "the highlight reaches the full well after")) << advice->reason;
  EXPECT_TRUE(holds(advice->reason, "ISO 400 would clip the highlight after")) << advice->reason;
}

TEST(ExposureAdvice, OfPixelsThatHoldMoreThanTheConverterNamesTheConverter) {
  AdviceRequest r = request_of(10, 100, 10);
  r.gains.erase(r.gains.begin());
  const auto advice = advise_exposure(r);
  ASSERT_TRUE(advice);
  EXPECT_EQ(advice->best, 0u);
  EXPECT_EQ(advice->gains[0].limit, ExposureLimit::converter_range);
  EXPECT_TRUE(holds(advice->reason, "the converter's largest code at ISO 400")) << advice->reason;
}

TEST(ExposureAdvice, StopsWhereTheShareThatNoiseClipsIsTheOneAllowed) {
  for (const double share : {1e-6, 1e-3, 0.1, 0.5}) {
    AdviceRequest r = request_of(10, 100, 10);
    r.clipped_fraction = share;
    const auto advice = advise_exposure(r);
    ASSERT_TRUE(advice);
    for (std::size_t i = 0; i < r.gains.size(); ++i) {
      const SensorModel& s = r.gains[i].sensor;
      const double charge_e = 100001 * advice->gains[i].at.exposure_s;  // green and its dark current
      const double range_e = 15883 / s.system_gain_dn_per_e;
      const auto above = [&](double wall_e, double noise_e) {
        return 0.5 * std::erfc((wall_e - charge_e) / std::sqrt(2 * (charge_e + noise_e * noise_e)));
      };
      const double clipped = std::max(above(s.full_well_e, 0), above(range_e, s.read_noise_e));
      EXPECT_NEAR(clipped / share, 1, 1e-6) << share << ' ' << i;  // rounding, magnified by the tail
      EXPECT_NEAR(advice->gains[i].at.highlight_charge_fraction, charge_e / 40000, 1e-9);
      EXPECT_NEAR(advice->gains[i].at.highlight_code_fraction, charge_e / range_e, 1e-9);
    }
  }
}

TEST(ExposureAdvice, PredictsWhatNoiseBudgetAndChromaBoundSay) {
  AdviceRequest r = request_of(2, 20, 0.05);
  r.frames = 9;
  r.patch_pixels = 64;
  r.temperature_c = 27;  // twice the dark current
  const AdvicePoint point = predicted_point(r, 1, 0.03);
  ASSERT_TRUE(point.midtone);
  const SensorModel& s = r.gains[1].sensor;
  EXPECT_NEAR(point.midtone->snr / (9 * snr(s, {60, 0.06})), 1, 1e-12);  // rounding
  FlatPatch patch;
  patch.signal_e = {36, 60, 42};
  patch.dark_e = {0.06, 0.06, 0.06};
  patch.noise_std_e = std::sqrt(9 + 1 / (12 * 1.44));
  patch.pixels = {576, 1152, 576};
  EXPECT_NEAR(point.midtone->uv_std / rss_std(chroma_crb(r.camera_to_xyz, patch)->uv_covariance), 1, 1e-12);
  EXPECT_FALSE(point.exceeds);
}

TEST(ExposureAdvice, NamesTheLimitThatAPointExceeds) {
  const AdviceRequest r = request_of(10, 100, 10);
  EXPECT_FALSE(predicted_point(r, 0, 0.3).exceeds);
  EXPECT_EQ(predicted_point(r, 0, 0.45).exceeds, ExposureLimit::full_well);
  EXPECT_EQ(predicted_point(r, 2, 0.3).exceeds, ExposureLimit::converter_range);
  EXPECT_EQ(predicted_point(r, 0, 11).exceeds, ExposureLimit::motion);
  EXPECT_TRUE(predicted_point(r, 0, 0.45).midtone) << "a tenth of the highlight";
  EXPECT_FALSE(predicted_point(r, 0, 4.5).midtone) << "it clips too";
}

TEST(ExposureAdvice, IsNotBeatenByAnyAllowedPointOfItsCurve) {
  for (const double midtone : {1e-3, 0.05, 1.0, 30.0}) {
    for (const double longest : {1e-3, 0.1, 30.0}) {
      const AdviceRequest r = request_of(midtone, 20 * midtone, longest);
      const auto advice = advise_exposure(r);
      ASSERT_TRUE(advice) << advice.error().message;
      ASSERT_EQ(advice->curve.size(), 100u);
      const MidtoneQuality& best = *advice->gains[advice->best].at.midtone;
      const double tie = std::pow(10, equal_quality_db / 10);
      for (const AdvicePoint& point : advice->curve) {
        if (point.exceeds || !point.midtone) continue;
        EXPECT_LE(point.midtone->snr, best.snr * tie * (1 + 1e-9)) << midtone << ' ' << longest;
        EXPECT_GE(point.midtone->uv_std, best.uv_std / std::sqrt(tie) * (1 - 1e-6)) << midtone << ' ' << longest;
      }
    }
  }
}

TEST(ExposureAdvice, GetsBetterWithEveryLongerExposure) {
  AdviceRequest r = request_of(0.5, 0.5, 1000);
  for (std::size_t gain = 0; gain < r.gains.size(); ++gain) {
    r.gains[gain].sensor.dark_current_e_per_s = {100, 300, 200};
    const MidtoneQuality* before = nullptr;
    AdvicePoint last;
    for (int i = 0; i < 24; ++i) {
      const AdvicePoint point = predicted_point(r, gain, 1e-5 * std::pow(2.0, i));
      if (!point.midtone) break;
      if (before != nullptr) {
        EXPECT_GT(point.midtone->snr, before->snr);
        EXPECT_LT(point.midtone->uv_std, before->uv_std);
      }
      last = point;
      before = &*last.midtone;
    }
  }
}

TEST(ExposureAdvice, TakesTheLowestOfEqualGainsInAnyOrder) {
  AdviceRequest r = request_of(0.05, 1, 0.02);
  r.gains = {setting("c", 12, 2), setting("a", 4, 2), setting("b", 8, 2)};
  const auto advice = advise_exposure(r);
  ASSERT_TRUE(advice);
  EXPECT_EQ(r.gains[advice->best].name, "a");
}

TEST(ExposureAdvice, KnowsDarkCurrentAndQuantisationAsWell) {
  AdviceRequest hot = request_of(0.05, 1, 0.02);
  hot.temperature_c = 120;  // 20000 e-/s
  EXPECT_EQ(advise_exposure(hot)->gains[2].largest_noise, NoiseSource::dark_current);
  AdviceRequest coarse = request_of(0.05, 1, 0.02);
  coarse.gains = {setting("coarse", 0.03, 1)};  // 93 e-^2
  const auto advice = advise_exposure(coarse);
  EXPECT_EQ(advice->gains[0].largest_noise, NoiseSource::quantisation);
  EXPECT_TRUE(holds(advice->reason, "quantisation is 97.9 % of the variance")) << advice->reason;
}

TEST(ExposureAdvice, OfManyFramesIsThatMuchBetter) {
  AdviceRequest r = request_of(0.05, 1, 0.02);
  const MidtoneQuality one = *advise_exposure(r)->gains[0].at.midtone;
  r.frames = 16;
  const MidtoneQuality many = *advise_exposure(r)->gains[0].at.midtone;
  EXPECT_NEAR(many.snr / one.snr, 16, 1e-9);
  EXPECT_NEAR(many.uv_std / one.uv_std, 0.25, 1e-9);
}

TEST(ExposureAdvice, MotionLimitIsBlurOverSpeed) {
  EXPECT_EQ(*motion_limit_s({50, 2}), 0.04);
  for (const Motion& wrong : {Motion{0, 1}, {-1, 1}, {1, 0}, {nan, 1}, {1, nan}, {inf, 1}, {1e-9, 1}, {1, inf}}) {
    EXPECT_FALSE(motion_limit_s(wrong));
  }
}

TEST(ExposureAdvice, RefusesWhatCannotBeAndSaysWhich) {
  struct Case {
    void (*spoil)(AdviceRequest&);
    const char* says;
  };
  for (const Case& c : {Case{[](AdviceRequest& r) { r.gains.clear(); }, "no gain setting"},
                        {[](AdviceRequest& r) { r.gains[1].sensor.full_well_e = nan; }, "full well"},
                        {[](AdviceRequest& r) {
                           r.gains[1].white_e_per_s = {0, 0, 0};
                         },
                         "no channel is sensitive to the light"},
                        {[](AdviceRequest& r) { r.gains[1].white_e_per_s[2] = -1; }, "electrons of a white"},
                        {[](AdviceRequest& r) { r.gains[1].white_e_per_s[2] = inf; }, "electrons of a white"},
                        {[](AdviceRequest& r) { r.midtone_cd_m2 = 0; }, "mid tone's luminance"},
                        {[](AdviceRequest& r) { r.midtone_cd_m2 = nan; }, "mid tone's luminance"},
                        {[](AdviceRequest& r) { r.highlight_cd_m2 = 0.01; }, "at least as bright"},
                        {[](AdviceRequest& r) { r.highlight_cd_m2 = inf; }, "at least as bright"},
                        {[](AdviceRequest& r) { r.clipped_fraction = 0; }, "allowed to clip"},
                        {[](AdviceRequest& r) { r.clipped_fraction = 0.6; }, "allowed to clip"},
                        {[](AdviceRequest& r) { r.longest_exposure_s = 0; }, "longest exposure"},
                        {[](AdviceRequest& r) { r.longest_exposure_s = inf; }, "exposure time"},
                        {[](AdviceRequest& r) { r.temperature_c = -300; }, "temperature"},
                        {[](AdviceRequest& r) { r.patch_pixels = 0; }, "patch"},
                        {[](AdviceRequest& r) { r.frames = 0; }, "frames"},
                        {[](AdviceRequest& r) { r.curve_points = 1; }, "curve"},
                        {[](AdviceRequest& r) { r.camera_to_xyz[1][1] = nan; }, "matrix"},
                        {[](AdviceRequest& r) { r.camera_to_xyz = {}; }, "no chromaticity"},
                        {[](AdviceRequest& r) { r.gains[3].sensor.read_noise_e = 500; }, "noise alone clips"}}) {
    AdviceRequest r = request_of(0.05, 1, 0.02);
    ASSERT_TRUE(advise_exposure(r));
    c.spoil(r);
    const auto advice = advise_exposure(r);
    ASSERT_FALSE(advice) << c.says;
    EXPECT_TRUE(holds(advice.error().message, c.says)) << advice.error().message;
    EXPECT_EQ(advice.error().message.find('\n'), std::string::npos);
  }
}

TEST(ExposureAdvice, StaysFiniteAtTheEndsOfItsRange) {
  for (const double luminance : {1e-12, 1e12}) {
    for (const double longest : {1e-12, 1e6}) {
      const auto advice = advise_exposure(request_of(luminance, luminance, longest));
      if (!advice) continue;  // a full pixel of dark current
      for (const AdvicePoint& point : advice->curve) {
        if (!point.midtone) continue;
        EXPECT_TRUE(std::isfinite(point.midtone->snr) && std::isfinite(point.midtone->uv_std));
      }
    }
  }
}

}  // namespace
}  // namespace lowlux::isp
