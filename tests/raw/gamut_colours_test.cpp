#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <iostream>
#include <random>

#include "isp/model/appearance/gamut_map.h"
#include "isp/model/colour/colorimetry.h"
#include "isp/model/colour/colour_difference.h"
#include "tests/reference/raw_to_rgb_ref.h"

namespace lowlux {
namespace {

// A display that cannot show a colour shall show what looks nearest. Up to twice the display's white the result is on
// average nearer to the colour than a mixture with the grey of its luminance. RawToRgbGamut.EqualsTheReference holds
// the kernel to the same rule.
TEST(GamutColours, AreNearerToThoseAboveWhiteThanMixturesWithGreyOfTheirLuminance) {
  const Matrix3 to_xyz = isp::rgb_to_xyz(isp::primaries_rec709).value();
  const auto weights = std::array{0.2126f, 0.7152f, 0.0722f};
  const auto lab = [&](const Vector3& v) {
    return isp::lab_of(isp::xyz_of(to_xyz * v), isp::xyz_of(to_xyz * Vector3{1, 1, 1}));
  };
  for (const double brightest : {1.25, 1.5, 2.0}) {
    std::mt19937 random(11);
    std::uniform_real_distribution<double> value(0, brightest);
    double by_line = 0, by_grey = 0, number = 0;
    for (int i = 0; i < 20000; ++i) {
      const Vector3 colour{value(random), value(random), value(random)};
      if (*std::max_element(colour.begin(), colour.end()) <= 1) continue;
      const reference::Rgb result = reference::moved_into_gamut({colour[0], colour[1], colour[2]}, weights);
      by_line += isp::ciede2000(lab(colour), lab({result[0], result[1], result[2]}));
      by_grey += isp::ciede2000(lab(colour), lab(isp::toward_white(colour, to_xyz[1]).rgb));
      ++number;
    }
    std::cout << "channels up to " << brightest << ": mean CIEDE2000 " << by_line / number << ", by grey "
              << by_grey / number << '\n';
    EXPECT_LT(by_line, 0.7 * by_grey);
  }
}

}  // namespace
}  // namespace lowlux
