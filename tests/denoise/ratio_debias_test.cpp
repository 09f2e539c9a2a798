#include "denoise/ratio_debias.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <utility>

#include "isp/model/chroma_bound.h"
#include "tests/denoise/patch_draws.h"

namespace lowlux::denoise {
namespace {

using test::MeanOf;
using test::table_camera;
using test::TruePatch;

/// Biases of u' and v', raw and debiased. The first-order error, whose mean is 0 exactly, is taken off each draw: what
/// is left is of second order, so that few draws tell a small bias.
struct Biases {
  MeanOf raw_u, raw_v, debiased_u, debiased_v;
};

Biases biases_of(const TruePatch& truth, int draws) {
  const Vector3 true_xyz = table_camera * truth.signal_e;
  const double w = dot(weight_form, true_xyz), u = dot(u_form, true_xyz) / w, v = dot(v_form, true_xyz) / w;
  Biases out;
  for (int i = 0; i < draws; ++i) {
    const XyzEstimate estimate = xyz_estimate(table_camera, test::measured_patch(truth, 11, i));
    const auto debiased = debiased_chroma(estimate);
    if (!debiased) continue;
    const Vector3 xyz = isp::vector_of(estimate.value);
    const double dw = dot(weight_form, xyz) - w;
    const double first_u = (dot(u_form, xyz) - u * w - u * dw) / w, first_v = (dot(v_form, xyz) - v * w - v * dw) / w;
    out.raw_u.add(dot(u_form, xyz) / (w + dw) - u - first_u);
    out.raw_v.add(dot(v_form, xyz) / (w + dw) - v - first_v);
    out.debiased_u.add(debiased->uv.u - u - first_u);
    out.debiased_v.add(debiased->uv.v - v - first_v);
  }
  return out;
}

double weight_snr(const TruePatch& truth) {
  isp::FlatPatch patch;
  patch.signal_e = truth.signal_e;
  patch.dark_e = {truth.dark_e, truth.dark_e, truth.dark_e};
  patch.noise_std_e = truth.noise_std_e;
  patch.pixels = {truth.pixels, truth.pixels, truth.pixels};
  return isp::chroma_of_means(table_camera, patch)->weight_snr;
}

/// A patch of a colour and a dark charge with so many pixels that W / std(W) is as asked for.
TruePatch patch_of_snr(const Vector3& colour, double signal_e, double dark_e, double snr) {
  TruePatch patch = test::true_patch(colour, signal_e, dark_e, 1);
  patch.pixels = std::ceil(std::pow(snr / weight_snr(patch), 2));
  return patch;
}

TEST(RatioDebias, RemovesAtLeastThreeQuartersOfTheBiasFromAnSnrOfFiveOn) {
  // Published: 75 to 95 %.
  std::map<double, std::pair<double, double>> removed;  // least and most, by SNR
  for (const Vector3& colour : {test::table_neutral, test::table_red, test::table_blue}) {
    for (const auto& [signal_e, dark_e] : {std::pair{0.1, 0.0}, {0.1, 2.0}, {1.0, 2.0}, {4.0, 2.0}, {4.0, 200.0}}) {
      for (const double snr : {5.0, 7.0, 12.0}) {
        const Biases found = biases_of(patch_of_snr(colour, signal_e, dark_e, snr), 20000);
        const double raw = std::hypot(found.raw_u.mean(), found.raw_v.mean());
        const double left = std::hypot(found.debiased_u.mean(), found.debiased_v.mean());
        const double error = std::hypot(found.debiased_u.standard_error(), found.debiased_v.standard_error());
        auto& [least, most] = removed.try_emplace(snr, 1.0, 0.0).first->second;
        least = std::min(least, 1 - left / raw);
        most = std::max(most, 1 - left / raw);
        EXPECT_LT(left, 0.25 * raw + 5 * error) << signal_e << ' ' << dark_e << ' ' << snr;
        EXPECT_GT(raw, 20 * error) << "too few draws to tell";
      }
    }
  }
  for (const auto& [snr, share] : removed) {
    std::printf("  W / std(W) = %g: %.0f to %.0f %% removed\n", snr, 100 * share.first, 100 * share.second);
  }
}

TEST(RatioDebias, BiasOfTheRawRatioIsAsPublished) {
  // u' and v' together at W / std(W) = 7: 0.0015 for neutral, 0.003 for red.
  const auto bias = [](const Vector3& colour) {
    const Biases found = biases_of(patch_of_snr(colour, 1, 2, 7), 40000);
    return std::hypot(found.raw_u.mean(), found.raw_v.mean());
  };
  EXPECT_NEAR(bias(test::table_neutral), 0.0015, 0.0003);  // between light levels it is 0.0015 to 0.0018
  EXPECT_NEAR(bias(test::table_red), 0.003, 0.0005);       // half of the last digit
}

TEST(RatioDebias, DoesNotRaiseTheError) {
  for (const double snr : {5.0, 8.0, 20.0}) {
    const TruePatch truth = patch_of_snr(test::table_red, 1, 2, snr);
    const isp::UvPrime uv = *isp::uv_prime_of(*isp::xy_of(isp::xyz_of(table_camera * truth.signal_e)));
    MeanOf gain;  // squared error, raw less debiased
    for (int i = 0; i < 20000; ++i) {
      const XyzEstimate estimate = xyz_estimate(table_camera, test::measured_patch(truth, 12, i));
      const Vector3 xyz = isp::vector_of(estimate.value);
      const double w = dot(weight_form, xyz);
      const isp::UvPrime found = debiased_chroma(estimate)->uv;
      const double raw = std::hypot(dot(u_form, xyz) / w - uv.u, dot(v_form, xyz) / w - uv.v);
      const double debiased = std::hypot(found.u - uv.u, found.v - uv.v);
      gain.add(raw * raw - debiased * debiased);
    }
    EXPECT_GT(gain.mean(), -5 * gain.standard_error()) << snr;
    EXPECT_GT(gain.mean(), 0) << snr;
  }
}

TEST(RatioDebias, SubtractsThePlugIn) {
  const XyzEstimate estimate{{10, 20, 30}, {{{4, 1, 0}, {1, 5, 2}, {0, 2, 6}}}};
  // W = 400; W form times C: {4 + 15, 1 + 75 + 6, 30 + 18} = {19, 82, 48}; Var(W) = 19 + 15 * 82 + 3 * 48 = 1393.
  const auto found = debiased_chroma(estimate);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->uv.u, 0.1 - (0.1 * 1393 - 4 * 19) / 160000, 1e-15);
  EXPECT_NEAR(found->uv.v, 0.45 - (0.45 * 1393 - 9 * 82) / 160000, 1e-15);
  EXPECT_NEAR(found->weight_snr, 400 / std::sqrt(1393), 1e-12);
}

TEST(RatioDebias, DividesByThreeStandardDeviationsWhereTheWeightIsLess) {
  const XyzEstimate estimate{{0.1, 0.2, 0.3}, {{{4, 1, 0}, {1, 5, 2}, {0, 2, 6}}}};  // W = 4
  const auto found = debiased_chroma(estimate);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->uv.u, 0.1 - (0.1 * 1393 - 4 * 19) / (9 * 1393), 1e-15);
  EXPECT_LT(found->weight_snr, 3);
}

TEST(RatioDebias, WithoutVarianceIsTheRatioAndWithoutWeightNothing) {
  const auto exact = debiased_chroma({{10, 20, 30}, {}});
  ASSERT_TRUE(exact);
  EXPECT_DOUBLE_EQ(exact->uv.u, 0.1);
  EXPECT_DOUBLE_EQ(exact->uv.v, 0.45);
  EXPECT_TRUE(std::isinf(exact->weight_snr));
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(debiased_chroma({{0, 0, 0}, identity3()}));
  EXPECT_FALSE(debiased_chroma({{1, -2, 3}, identity3()}));
  EXPECT_FALSE(debiased_chroma({{nan, 2, 3}, identity3()}));
  EXPECT_FALSE(debiased_chroma({{1, 2, 3}, nan * identity3()}));
  EXPECT_FALSE(debiased_chroma({{1e308, 1e308, 1e308}, identity3()}));
}

}  // namespace
}  // namespace lowlux::denoise
