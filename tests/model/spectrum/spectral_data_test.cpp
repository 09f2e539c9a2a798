#include "isp/model/spectrum/spectral_data.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "isp/model/colour/correlated_colour_temperature.h"
#include "isp/model/sensor/text_table.h"
#include "isp/model/spectrum/cie_data.h"

// Check values are those of isp/model/data/SOURCES.md.
namespace lowlux::isp {
namespace {

double peak_nm(const Spectrum& spectrum) {
  const auto highest = std::max_element(spectrum.values().begin(), spectrum.values().end());
  return spectrum.wavelengths_nm()[static_cast<std::size_t>(highest - spectrum.values().begin())];
}

double cct_k(const Spectrum& light) { return colour_temperature_of(*xy_of(xyz_of(light)))->cct_k; }

TEST(SpectralData, SetsHoldWhatTheyShould) {
  const struct {
    SpectrumSet set;
    std::size_t count;
    double first_nm, last_nm, step_nm;
  } sets[] = {
      {SpectrumSet::cie_illuminants, 34, 380, 780, 5},  {SpectrumSet::street_lamps, 21, 380, 780, 5},
      {SpectrumSet::laboratory_lamps, 25, 380, 780, 4}, {SpectrumSet::colorchecker, 24, 380, 780, 5},
      {SpectrumSet::macbeth, 24, 380, 780, 4},          {SpectrumSet::munsell_ten, 10, 380, 800, 1},
  };
  for (const auto& expected : sets) {
    const auto all = spectra_of(expected.set);
    EXPECT_EQ(all.size(), expected.count);
    for (const NamedSpectrum& one : all) {
      const auto nm = one.spectrum.wavelengths_nm();
      EXPECT_EQ(nm.front(), expected.first_nm) << one.name;
      EXPECT_EQ(nm.back(), expected.last_nm) << one.name;
      for (std::size_t i = 1; i < nm.size(); ++i) ASSERT_EQ(nm[i] - nm[i - 1], expected.step_nm) << one.name;
      const auto again = spectrum_named(expected.set, one.name);
      ASSERT_TRUE(again) << one.name;
      EXPECT_TRUE(std::ranges::equal(again->values(), one.spectrum.values()));
    }
    EXPECT_FALSE(spectrum_named(expected.set, "no such spectrum"));
    EXPECT_FALSE(spectrum_named(expected.set, ""));
    EXPECT_FALSE(spectrum_named(expected.set, "wavelength_nm"));
  }
}

TEST(SpectralData, ReflectancesReflectNoMoreThanThereIs) {
  for (const SpectrumSet set : {SpectrumSet::colorchecker, SpectrumSet::macbeth, SpectrumSet::munsell_ten}) {
    for (const NamedSpectrum& chip : spectra_of(set)) {
      EXPECT_GE(std::ranges::min(chip.spectrum.values()), 0) << chip.name;
      EXPECT_LE(std::ranges::max(chip.spectrum.values()), 1) << chip.name;
    }
  }
}

TEST(SpectralData, ChartsAreInTheirOrderFromDarkSkinToBlack) {
  for (const SpectrumSet set : {SpectrumSet::colorchecker, SpectrumSet::macbeth}) {
    const auto patches = spectra_of(set);
    const Spectrum d50 = *light_named("D50");
    const auto y = [&](int i) { return xyz_of_reflectance(patches[static_cast<std::size_t>(i)].spectrum, d50)->y; };
    for (int i = 19; i < 24; ++i) EXPECT_LT(y(i), y(i - 1)) << "the greys fall from white to black";
    EXPECT_GT(y(18), 0.85);
    EXPECT_LT(y(23), 0.04);
  }
  EXPECT_EQ(spectra_of(SpectrumSet::colorchecker)[0].name, "dark_skin");
}

TEST(SpectralData, LampsHaveTheTemperaturesOfTheirSources) {
  EXPECT_NEAR(cct_k(*spectrum_named(SpectrumSet::street_lamps, "HPS_generic")), 2071, 0.5);
  EXPECT_NEAR(cct_k(*spectrum_named(SpectrumSet::laboratory_lamps, "Solux_4700K_12VDC")), 4750, 10);
  const Xy lps = *xy_of(xyz_of(*spectrum_named(SpectrumSet::street_lamps, "LPS")));
  EXPECT_NEAR(lps.x, 0.575, 5e-4);
  EXPECT_NEAR(lps.y, 0.424, 5e-4);
}

TEST(SpectralData, CamerasPeakWhereTheirSourcesSayAndAtOne) {
  const auto names = camera_names();
  EXPECT_EQ(names.size(), 23u);
  for (const std::string_view name : names) {
    const auto rgb = camera_sensitivity(name);
    ASSERT_TRUE(rgb) << name;
    double peak = 0;
    for (const Spectrum& channel : *rgb) {
      peak = std::max(peak, std::ranges::max(channel.values()));
      EXPECT_EQ(channel.wavelengths_nm().front(), 380);
      EXPECT_EQ(channel.wavelengths_nm().back(), 780);
    }
    EXPECT_DOUBLE_EQ(peak, 1) << name;
    EXPECT_GT(peak_nm((*rgb)[0]), peak_nm((*rgb)[1])) << name;
    EXPECT_GT(peak_nm((*rgb)[1]), peak_nm((*rgb)[2])) << name;
  }
  const auto nikon = *camera_sensitivity("Nikon_D5100");
  EXPECT_EQ(peak_nm(nikon[0]), 595);
  EXPECT_EQ(peak_nm(nikon[1]), 530);
  EXPECT_EQ(peak_nm(nikon[2]), 460);
  const auto sony = *camera_sensitivity("Sony_DXC-930");
  EXPECT_NEAR(peak_nm(sony[0]), 586, 2);
  EXPECT_NEAR(peak_nm(sony[1]), 526, 2);
  EXPECT_NEAR(peak_nm(sony[2]), 450, 2);
  EXPECT_FALSE(camera_sensitivity("Nikon_D5100/R"));
  EXPECT_FALSE(camera_sensitivity(""));
  EXPECT_FALSE(camera_sensitivity("Box_Brownie"));
  EXPECT_EQ(known_camera("NIKON D850"), "Nikon_D850");
  EXPECT_EQ(known_camera("SONY ILCE-7SM2"), "Sony_ILCE-7SM2");
  for (const std::string_view name : names) EXPECT_EQ(known_camera(name), name);
  EXPECT_FALSE(known_camera("Box Brownie"));
  EXPECT_FALSE(known_camera(""));
}

TEST(SpectralData, ConesPeakAtOneWhereTheirAuthorsSay) {
  const auto smith = cone_fundamentals(ConeSet::smith_pokorny_1975);
  EXPECT_EQ(peak_nm(smith[0]), 565);
  EXPECT_EQ(peak_nm(smith[1]), 545);
  EXPECT_EQ(peak_nm(smith[2]), 440);
  EXPECT_EQ(std::ranges::max(smith[0].values()), 1);
  EXPECT_EQ(std::ranges::max(smith[1].values()), 0.999) << "as published";
  EXPECT_EQ(std::ranges::max(smith[2].values()), 1);
  for (const Spectrum& cone : cone_fundamentals(ConeSet::stockman_sharpe_2000)) {
    EXPECT_NEAR(std::ranges::max(cone.values()), 1, 2e-5) << "the peak lies between whole nanometres";
  }
}

TEST(SpectralData, QuantalConesAt390NanometresAreThoseOfThePaper) {
  const CieTable table = cones_stockman_sharpe_2deg_1nm_table();
  const double log10_published[] = {-3.2186, -3.2908, -1.9660};  // Stockman & Sharpe 2000, Table 2
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(std::log10(column_of(table, 5 + k).at(390)), log10_published[k], 5e-5);
  }
}

TEST(SpectralData, TheFirstEllipseOfMacAdamIsThePublishedOne) {
  const CieTable table = macadam1942_table();
  ASSERT_EQ(table.cells.size(), 25 * table.columns.size());
  const double published[] = {0.160, 0.057, 0.85, 0.35, 62.5};
  for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(table.cells[i], published[i]);
}

TEST(TextTable, ReadsNumbersTextsAndBlanks) {
  const TextTable table("# a comment\nname,gain,note\n\na,1.5,first\n# another\nb,,\nc,1x,x y\n");
  ASSERT_EQ(table.rows(), 3);
  EXPECT_EQ(table.text(0, "name"), "a");
  EXPECT_EQ(table.number(0, "gain"), 1.5);
  EXPECT_EQ(table.text(1, "note"), "") << "a blank last cell";
  EXPECT_FALSE(table.number(1, "gain"));
  EXPECT_FALSE(table.number(2, "gain")) << "a number and nothing else";
  EXPECT_EQ(table.text(2, "note"), "x y");
  EXPECT_EQ(TextTable("").rows(), 0);
  EXPECT_EQ(TextTable("name\n").rows(), 0);
  EXPECT_EQ(TextTable("name\nlast").text(0, "name"), "last") << "a file without its last line's end";
}

TEST(TextTable, HoldsTheNoiseOfTheCalibratedCameras) {
  const TextTable eld(noise_eld_per_iso_text());
  const auto read_noise_e = [&](std::string_view camera, double iso) {
    for (int row = 0; row < eld.rows(); ++row) {
      if (eld.text(row, "camera") == camera && eld.number(row, "iso") == iso) return *eld.number(row, "gaussian_e");
    }
    return 0.0;
  };
  EXPECT_NEAR(read_noise_e("CanonEOS5D4", 100), 7.42, 5e-3);
  EXPECT_NEAR(read_noise_e("NikonD850", 100), 3.27, 5.1e-3);
}

}  // namespace
}  // namespace lowlux::isp
