#include "calib/profile/profile_use.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <random>
#include <string>

#include <gtest/gtest.h>

#include "calib/profile/profile_io.h"
#include "calib/profile/quoted_profile.h"
#include "isp/model/sensor/sensor_db.h"

namespace lowlux::calib {
namespace {

GainProfile gain_at(double iso, double k_dn_per_e, double read_noise_e, double pedestal_dn) {
  GainProfile out;
  out.iso = iso;
  out.sensor = SensorModel{.name = "S",
                           .system_gain_dn_per_e = k_dn_per_e,
                           .read_noise_e = read_noise_e,
                           .full_well_e = 3000,
                           .bits = 14,
                           .black_level_dn = pedestal_dn,
                           .white_level_dn = 16383,
                           .dark_current_e_per_s = {2, 4, 6},
                           .dark_temperature_c = 20,
                           .dark_doubling_c = 6};
  out.errors.dark_current_e_per_s = {0.1, 0.1, 0.1};
  out.errors.dark_doubling_c = 0.1;
  out.pedestal_dn.emplace();
  for (int site = 0; site < 4; ++site) (*out.pedestal_dn)[site] = {pedestal_dn + site, 0.3};
  out.dark_exposure_s = MeasuredRange{0, 10};
  out.dark_temperature_c = MeasuredRange{15, 30};
  out.hot_pixels = {{3, 2, 100}, {5, 1, 1}, {900, 1, 1000}};
  return out;
}

CameraProfile two_gains() { return {"M", "C", {gain_at(100, 1, 4, 500), gain_at(400, 4, 2, 516)}, {}}; }

RawDn frame(std::optional<double> iso, std::optional<double> time_s, std::optional<double> celsius) {
  RawDn raw;
  raw.dn = Plane<std::uint16_t>(16, 16);
  raw.active = raw.default_crop = {0, 0, 16, 16};
  raw.phase = BayerPhase::grbg;
  raw.white_dn = {16383, 16383, 16383};
  raw.info.make = "M";
  raw.info.model = "C";
  raw.info.iso = iso;
  raw.info.exposure_s = time_s;
  raw.info.temperature_c = celsius;
  return raw;
}

TEST(ProfileUse, AddsDarkChargeOfTheExposureAndTemperature) {
  const auto found = profile_at(two_gains(), frame(100, 5, 26));  // one doubling above 20 C
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_TRUE(found->warnings.empty());
  // GRBG: sites are G, R, B, G; 2 D t electrons at 1 DN/e-.
  const PerSite<double> charge{40, 20, 60, 40};
  for (int site = 0; site < 4; ++site) {
    EXPECT_NEAR(found->dark_mean_e[site], charge[site], 1e-12);
    EXPECT_NEAR(found->black->pedestal_dn[site], 500 + site + charge[site], 1e-12);
    EXPECT_NEAR(found->black->pedestal_standard_error_dn[site], std::hypot(0.3, 0.1 * 2 * 5), 1e-12);
    EXPECT_NEAR(found->black->noise_std_dn[site], std::sqrt(16 + charge[site] + 1.0 / 12), 1e-12);
  }
  EXPECT_EQ(found->black->holds, BlackPoint::Holds::pedestal_and_dark);
  EXPECT_EQ(found->black->source, BlackPoint::Source::profile);
  EXPECT_NEAR(found->sensor->dark_current_e_per_s[2], 12, 1e-12);
}

// Two currents with independent errors, measured at two temperatures, state the doubling. Beyond them the standard
// error of the black level is that of the line through their logarithms, or up to 1.09 times as large.
TEST(ProfileUse, TheErrorOfTheDoublingCountsBeyondTheTemperaturesOfTheDarks) {
  constexpr unsigned seed = 20261128;
  std::mt19937_64 engine(seed);
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution(low, high)(engine); };
  for (int i = 0; i < 200; ++i) {
    const double low_c = uniform(-20, 40), apart_c = uniform(1, 20), relative_error = std::pow(10, uniform(-4, -1));
    GainProfile gain = gain_at(100, 1, 4, 500);
    SensorModel& sensor = *gain.sensor;
    sensor.dark_temperature_c = low_c + apart_c;
    sensor.dark_doubling_c = uniform(4, 12);
    for (std::size_t k = 0; k < 3; ++k) {
      gain.errors.dark_current_e_per_s[k] = relative_error * sensor.dark_current_e_per_s[k];
    }
    const double slope_error = std::numbers::sqrt2 * relative_error / apart_c;  // of the logarithm, per degree
    gain.errors.dark_doubling_c = slope_error * sensor.dark_doubling_c * sensor.dark_doubling_c / std::numbers::ln2;
    gain.dark_temperature_c = MeasuredRange{low_c, low_c + apart_c};
    for (const bool is_warmer : {true, false}) {
      const double beyond = uniform(0, 3);  // distances of the two temperatures
      const double celsius = is_warmer ? low_c + (1 + beyond) * apart_c : low_c - beyond * apart_c;
      const auto found = profile_at({"M", "C", {gain}, {}}, frame(100, 5, celsius));
      ASSERT_TRUE(found);
      const double line_error = relative_error * std::hypot(1 + beyond, beyond);
      const double stated = found->black->pedestal_standard_error_dn[0], charge = found->dark_mean_e[0];
      const double of_charge = std::sqrt(stated * stated - 0.3 * 0.3) / charge;
      if (line_error * charge < 0.01) continue;                                       // DN, next to 0.3 of the pedestal
      EXPECT_GT(of_charge / line_error, 0.999) << "seed " << seed << ", draw " << i;  // roundings
      EXPECT_LT(of_charge / line_error, 1.09) << "seed " << seed << ", draw " << i;
    }
  }
}

TEST(ProfileUse, FitsRawsThatNameTheCameraAsTheFileOrTheDecoderDoes) {
  const std::array<std::array<std::string, 2>, 2> names{{{"NIKON CORPORATION", "NIKON D750"}, {"Nikon", "D750"}}};
  for (const auto& of_profile : names) {
    for (const auto& of_frame : names) {
      CameraProfile profile = two_gains();
      profile.make = of_profile[0];
      profile.model = of_profile[1];
      RawDn raw = frame(100, 5, 20);
      raw.info.make = of_frame[0];
      raw.info.model = of_frame[1];
      EXPECT_TRUE(profile_at(profile, raw)) << of_profile[1] << " and " << of_frame[1];
      raw.info.model = "D7500";
      EXPECT_FALSE(profile_at(profile, raw));
    }
  }
}

TEST(ProfileUse, NoiseIsTheSensorsInSharesOfTheRange) {
  const auto found = profile_at(two_gains(), frame(100, 5, 20));
  ASSERT_TRUE(found && found->noise);
  const double range = 16383 - (501 + 10);  // red: one site
  EXPECT_NEAR(found->noise->scale[0], 1 / range, 1e-15);
  EXPECT_NEAR(found->noise->offset[0], (16 + 10 + 1.0 / 12) / (range * range), 1e-15);
  const double ranges[] = {16383 - 520.0, 16383 - 523.0};  // green: two sites
  EXPECT_NEAR(found->noise->scale[1], (1 / ranges[0] + 1 / ranges[1]) / 2, 1e-15);
}

/// A black point as masked pixels measure it: pedestal of the profile at ISO 100 plus so much charge.
BlackPoint masked_black(double charge_e, double std_dn) {
  BlackPoint out{.holds = BlackPoint::Holds::pedestal_and_dark, .source = BlackPoint::Source::masked_pixels};
  for (int site = 0; site < 4; ++site) out.pedestal_dn[site] = 500 + site + charge_e;  // 1 DN/e-
  out.noise_std_dn.fill(std_dn);
  return out;
}

/// Returns the variance of black in green [DN^2] that a noise profile states above a black point.
double green_variance_dn2(const NoiseProfile& noise, const BlackPoint& black) {
  const double range = 16383 - (black.pedestal_dn[0] + black.pedestal_dn[3]) / 2;
  return noise.offset[1] * range * range;
}

// The frame states no temperature: the profile assumes that of its darks, and its charge is up to a thousand times that
// of the frame, or a thousandth of it. The noise is that of the masked pixels all the same.
TEST(ProfileUse, NoiseFollowsFromTheDarkChargeOfMaskedPixels) {
  const RawDn raw = frame(100, 10, std::nullopt);
  const auto found = profile_at(two_gains(), raw);
  ASSERT_TRUE(found && found->noise);
  const double assumed = green_variance_dn2(*found->noise, *found->black);
  EXPECT_NEAR(assumed, 16 + 40 + 1.0 / 12, 1e-3) << "10 s at 20 C";
  constexpr unsigned seed = 20261124;
  std::mt19937_64 engine(seed);
  for (int i = 0; i < 200; ++i) {
    const double charge_e = std::pow(10, std::uniform_real_distribution(-2.0, 4.0)(engine));
    const double truth = 16 + charge_e + 1.0 / 12;
    const BlackPoint black = masked_black(charge_e, std::sqrt(truth));
    const auto noise = noise_above(black, *found, raw);
    ASSERT_TRUE(noise);
    EXPECT_NEAR(noise->scale[0], 1 / (16383 - black.pedestal_dn[1]), 1e-15) << "seed " << seed << " draw " << i;
    // Greens of ranges one part in 4000 apart.
    EXPECT_NEAR(green_variance_dn2(*noise, black), truth, 1e-6 * truth) << "seed " << seed << " draw " << i;
  }
}

TEST(ProfileUse, ALevelThatDriftedAddsNoNoiseThatMaskedPixelsDoNotShow) {
  const RawDn raw = frame(100, 10, std::nullopt);
  auto found = profile_at(two_gains(), raw);
  ASSERT_TRUE(found && found->pedestal_dn);
  const auto variance = [&](double above_dn, double variance_dn2) {
    const BlackPoint black = masked_black(above_dn, std::sqrt(variance_dn2));
    return green_variance_dn2(*noise_above(black, *found, raw), black);
  };
  constexpr double reading = 16 + 1.0 / 12;
  EXPECT_NEAR(variance(30, 20), 20, 1e-3);  // 30 DN above the pedestal, without the shot noise of as much charge
  EXPECT_NEAR(variance(3, 30), reading + 3, 1e-3);  // masked pixels with a fixed pattern
  EXPECT_NEAR(variance(-5, 30), reading, 1e-3);     // below the pedestal
  EXPECT_NEAR(variance(3, 10), reading, 1e-3);      // at least that of reading
  found->pedestal_dn.reset();                       // the profile does not know the level without dark charge
  EXPECT_NEAR(variance(30, 25), 25, 1e-3);
  BlackPoint tagged = masked_black(0, 0);
  tagged.source = BlackPoint::Source::tag;  // nothing was measured: the charge is the profile's
  EXPECT_NEAR(green_variance_dn2(*noise_above(tagged, *found, raw), tagged), reading + 40, 1e-3);
  BlackPoint dark_frame = masked_black(300, 999);  // the temporal noise of a dark frame is not that of the image
  dark_frame.source = BlackPoint::Source::dark_frame;
  EXPECT_NEAR(green_variance_dn2(*noise_above(dark_frame, *found, raw), dark_frame), reading + 40, 1e-3)
      << "the charge in the dark frame is not known apart from its pedestal";
  found->pedestal_dn.emplace(PerSite<double>{500, 501, 502, 503});
  EXPECT_NEAR(green_variance_dn2(*noise_above(dark_frame, *found, raw), dark_frame), reading + 300, 1e-3);
  dark_frame.holds = BlackPoint::Holds::pedestal_only;  // a bias frame lacks the dark charge of the image
  EXPECT_NEAR(green_variance_dn2(*noise_above(dark_frame, *found, raw), dark_frame), reading + 40, 1e-3);
  tagged.pedestal_dn.fill(20000);
  EXPECT_FALSE(noise_above(tagged, *found, raw)) << "black is not below white";
}

TEST(ProfileUse, BetweenTwoGainsLinesAreStraightInLogarithms) {
  const auto found = profile_at(two_gains(), frame(200, 0, 20));  // half way in the logarithm
  ASSERT_TRUE(found);
  EXPECT_TRUE(found->warnings.empty());
  EXPECT_NEAR(found->sensor->system_gain_dn_per_e, 2, 1e-12);
  EXPECT_NEAR(found->sensor->read_noise_e, std::sqrt(8.0), 1e-12);
  EXPECT_NEAR(found->black->pedestal_dn[0], 508, 1e-9);
}

TEST(ProfileUse, BeyondTheGainsTheIsoCountsAndItSaysSo) {
  const auto found = profile_at(two_gains(), frame(1600, 0, 20));
  ASSERT_TRUE(found);
  ASSERT_EQ(found->warnings.size(), 1U);
  EXPECT_NE(found->warnings[0].find("ISO 1600 is outside the range of the profile (100, 400)"), std::string::npos);
  EXPECT_NEAR(found->sensor->system_gain_dn_per_e, 16, 1e-12);
  EXPECT_NEAR(found->sensor->full_well_e, (16383 - 516) / 16.0, 1e-9);
  const auto below = profile_at(two_gains(), frame(50, 0, 20));
  ASSERT_TRUE(below);
  EXPECT_NEAR(below->sensor->system_gain_dn_per_e, 0.5, 1e-12);
  EXPECT_EQ(below->warnings.size(), 1U);
}

TEST(ProfileUse, ExtrapolationInTimeAndTemperatureIsSaid) {
  const auto warnings = [](std::optional<double> time_s, std::optional<double> celsius) {
    const auto found = profile_at(two_gains(), frame(100, time_s, celsius));
    EXPECT_TRUE(found);
    return found->warnings;
  };
  EXPECT_TRUE(warnings(10, 30).empty());
  ASSERT_EQ(warnings(20, 30).size(), 1U);
  EXPECT_NE(warnings(20, 30)[0].find("longer than those of the darks of the profile, 0 to 10 s"), std::string::npos);
  ASSERT_EQ(warnings(10, 40).size(), 1U);
  EXPECT_NE(warnings(10, 40)[0].find("15 to 30 C"), std::string::npos);
  EXPECT_EQ(warnings(10, std::nullopt).size(), 1U);
  EXPECT_TRUE(warnings(1e-3, 60).empty());  // there is no charge to speak of
  EXPECT_TRUE(warnings(1e-3, std::nullopt).empty());
}

TEST(ProfileUse, APedestalThatHoldsDarkIsNotScaled) {
  CameraProfile profile = two_gains();
  profile.gains.pop_back();
  profile.gains[0].pedestal_holds = BlackPoint::Holds::pedestal_and_dark;
  profile.gains[0].dark_exposure_s = MeasuredRange{2, 2};
  const auto same = profile_at(profile, frame(100, 2, 20));
  ASSERT_TRUE(same);
  EXPECT_TRUE(same->warnings.empty());
  EXPECT_EQ(same->black->pedestal_dn[3], 503);
  EXPECT_EQ(profile_at(profile, frame(100, 4, 20))->warnings.size(), 1U);
  EXPECT_EQ(profile_at(profile, frame(100, 1, 20))->warnings.size(), 1U);
  EXPECT_TRUE(profile_at(profile, frame(100, std::nullopt, 20)));
}

TEST(ProfileUse, WithoutAKnownGainThereIsABlackPointAlone) {
  CameraProfile profile = two_gains();
  profile.gains.pop_back();
  profile.gains[0].sensor.reset();
  const auto found = profile_at(profile, frame(100, 2, 20));
  ASSERT_TRUE(found);
  EXPECT_FALSE(found->sensor);
  EXPECT_FALSE(found->noise);
  EXPECT_EQ(found->black->pedestal_dn[0], 500);
  EXPECT_TRUE(found->hot_pixels.empty());
}

TEST(ProfileUse, NamesHotPixelsThatStandOutInThisExposure) {
  // At 4 s 100 e-/s are 400 e-, 1 e-/s is 4 e-: 6 deviations of sqrt(16 + 16) e- lie between. (900, 1) is outside.
  const auto found = profile_at(two_gains(), frame(100, 4, 20));
  ASSERT_EQ(found->hot_pixels.size(), 1U);
  EXPECT_EQ(found->hot_pixels[0].x, 3);
  EXPECT_EQ(found->hot_pixels[0].y, 2);
  EXPECT_TRUE(profile_at(two_gains(), frame(100, 0, 20))->hot_pixels.empty());
}

TEST(ProfileUse, RefusesWhatItCannotTell) {
  const auto message = [](const CameraProfile& profile, const RawDn& raw) {
    const auto found = profile_at(profile, raw);
    return found ? std::string() : found.error().message;
  };
  EXPECT_NE(message(two_gains(), frame(std::nullopt, 1, 20)).find("states no ISO"), std::string::npos);
  EXPECT_NE(message(two_gains(), frame(100, std::nullopt, 20)).find("exposure time"), std::string::npos);
  const auto nothing = profile_at({}, frame(100, 1, 20));  // colours alone, perhaps
  ASSERT_TRUE(nothing);
  EXPECT_FALSE(nothing->black || nothing->sensor || nothing->noise);
  RawDn other = frame(100, 1, 20);
  other.info.model = "D";
  EXPECT_NE(message(two_gains(), other).find("\"M D\""), std::string::npos);
  other.info.model = "C";
  other.layout = SensorLayout::linear_rgb;
  EXPECT_NE(message(two_gains(), other).find("demosaiced"), std::string::npos);
  CameraProfile unmeasured = two_gains();
  unmeasured.gains[0].pedestal_dn.reset();
  const auto noise_only = profile_at(unmeasured, frame(100, 1, 20));
  ASSERT_TRUE(noise_only && noise_only->noise);
  EXPECT_FALSE(noise_only->black);
  // Range and noise are those above the pedestal and the known dark charge, which is then subtracted.
  const double dark_dn =
      noise_only->sensor->system_gain_dn_per_e * noise_only->sensor->dark_current_e_per_s[0];  // in 1 s
  EXPECT_GT(dark_dn, 0);
  EXPECT_NEAR(noise_only->noise->scale[0], 1.0 / (16383 - 500 - dark_dn), 1e-15);
  RawDn tagged = frame(100, 1, 20);
  tagged.black_tag = BlackLevel{.pattern_dn = {383}};
  EXPECT_NEAR(profile_at(unmeasured, tagged)->noise->scale[0], 1.0 / (16000 - dark_dn), 1e-15);
  CameraProfile one = two_gains();
  one.gains.pop_back();
  const auto only = profile_at(one, frame(std::nullopt, 1, 20));
  ASSERT_TRUE(only);
  EXPECT_EQ(only->warnings.size(), 1U);  // that the only setting is taken
}

TEST(ProfileUse, GainsThatWereNotMeasuredAlikeAreNotMixed) {
  CameraProfile profile = two_gains();
  profile.gains[1].pedestal_holds = BlackPoint::Holds::pedestal_and_dark;
  const auto near_low = profile_at(profile, frame(150, 5, 20));
  ASSERT_TRUE(near_low);
  ASSERT_EQ(near_low->warnings.size(), 1U);
  EXPECT_NE(near_low->warnings[0].find("not measured in the same way"), std::string::npos);
  EXPECT_NEAR(near_low->black->pedestal_dn[0], 500 + 1.5 * 20, 1e-9);  // gain by the ISO, charge in electrons
}

TEST(ProfileUse, WithoutDarksTheDarkChargeStaysInAndItSaysSo) {
  CameraProfile profile = two_gains();
  for (GainProfile& gain : profile.gains) {
    gain.sensor->dark_current_e_per_s = {};
    gain.dark_exposure_s.reset();
    gain.dark_temperature_c.reset();
  }
  const auto found = profile_at(profile, frame(100, 5, 20));
  ASSERT_TRUE(found);
  EXPECT_EQ(found->black->holds, BlackPoint::Holds::pedestal_only);
  EXPECT_EQ(found->warnings.size(), 1U);
}

TEST(ProfileUse, DarksWithoutTemperatureAreNotScaled) {
  CameraProfile profile = two_gains();
  for (GainProfile& gain : profile.gains) gain.dark_temperature_c.reset();
  const auto found = profile_at(profile, frame(100, 5, -10));
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->dark_mean_e[0], 20, 1e-12);
  EXPECT_EQ(found->warnings.size(), 1U);
}

