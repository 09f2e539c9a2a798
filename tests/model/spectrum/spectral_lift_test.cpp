#include "isp/model/spectrum/spectral_lift.h"

#include <cmath>
#include <cstdint>
#include <cstdio>

#include <gtest/gtest.h>

#include "isp/model/colour/colour_difference.h"
#include "isp/model/sensor/sensor_db.h"
#include "isp/model/spectrum/cie_data.h"
#include "isp/model/spectrum/spectral_response.h"

namespace lowlux::isp {
namespace {

Xyz of_linear_srgb(double r, double g, double b) { return xyz_of(*rgb_to_xyz(primaries_rec709) * Vector3{r, g, b}); }

/// Calls use(XYZ) for a lattice of linear sRGB colours with the corners and edges of the gamut.
template <class Use>
void for_srgb_gamut(const Use& use) {
  const double levels[] = {0, 0.01, 0.1, 0.3, 0.6, 1};
  for (const double r : levels) {
    for (const double g : levels) {
      for (const double b : levels) {
        if (r + g + b > 0) use(of_linear_srgb(r, g, b));
      }
    }
  }
}

// 0.5 is what the simulator promises. The lift itself is better: its smoothing weight is 1e-6.
TEST(SpectralLift, GivesBackEveryColourOfTheSrgbGamut) {
  const Xyz white = *xyz_of(white_d65);
  double worst = 0;
  for_srgb_gamut([&](const Xyz& colour) {
    const auto radiance = lift(colour);
    ASSERT_TRUE(radiance);
    for (const double value : radiance->values()) EXPECT_GE(value, 0);
    worst = std::fmax(worst, ciede2000(lab_of(colour, white), lab_of(xyz_cd_m2(*radiance), white)));
  });
  std::printf("  worst CIEDE2000 of a colour lifted and seen again: %.4f\n", worst);
  EXPECT_LT(worst, 0.1);
}

TEST(SpectralLift, MakesTheEqualEnergySpectrumOfTheEqualEnergyWhite) {
  double sum[3] = {};
  for (int i = 0; i < lift_nodes; ++i) {
    const double weight = i == 0 || i == lift_nodes - 1 ? 2.5 : 5;
    for (int c = 0; c < 3; ++c) sum[c] += weight * cie_1931_observer()[c].at(lift_wavelength_nm(i));
  }
  const auto flat = lift({sum[0], sum[1], sum[2]});
  ASSERT_TRUE(flat);
  for (const double value : flat->values()) EXPECT_NEAR(value, 1 / luminous_efficacy_lm_w, 1e-9);
}

TEST(SpectralLift, ScalesWithLuminance) {
  const Xyz colour = of_linear_srgb(0.2, 0.5, 0.1);
  const auto one = lift(colour);
  const auto many = lift({1e6 * colour.x, 1e6 * colour.y, 1e6 * colour.z});
  ASSERT_TRUE(one && many);
  for (int i = 0; i < lift_nodes; ++i) {
    EXPECT_NEAR(many->values()[i] / one->values()[i], 1e6, 1e-3) << "1e-9 relative: the same fit";
  }
}

TEST(SpectralLift, RefusesColoursNoLightCanHave) {
  EXPECT_FALSE(lift({0, 0, 0}));
  EXPECT_FALSE(lift({1, 0, 0}));
  EXPECT_FALSE(lift({-1, 1, 1}));
  EXPECT_FALSE(lift({NAN, 1, 1}));
  EXPECT_FALSE(lift(*xyz_of(Xy{0.05, 0.05})));
}

TEST(SpectralLift, ExcitationPurityIsOneOnTheLocusAndTheLineOfPurples) {
  EXPECT_EQ(excitation_purity(white_e), 0);
  for (int i = 0; i < lift_nodes; ++i) {
    const double nm = lift_wavelength_nm(i);
    const auto& observer = cie_1931_observer();
    const Xyz line{observer[0].at(nm), observer[1].at(nm), observer[2].at(nm)};
    EXPECT_NEAR(excitation_purity(*xy_of(line)), 1, 1e-6) << nm << ": red ends differ by the table's digits";
  }
  EXPECT_NEAR(excitation_purity({(0.1741 + 0.7347) / 2, (0.0050 + 0.2653) / 2}), 1, 1e-3);  // 380 and 780 nm
  EXPECT_NEAR(excitation_purity({1 / 3.0 + 0.1, 1 / 3.0}), 2 * excitation_purity({1 / 3.0 + 0.05, 1 / 3.0}), 1e-12);
  EXPECT_GT(excitation_purity({0.05, 0.05}), 1);
}

TEST(SpectralLift, MovesUnliftableColoursToTheLocusAndNoOthers) {
  const Xy inside{0.3, 0.3}, outside{0.9, 0.4};
  EXPECT_EQ(liftable(inside), inside);
  const Xy moved = liftable(outside);
  EXPECT_TRUE(lift(*xyz_of(moved)));
  // On the line to white, and twice moved is once moved.
  EXPECT_NEAR((moved.x - white_e.x) * (outside.y - white_e.y), (moved.y - white_e.y) * (outside.x - white_e.x), 1e-12);
  EXPECT_NEAR(liftable(moved).x, moved.x, 1e-12);
  EXPECT_EQ(liftable(white_e), white_e);
}

SpectralResponse response_of(const char* camera) {
  auto sensor = sensor_named("ELD_NikonD850", "ISO 1600", {});
  sensor->camera = camera;
  return *spectral_response(*sensor, {});
}

// The step of the table is chosen so that its interpolation stays below half a per cent of what the spectra give, near
// the blue primary too, where the lifted spectra are narrowest.
TEST(LiftTable, AgreesWithTheSpectraItStandsFor) {
  for (const char* camera : {"Nikon_D850", "Canon_EOS_5D_Mark_IV", "Sony_DXC-930"}) {
    const SpectralResponse response = response_of(camera);
    const LiftTable table(response);
    double worst = 0;
    for_srgb_gamut([&](const Xyz& colour) {
      const Vector3 exact = electron_rate(response, *lift(colour));
      const double largest = std::fmax(exact[0], std::fmax(exact[1], exact[2]));
      const Xy xy = *xy_of(colour);
      for (int k = 0; k < 3; ++k) {
        const double found =
            (colour.x + colour.y + colour.z) * table.response(k, static_cast<float>(xy.x), static_cast<float>(xy.y));
        worst = std::fmax(worst, std::fabs(found - exact[k]) / largest);
      }
    });
    std::printf("  %-22s table against spectra: at most %.5f of the largest channel\n", camera, worst);
    EXPECT_LT(worst, 0.005) << camera;
  }
}

}  // namespace
}  // namespace lowlux::isp
