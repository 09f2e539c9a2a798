#include "isp/render/output_space.h"

#include <gtest/gtest.h>

#include <cmath>

namespace lowlux::isp {
namespace {

TEST(OutputSpaceNames, AreThoseOfTheList) {
  for (const NamedOutputSpace& known : output_spaces) EXPECT_EQ(name_of(known.space), known.name);
}

TEST(OutputSpaceMatrix, TakesD65ToWhiteAndLuminanceIsKept) {
  const Vector3 white = vector_of(*xyz_of(output_white));
  for (const NamedOutputSpace& known : output_spaces) {
    const auto matrix = xyz_to_output(known.space);
    const auto weights = luminance_weights(known.space);
    if (known.space == OutputSpace::camera) {
      EXPECT_FALSE(matrix);
      EXPECT_FALSE(weights);
      continue;
    }
    ASSERT_TRUE(matrix && weights) << known.name;
    const Vector3 of_white = *matrix * white;
    const Vector3 of_colour = *matrix * Vector3{0.2, 0.3, 0.4};
    if (known.space != OutputSpace::xyz) {
      for (const double channel : of_white) EXPECT_NEAR(channel, 1, 1e-12) << known.name;
    }
    const Vector3& w = *weights;
    EXPECT_NEAR(w[0] * of_white[0] + w[1] * of_white[1] + w[2] * of_white[2], 1, 1e-12) << known.name;
    EXPECT_NEAR(w[0] * of_colour[0] + w[1] * of_colour[1] + w[2] * of_colour[2], 0.3, 1e-12) << known.name;
  }
  EXPECT_EQ(*xyz_to_output(OutputSpace::xyz), identity3());
}

TEST(OutputSpaceMatrix, OfSrgbAgreesWithIec61966) {
  // IEC 61966-2-1 amendment 1 prints the inverse with seven digits; its own XYZ matrix has four: 5e-4.
  const Matrix3 expected{{{3.2406, -1.5372, -0.4986}, {-0.9689, 1.8758, 0.0415}, {0.0557, -0.2040, 1.0570}}};
  const Matrix3 found = *xyz_to_output(OutputSpace::srgb);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) EXPECT_NEAR(found[i][j], expected[i][j], 5e-4);
  }
}

TEST(TransferFunction, HasItsPublishedValues) {
  EXPECT_NEAR(255 * encode_transfer(OutputSpace::srgb, 0.18), 117.6, 0.1);     // mid-grey is code 118
  EXPECT_NEAR(encode_transfer(OutputSpace::srgb, 0.0031308), 0.04045, 1e-5);   // IEC 61966-2-1, both sides
  EXPECT_NEAR(encode_transfer(OutputSpace::srgb, 0.00313081), 0.04045, 1e-5);  //
  EXPECT_NEAR(decode_transfer(OutputSpace::srgb, 0.5), 0.21404114, 1e-7);      //
  EXPECT_NEAR(encode_transfer(OutputSpace::rec2020, 0.01), 0.045, 1e-15);      // the linear part, 4.5 v
  EXPECT_NEAR(encode_transfer(OutputSpace::rec2020, 0.5), 1.0993 * std::pow(0.5, 0.45) - 0.0993, 1e-15);
  EXPECT_EQ(encode_transfer(OutputSpace::display_p3, 0.3), encode_transfer(OutputSpace::srgb, 0.3));
  for (const OutputSpace space :
       {OutputSpace::linear_srgb, OutputSpace::linear_rec2020, OutputSpace::xyz, OutputSpace::camera}) {
    EXPECT_EQ(encode_transfer(space, 0.3), 0.3);
    EXPECT_EQ(encode_transfer(space, 7), 7);
    EXPECT_EQ(decode_transfer(space, 0.3), 0.3);
  }
}

TEST(TransferFunction, RoundTripsIsOddAndRisesEverywhere) {
  for (const NamedOutputSpace& known : output_spaces) {
    double before = -1;
    for (int i = 0; i <= 20000; ++i) {
      const double v = i / 20000.0;
      const double code = encode_transfer(known.space, v);
      // The rounded constants leave steps at the knees: 3e-8 in v for IEC 61966-2-1, 1e-6 for BT.2020.
      EXPECT_NEAR(decode_transfer(known.space, code), v, 1e-6) << known.name << " " << v;
      EXPECT_EQ(encode_transfer(known.space, -v), -code);
      EXPECT_EQ(decode_transfer(known.space, -code), -decode_transfer(known.space, code));
      EXPECT_GT(code, before) << known.name << " " << v;
      before = code;
    }
    EXPECT_EQ(encode_transfer(known.space, 0), 0);
    EXPECT_NEAR(encode_transfer(known.space, 1), 1, 1e-15);
  }
}

TEST(TransferFunction, TheStepOfTheRec2020CurveIsWhatItsRoundingLeaves) {
  const double below = 4.5 * 0.0181, at = encode_transfer(OutputSpace::rec2020, 0.0181);
  EXPECT_LT(std::fabs(at - below), 2e-5);  // a tenth of a 12-bit code is 2.4e-5
}

TEST(SaturationMatrix, KeepsLuminanceAndNeutralsAndScalesTheDistanceToThem) {
  const Vector3 weights = *luminance_weights(OutputSpace::srgb);
  const auto luminance = [&](const Vector3& v) { return weights[0] * v[0] + weights[1] * v[1] + weights[2] * v[2]; };
  for (const double factor : {0.0, 0.5, 1.0, 2.0, 3.0}) {
    const Matrix3 m = saturation_matrix(factor, weights);
    for (const Vector3& rgb : {Vector3{0.3, 0.3, 0.3}, Vector3{0.9, 0.1, 0.2}, Vector3{-0.1, 0.5, 0.0}}) {
      const Vector3 out = m * rgb;
      EXPECT_NEAR(luminance(out), luminance(rgb), 1e-12);
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(out[c] - luminance(rgb), factor * (rgb[c] - luminance(rgb)), 1e-12);
    }
  }
}

}  // namespace
}  // namespace lowlux::isp