TEST(ProfileUse, AGainWithoutIsoIsThatOfFramesWithoutIso) {
  CameraProfile profile = two_gains();
  profile.gains.push_back(profile.gains[0]);
  profile.gains[2].iso.reset();
  (*profile.gains[2].pedestal_dn)[0].value = 600;
  const auto found = profile_at(profile, frame(std::nullopt, 0, 20));
  ASSERT_TRUE(found);
  EXPECT_EQ(found->black->pedestal_dn[0], 600);
}

TEST(ProfileUse, MonochromeSensorsHaveTheMiddleChannel) {
  RawDn raw = frame(100, 1, 20);
  raw.layout = SensorLayout::monochrome;
  const auto found = profile_at(two_gains(), raw);
  ASSERT_TRUE(found && found->noise);
  for (int site = 0; site < 4; ++site) EXPECT_EQ(found->dark_mean_e[site], 4);
  EXPECT_EQ(found->noise->scale[0], found->noise->scale[1]);
  EXPECT_EQ(found->noise->scale[2], found->noise->scale[1]);
}

TEST(QuotedProfile, OfEverySensorThatSufficesIsAProfile) {
  int made = 0;
  for (const std::string_view name : isp::sensor_names()) {
    const auto profile = quoted_profile(name);
    if (!profile) {
      EXPECT_FALSE(profile.error().message.empty());
      continue;
    }
    ++made;
    const auto text = profile_text(*profile);
    ASSERT_TRUE(text) << name << ": " << text.error().message;
    EXPECT_TRUE(parse_profile(*text));
    for (const GainProfile& gain : profile->gains) {
      for (const Provenance& p : gain.provenance) EXPECT_EQ(p.kind, Provenance::Kind::quoted);
      EXPECT_FALSE(gain.provenance.empty());
    }
  }
  EXPECT_GE(made, 10);
  EXPECT_FALSE(quoted_profile("no such sensor"));
}

// The mean of floor(v) over a spread of v is half a code below that of v.
TEST(QuotedProfile, PedestalOfAConverterThatRoundsDownIsHalfACodeLower) {
  const auto floor = quoted_profile("thesis"), round = quoted_profile("RaspberryPi_HQ");
  ASSERT_TRUE(floor && round);
  const GainProfile &down = floor->gains.front(), &nearest = round->gains.front();
  ASSERT_TRUE(down.pedestal_dn && nearest.pedestal_dn);
  EXPECT_EQ((*down.pedestal_dn)[0].value, down.sensor->black_level_dn - 0.5);
  EXPECT_EQ((*nearest.pedestal_dn)[0].value, nearest.sensor->black_level_dn);
}

}  // namespace
}  // namespace lowlux::calib
