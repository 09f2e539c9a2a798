#include "isp/cli/shared/profile_option.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "isp/cli/calibrate/calibration.h"
#include "isp/pipeline/plan/plan_develop.h"
#include "tests/pipeline/night_frames.h"

namespace lowlux::cli::profile_option_test {
namespace {

constexpr int border = 64, side = 256;
constexpr double read_noise_e = 2;

/// The profile of the camera of night_frame: 4 DN/e-, a pedestal of 512 DN, and 10 e-/s at 20 C.
CameraProfile profile() {
  GainProfile gain;
  gain.iso = 100;
  gain.sensor = SensorModel{.system_gain_dn_per_e = test::night_gain_dn_per_e,
                            .read_noise_e = read_noise_e,
                            .full_well_e = test::night_full_e(),
                            .bits = 14,
                            .black_level_dn = test::night_black_dn,
                            .white_level_dn = test::night_white_dn,
                            .dark_current_e_per_s = {10, 10, 10},
                            .dark_temperature_c = 20};
  gain.pedestal_dn.emplace();
  gain.pedestal_dn->fill({test::night_black_dn, 0.1});
  CameraProfile out;
  out.gains = {gain};
  return out;
}

/// A frame of 4 s that states no temperature: the profile assumes 40 e- of dark charge.
RawFrame frame_of(double dark_e) {
  RawFrame frame = test::night_frame({.dark_e = {dark_e, dark_e, dark_e, dark_e}, .read_noise_e = read_noise_e},
                                     denoise_testing::flat(0, 0, 0), border + side, side);
  frame.raw.info.iso = 100;
  frame.raw.info.exposure_s = 4;
  frame.noise.reset();
  return frame;
}

void mask_border(RawFrame& frame) {
  frame.raw.active = frame.raw.default_crop = {border, 0, side, side};
  frame.raw.masked = {{0, 0, border, side}};
  frame.raw.masked_is_stated = true;
}

struct Used {
  BlackPoint black;
  double variance_e2 = 0;  // of green without light
};

Used use(RawFrame frame, isp::DevelopOptions options) {
  const auto used = use_profile(profile(), {.everything = true}, frame, options);
  EXPECT_TRUE(used) << used.error().message;
  const auto black = isp::choose_black_by_gain(frame, options.black);
  EXPECT_TRUE(black) << black.error().message;
  EXPECT_TRUE(frame.noise && frame.noise->source == NoiseProfile::Source::profile);
  return {*black, frame.noise->offset[1] / std::pow(frame.noise->scale[1], 2)};
}

TEST(ProfileOption, AddsTheDarkChargeToAPedestalOfTheFileOrOfTheUser) {
  RawFrame frame = frame_of(40);
  frame.raw.black_tag = BlackLevel{.pattern_dn = {500}};
  constexpr double charge_dn = 40 * test::night_gain_dn_per_e, tolerance_dn = 1e-9;
  isp::DevelopOptions options;
  EXPECT_NEAR(use(frame_of(40), options).black.pedestal_dn[0], test::night_black_dn + charge_dn, tolerance_dn);
  options.black.choice = isp::BlackChoice::metadata;
  EXPECT_NEAR(use(std::move(frame), options).black.pedestal_dn[0], 500 + charge_dn, tolerance_dn);
  options.black = {.choice = isp::BlackChoice::given, .given_dn = {1, 2, 3, 4}};
  const Used given = use(frame_of(40), options);
  for (int site = 0; site < 4; ++site) {
    EXPECT_NEAR(given.black.pedestal_dn[site], 1 + site + charge_dn, tolerance_dn);
  }
  EXPECT_EQ(given.black.holds, BlackPoint::Holds::pedestal_and_dark);
  EXPECT_NEAR(given.variance_e2, read_noise_e * read_noise_e + 40 + 1.0 / 192, 1e-6);
}

// The profile assumes 40 e-; the frame has as much, or less, or more.
TEST(ProfileOption, TakesTheNoiseFromTheMaskedPixelsWhereTheyGiveTheLevel) {
  for (const double dark_e : {0.5, 5.0, 40.0, 500.0}) {
    RawFrame frame = frame_of(dark_e);
    mask_border(frame);
    const Used used = use(std::move(frame), {});
    EXPECT_EQ(used.black.source, BlackPoint::Source::masked_pixels);
    const double truth = read_noise_e * read_noise_e + dark_e + 1.0 / 192, pixels = 48.0 * side;
    // Five standard errors of the level and of the variance of a site, which limits it.
    EXPECT_NEAR(used.variance_e2, truth, 5 * (std::sqrt(truth / pixels) + truth * std::sqrt(2 / (pixels / 4))))
        << dark_e << " e-";
  }
}

// Dark frames are made once for all images of one noise model: it must not follow the masked pixels of each.
TEST(ProfileOption, HasOneNoiseForAllImagesThatDarkFramesAreSubtractedFrom) {
  const auto noise_of = [](double dark_e) {
    RawFrame frame = frame_of(dark_e);
    mask_border(frame);
    isp::DevelopOptions options;
    EXPECT_TRUE(use_profile(profile(), {.everything = true, .with_darks = true}, frame, options));
    return *frame.noise;
  };
  const NoiseProfile one = noise_of(5), other = noise_of(50);
  EXPECT_EQ(one.scale, other.scale);
  EXPECT_EQ(one.offset, other.offset);
}

TEST(ProfileOption, FramesOfOneCameraAreAddedUnderEitherOfItsNames) {
  FrameInfo file, decoder, other;
  file.make = "Canon", file.model = "Canon EOS R";
  decoder.make = "Canon", decoder.model = "EOS R";
  other.make = "Canon", other.model = "Canon EOS R5";
  CameraProfile profile;
  ASSERT_TRUE(put_camera(decoder, profile));
  EXPECT_TRUE(put_camera(file, profile));
  EXPECT_EQ(profile.model, "EOS R");
  const auto refused = put_camera(other, profile);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("Canon EOS R5"), std::string::npos) << refused.error().message;
}

}  // namespace
}  // namespace lowlux::cli::profile_option_test
