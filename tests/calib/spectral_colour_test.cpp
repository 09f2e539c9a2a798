#include "calib/chart/spectral_colour.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <string_view>

#include "calib/chart/colour_fit.h"
#include "isp/model/spectrum/cie_data.h"
#include "isp/model/spectrum/spectral_data.h"

namespace lowlux::calib {
namespace {

TEST(SpectralColour, IsExactForTheStandardObserver) {
  const auto colour = spectral_colour(isp::cie_1931_observer(), *isp::light_named("D65"));
  ASSERT_TRUE(colour);
  // 1e-6 CIEDE2000: doubles; near 0 the formula takes roots of differences of squares.
  EXPECT_LT(summary_of(colour->corrected.ciede2000).largest, 1e-6);
  EXPECT_LT(summary_of(colour->fitted.ciede2000).largest, 1e-6);
  EXPECT_LT(colour->training_ciede2000, 1e-6);
  EXPECT_GT(summary_of(colour->printed.ciede2000).mean, 2);  // the wavelength's square is no colour-matching function
}

TEST(SpectralColour, RanksItsMatricesAsMeasuredOver22Cameras) {
  double printed = 0, corrected = 0, fitted = 0;
  int cameras = 0;
  for (const std::string_view name : isp::camera_names()) {
    if (name == "Sony_DXC-930") continue;  // measured with less care
    const auto colour = spectral_colour(*isp::camera_sensitivity(name), *isp::light_named("D65"));
    ASSERT_TRUE(colour) << name;
    EXPECT_LT(summary_of(colour->fitted.ciede2000).mean, summary_of(colour->corrected.ciede2000).mean) << name;
    EXPECT_LT(summary_of(colour->corrected.ciede2000).mean, summary_of(colour->printed.ciede2000).mean) << name;
    printed += summary_of(colour->printed.ciede2000).mean;
    corrected += summary_of(colour->corrected.ciede2000).mean;
    fitted += summary_of(colour->fitted.ciede2000).mean;
    ++cameras;
  }
  ASSERT_EQ(cameras, 22);
  // CIEDE2000 8.8, 3.7 and 0.9, found by another program, which fitted its matrix to other reflectances.
  EXPECT_NEAR(printed / cameras, 8.8, 0.5);
  EXPECT_NEAR(corrected / cameras, 3.7, 0.5);
  EXPECT_NEAR(fitted / cameras, 0.9, 0.5);
}

TEST(SpectralColour, RefusesSensitivitiesThatAreNotIndependent) {
  const auto camera = *isp::camera_sensitivity("Nikon_D5100");
  const auto twice = spectral_colour({camera[0], camera[0], camera[2]}, *isp::light_named("D65"));
  ASSERT_FALSE(twice);
  EXPECT_EQ(twice.error().code, ErrorCode::insufficient);
}

TEST(SpectralColour, RefusesALightWithoutPower) {
  const Spectrum dark = isp::light_named("D65")->mapped([](double, double) { return 0.0; });
  EXPECT_FALSE(spectral_colour(*isp::camera_sensitivity("Nikon_D5100"), dark));
}

}  // namespace
}  // namespace lowlux::calib
