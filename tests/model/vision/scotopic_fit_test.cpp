#include "isp/model/vision/scotopic_fit.h"

#include <algorithm>
#include <cstdio>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "isp/model/colour/camera_matrix.h"
#include "isp/model/spectrum/cie_data.h"
#include "isp/model/spectrum/spectral_data.h"
#include "isp/model/vision/mesopic.h"

namespace lowlux::isp {
namespace {

std::vector<Spectrum> charts() {
  std::vector<Spectrum> all;
  for (const SpectrumSet set : {SpectrumSet::colorchecker, SpectrumSet::munsell_ten}) {
    for (NamedSpectrum& one : spectra_of(set)) all.push_back(std::move(one.spectrum));
  }
  return all;
}

TEST(ScotopicFit, FindsRodsInACameraThatHasThem) {
  const std::array<Spectrum, 3> camera{cie_1931_observer()[0], scotopic_observer(), cie_1931_observer()[2]};
  const Spectrum light = *light_named("D65");
  const auto fit = fit_scotopic(camera, light, charts());
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->weights[0], 0, 1e-9);
  EXPECT_NEAR(fit->weights[1], fit->scotopic_ratio, 1e-9);
  EXPECT_NEAR(fit->weights[2], 0, 1e-9);
  EXPECT_LT(fit->relative_error, 1e-9);
  EXPECT_GT(fit->through_xyz, 0.01) << "XYZ knows less";
}

TEST(ScotopicFit, KeepsTheRatioOfTheLightAndBeatsXyzOnRealCameras) {
  const std::vector<Spectrum> reflectances = charts();
  for (const char* name : {"D65", "A", "LED-B3", "HPS_generic"}) {
    const Spectrum light = *light_named(name);
    const LuminancePair exact = luminance_of(light);
    double worst = 0, worst_through = 0;
    int better = 0, cameras = 0;
    for (const std::string_view camera : camera_names()) {
      const auto fit = fit_scotopic(*camera_sensitivity(camera), light, reflectances);
      ASSERT_TRUE(fit) << camera;
      EXPECT_NEAR(fit->weights[0] + fit->weights[1] + fit->weights[2], exact.scotopic / exact.photopic, 1e-12);
      worst = std::max(worst, fit->relative_error);
      worst_through = std::max(worst_through, fit->through_xyz);
      better += fit->relative_error < fit->through_xyz;
      ++cameras;
    }
    std::printf("%s: worst of %d cameras %.1f %% rms, through XYZ %.1f %%; better in %d\n", name, cameras, 100 * worst,
                100 * worst_through, better);
    EXPECT_EQ(better, cameras) << name;
  }
}

TEST(ScotopicFit, RefusesTooLittleToFitOn) {
  const auto camera = *camera_sensitivity(camera_names().front());
  const Spectrum light = *light_named("D65");
  const std::vector<Spectrum> all = charts();
  EXPECT_TRUE(fit_scotopic(camera, light, std::span(all).first(4)));
  EXPECT_FALSE(fit_scotopic(camera, light, std::span(all).first(3)));
  EXPECT_FALSE(fit_scotopic({camera[0], camera[0], camera[2]}, light, all)) << "two channels are one";
  const Spectrum black = all[0].mapped([](double, double) { return 0.0; });
  EXPECT_FALSE(fit_scotopic({camera[0], camera[1], black}, light, all)) << "a blind channel";
  EXPECT_FALSE(fit_scotopic(camera, black, all)) << "no light";
  EXPECT_FALSE(fit_scotopic(camera, light, std::vector<Spectrum>{all[0], all[1], all[2], all[3], black}));
}

}  // namespace
}  // namespace lowlux::isp
