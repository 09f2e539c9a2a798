#include "isp/output/picture/icc.h"

#include <gtest/gtest.h>
#include <lcms2.h>

#include <array>
#include <cmath>
#include <memory>

#include "isp/base/matrix3.h"
#include "isp/model/colour/colorimetry.h"

namespace lowlux::isp {
namespace {

constexpr std::array<OutputSpace, 5> with_profile{OutputSpace::srgb, OutputSpace::display_p3, OutputSpace::rec2020,
                                                  OutputSpace::linear_srgb, OutputSpace::linear_rec2020};

struct CloseProfile {
  void operator()(cmsHPROFILE profile) const { cmsCloseProfile(profile); }
};
using Profile = std::unique_ptr<std::remove_pointer_t<cmsHPROFILE>, CloseProfile>;

Profile open(const std::vector<std::byte>& bytes) {
  return Profile(cmsOpenProfileFromMem(bytes.data(), static_cast<cmsUInt32Number>(bytes.size())));
}

/// XYZ under D50 of encoded RGB, as a colour-managed reader of the profile computes it.
Vector3 read_by_profile(OutputSpace space, const Vector3& rgb) {
  const Profile profile = open(icc_profile(space));
  const Profile xyz(cmsCreateXYZProfile());
  cmsHTRANSFORM transform = cmsCreateTransform(profile.get(), TYPE_RGB_DBL, xyz.get(), TYPE_XYZ_DBL,
                                               INTENT_RELATIVE_COLORIMETRIC, cmsFLAGS_NOOPTIMIZE);
  Vector3 out{};
  cmsDoTransform(transform, rgb.data(), out.data(), 1);
  cmsDeleteTransform(transform);
  return out;
}

/// Light of a code value by the standard's own words.
double light(OutputSpace space, double code) {
  if (is_linear(space)) return code;
  if (space == OutputSpace::rec2020) {  // BT.2020-2 table 4
    return code < 4.5 * 0.0181 ? code / 4.5 : std::pow((code + 0.0993) / 1.0993, 1 / 0.45);
  }
  return code <= 0.04045 ? code / 12.92 : std::pow((code + 0.055) / 1.055, 2.4);  // IEC 61966-2-1
}

RgbPrimaries primaries(OutputSpace space) {
  if (space == OutputSpace::display_p3) return primaries_p3_d65;
  return space == OutputSpace::srgb || space == OutputSpace::linear_srgb ? primaries_rec709 : primaries_rec2020;
}

TEST(IccProfile, ReadersSeeTheColoursOfTheStandards) {
  // The D50 of ICC profiles is (0.9642, 1, 0.8249), ICC.1:2022 7.2.16.
  constexpr Xy icc_d50{0.9642 / (0.9642 + 1 + 0.8249), 1 / (0.9642 + 1 + 0.8249)};
  for (const OutputSpace space : with_profile) {
    const Matrix3 to_d50 = *bradford_adaptation(white_d65, icc_d50) * *rgb_to_xyz(primaries(space));
    for (const Vector3& rgb :
         {Vector3{1, 1, 1}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.5, 0.25, 0.75}, {0.03, 0.02, 0.01}, {0.2, 0.2, 0.2}}) {
      const Vector3 expected = to_d50 * Vector3{light(space, rgb[0]), light(space, rgb[1]), light(space, rgb[2])};
      const Vector3 seen = read_by_profile(space, rgb);
      // Profiles hold numbers in steps of 2^-16 = 1.5e-5; three of them, and the curve's five, add up.
      for (int i = 0; i < 3; ++i) EXPECT_NEAR(seen[i], expected[i], 1e-4) << static_cast<int>(space) << " " << i;
    }
  }
}

TEST(IccProfile, WhiteIsThatOfTheConnectionSpace) {
  for (const OutputSpace space : with_profile) {
    const Vector3 white = read_by_profile(space, {1, 1, 1});
    EXPECT_NEAR(white[0], 0.9642, 1e-4);
    EXPECT_NEAR(white[1], 1.0, 1e-4);
    EXPECT_NEAR(white[2], 0.8249, 1e-4);
  }
}

TEST(IccProfile, BytesAreTheSameEveryTimeAndHaveAnIdAndNoDate) {
  for (const OutputSpace space : with_profile) {
    const auto bytes = icc_profile(space);
    ASSERT_GT(bytes.size(), 128U);
    EXPECT_LT(bytes.size(), 2000U);
    EXPECT_EQ(bytes, icc_profile(space));
    for (int i = 24; i < 36; ++i) EXPECT_EQ(bytes[i], std::byte{0});
    const Profile profile = open(bytes);
    std::array<cmsUInt8Number, 16> stored{}, computed{};
    cmsGetHeaderProfileID(profile.get(), stored.data());
    ASSERT_TRUE(cmsMD5computeID(profile.get()));
    cmsGetHeaderProfileID(profile.get(), computed.data());
    EXPECT_EQ(stored, computed);
    EXPECT_NE(stored, (std::array<cmsUInt8Number, 16>{}));
  }
}

TEST(IccProfile, ProfilesAreNamedAfterTheirSpace) {
  const auto name = [](OutputSpace space) {
    const Profile profile = open(icc_profile(space));
    std::array<char, 100> text{};
    cmsGetProfileInfoASCII(profile.get(), cmsInfoDescription, "en", "US", text.data(), text.size());
    return std::string(text.data());
  };
  EXPECT_EQ(name(OutputSpace::srgb), "sRGB");
  EXPECT_EQ(name(OutputSpace::display_p3), "Display P3");
  EXPECT_EQ(name(OutputSpace::rec2020), "Rec. 2020");
  EXPECT_EQ(name(OutputSpace::linear_srgb), "Linear sRGB");
  EXPECT_EQ(name(OutputSpace::linear_rec2020), "Linear Rec. 2020");
  EXPECT_EQ(name(OutputSpace::xyz), "CIE XYZ, white D65");
}

TEST(IccProfile, ReadersOfXyzSeeXyz) {
  constexpr Xy icc_d50{0.9642 / (0.9642 + 1 + 0.8249), 1 / (0.9642 + 1 + 0.8249)};
  const Matrix3 to_d50 = *bradford_adaptation(white_d65, icc_d50);
  for (const Vector3& xyz : {Vector3{0.9505, 1, 1.089}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.2, 0.1, 0.7}}) {
    const Vector3 expected = to_d50 * xyz, seen = read_by_profile(OutputSpace::xyz, xyz);
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(seen[i], expected[i], 1e-4) << i;
  }
}

TEST(IccProfile, ASpaceThatNoRgbProfileDescribesHasNone) { EXPECT_TRUE(icc_profile(OutputSpace::camera).empty()); }

/// A reader that converts RGB of these chromaticities to XYZ must get the numbers it started from.
TEST(ChromaticitiesOf, XyzAreThoseThatLeaveXyzAsItIs) {
  const auto c = chromaticities_of(OutputSpace::xyz);
  ASSERT_TRUE(c);
  const auto column = [](const Chromaticities::Xy& xy) { return Vector3{xy.x, xy.y, 1 - xy.x - xy.y}; };
  EXPECT_EQ(column(c->red), (Vector3{1, 0, 0}));
  EXPECT_EQ(column(c->green), (Vector3{0, 1, 0}));
  EXPECT_EQ(column(c->blue), (Vector3{0, 0, 1}));
  EXPECT_NEAR(c->white.x, 1.0 / 3, 1e-15);
  EXPECT_NEAR(c->white.y, 1.0 / 3, 1e-15);
}

TEST(ChromaticitiesOf, CameraPrimariesAreNotKnown) { EXPECT_FALSE(chromaticities_of(OutputSpace::camera)); }

}  // namespace
}  // namespace lowlux::isp
