#include "isp/model/colour/camera_matrix.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>
#include <vector>

#include "isp/model/spectrum/cie_data.h"
#include "isp/model/spectrum/spectral_data.h"

namespace lowlux::isp::camera_matrix_test {
namespace {

/// Sensitivities that are sums of colour-matching functions: rows of `map` times x, y, z.
std::array<Spectrum, 3> mapped_observer(const Matrix3& map) {
  const auto& observer = cie_1931_observer();
  const auto nm = observer[0].wavelengths_nm();
  const auto row = [&](int k) {
    std::vector<double> value(nm.size());
    for (std::size_t i = 0; i < nm.size(); ++i) {
      value[i] = (map * Vector3{observer[0].values()[i], observer[1].values()[i], observer[2].values()[i]})[k];
    }
    return *Spectrum::of({nm.begin(), nm.end()}, std::move(value));
  };
  return {row(0), row(1), row(2)};
}

constexpr Matrix3 some_map{{{1.2, 0.3, -0.1}, {-0.4, 1.5, 0.2}, {0.05, -0.02, 0.8}}};

void expect_near(const Matrix3& found, const Matrix3& expected, double tolerance) {
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) EXPECT_NEAR(found[i][j], expected[i][j], tolerance) << i << " " << j;
  }
}

TEST(SpectralMatrix, IsTheInverseMapForSumsOfColourMatchingFunctions) {
  const auto m = spectral_matrix(mapped_observer(some_map));
  ASSERT_TRUE(m);
  expect_near(m->camera_to_xyz, *inverse(some_map), 1e-12);  // doubles at a condition number near 10
  const auto observer = spectral_matrix(cie_1931_observer());
  ASSERT_TRUE(observer);
  expect_near(observer->camera_to_xyz, identity3(), 1e-12);
}

TEST(SpectralMatrix, GivesBackTheColourOfEveryLightThen) {
  const auto sensitivity = mapped_observer(some_map);
  const Matrix3 m = spectral_matrix(sensitivity)->camera_to_xyz;
  for (const char* name : {"A", "D65", "HPS_generic", "LPS", "LED-B3"}) {
    const Spectrum light = *light_named(name);
    const Vector3 found = m * camera_response(sensitivity, light), expected = vector_of(xyz_of(light));
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(found[k] / expected[1], expected[k] / expected[1], 1e-11) << name;
  }
}

/// Eigenvalues of a symmetric matrix, by the trigonometric solution of its characteristic polynomial, rising.
std::array<double, 3> eigenvalues(const Matrix3& a) {
  const double q = (a[0][0] + a[1][1] + a[2][2]) / 3;
  double p2 = 0;
  Matrix3 b = a;
  for (int i = 0; i < 3; ++i) b[i][i] -= q;
  for (const Vector3& row : b) {
    for (const double value : row) p2 += value * value;
  }
  const double p = std::sqrt(p2 / 6);
  const double determinant = b[0][0] * (b[1][1] * b[2][2] - b[1][2] * b[2][1]) -
                             b[0][1] * (b[1][0] * b[2][2] - b[1][2] * b[2][0]) +
                             b[0][2] * (b[1][0] * b[2][1] - b[1][1] * b[2][0]);
  const double phi = std::acos(std::clamp(determinant / (2 * p * p * p), -1.0, 1.0)) / 3;
  const double highest = q + 2 * p * std::cos(phi), lowest = q + 2 * p * std::cos(phi + 2 * std::numbers::pi / 3);
  return {lowest, 3 * q - highest - lowest, highest};
}

TEST(SpectralMatrix, TellsTheConditionNumber) {
  Matrix3 tt{};
  const auto& t = cie_1931_observer();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      for (std::size_t n = 0; n < t[0].size(); ++n) tt[i][j] += t[i].values()[n] * t[j].values()[n];
    }
  }
  const auto lambda = eigenvalues(tt);  // C T^t of the observer itself is symmetric
  EXPECT_NEAR(spectral_matrix(t)->condition_number / (lambda[2] / lambda[0]), 1, 1e-12);
  // Scale does not matter.
  EXPECT_NEAR(spectral_matrix(mapped_observer(1e-20 * some_map))->condition_number /
                  spectral_matrix(mapped_observer(some_map))->condition_number,
              1, 1e-12);
}

TEST(SpectralMatrix, RefusesSensitivitiesOfFewerThanThreeDimensions) {
  const Matrix3 twice{{{1, 0, 0}, {0, 1, 0}, {1, 1, 0}}}, zero{}, grey{{{1, 1, 1}, {1, 1, 1}, {1, 1, 1}}};
  for (const Matrix3& map : {twice, zero, grey}) {
    const auto refused = spectral_matrix(mapped_observer(map));
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::insufficient);
    EXPECT_NE(refused.error().message.find("condition number"), std::string::npos);
  }
  // On both sides of 1e12: a third function that differs by a small share.
  const auto nearly = [](double share) { return mapped_observer({{{1, 0, 0}, {0, 1, 0}, {1, 1, share}}}); };
  EXPECT_TRUE(spectral_matrix(nearly(1e-10)));
  EXPECT_FALSE(spectral_matrix(nearly(1e-13)));
}

TEST(SpectralMatrix, OfSensitivitiesOutsideOfTheVisibleIsRefused) {
  const Spectrum infrared = *Spectrum::of({900, 1000, 1100}, {1, 1, 1});
  EXPECT_FALSE(spectral_matrix({infrared, infrared, infrared}));
}

TEST(SpectralMatrix, OfEveryCameraIsConditionedWellEnough) {
  for (const std::string_view name : camera_names()) {
    const auto m = spectral_matrix(*camera_sensitivity(name));
    ASSERT_TRUE(m) << name;
    EXPECT_LT(m->condition_number, 100) << name;
  }
}

TEST(FitCalibration, IsExactWhereTheSensitivitiesAreSumsOfColourMatchingFunctions) {
  const auto sensitivity = mapped_observer({{{0.9, 0.4, 0}, {0.2, 1, 0.1}, {0, 0.05, 1}}});
  for (const char* name : {"A", "D65", "FL2"}) {
    const Spectrum light = *light_named(name);
    const auto fit = fit_calibration(sensitivity, light, ForwardMatrix::leave_out);
    ASSERT_TRUE(fit);
    EXPECT_FALSE(fit->forward);
    const Vector3 neutral = camera_response(sensitivity, light);
    for (const NamedSpectrum& patch : spectra_of(SpectrumSet::colorchecker)) {
      const Vector3 found = fit->xyz_to_camera * vector_of(*xyz_of_reflectance(patch.spectrum, light));
      const Vector3 expected = camera_response(sensitivity, light, patch.spectrum);
      const double largest = *std::max_element(neutral.begin(), neutral.end());
      for (int k = 0; k < 3; ++k) EXPECT_NEAR(found[k], expected[k] / largest, 1e-9) << name << " " << patch.name;
    }
  }
}

TEST(FitCalibration, RefusesDarkLightsAndDependentSensitivities) {
  const auto sensitivity = *camera_sensitivity("Nikon_D5100");
  EXPECT_FALSE(fit_calibration(sensitivity, *Spectrum::of({380, 780}, {0, 0}), ForwardMatrix::fit));
  EXPECT_FALSE(
      fit_calibration({sensitivity[1], sensitivity[1], sensitivity[1]}, *light_named("D65"), ForwardMatrix::fit));
}

}  // namespace
}  // namespace lowlux::isp::camera_matrix_test
