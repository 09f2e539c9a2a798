#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "isp/metrics/convex_hull.h"
#include "isp/metrics/gamut_ratio.h"
#include "isp/model/colour/colour_difference.h"
#include "isp/model/spectrum/spectral_divergence.h"
#include "isp/model/vision/detection.h"
#include "isp/model/vision/seeing.h"
#include "isp/render/retarget/retarget.h"
#include "isp/render/retarget/retarget_rows.h"
#include "isp/render/retarget/retarget_table.h"
#include "tests/hard_cases/hard_case.h"
#include "tests/hard_cases/rendering.h"
#include "tests/reference/exact_ref.h"
#include "tests/reference/retarget_ref.h"
#include "tests/support/sweep.h"

// Seeing, and what compares colours: section 4 of the sensor model; sections 4 and 5 of the mesopic specification.
namespace lowlux::hard_cases {
namespace {

using isp::Lab;

constexpr std::string_view colour_group = "Colour and light";
constexpr std::string_view no_picture = "a metric of images";
constexpr double eps = std::numeric_limits<double>::epsilon();

void figures_row(const About& about, const Bound& bound, const Measure& measure, std::string_view reason = no_picture) {
  HardCase row(about);
  row.on(Path::reference, bound, measure);
  row.none(levels, reason).none(instruction_sets, reason).none(pipelines, reason);
}

TEST(HardCaseColour, FrequencyOfSeeingWhereItIsTiny) {
  figures_row(
      {colour_group, "probability of seeing from 1e-180 up", "sum of Poisson terms in 50 digits", "relative"},
      {2e-14, rounding},
      [](Denormals m) {
        double worst = 0;
        for (const int threshold : {1, 2, 6, 20, 60}) {
          for (const double mean : {1e-3, 0.1, 1.0, 5.0, 40.0}) {
            const double found = in_mode(m, [&] { return *isp::frequency_of_seeing({mean, 1, 0}, threshold); });
            keep_worst(worst, std::abs(found / reference::poisson_at_least(threshold, mean) - 1));
          }
        }
        return worst;
      },
      no_image);
}

// Both tails at any light; the means are rounded before: a last digit of 400 moves the tail beyond 430 by 1e-14 of it.
TEST(HardCaseColour, SeeingAPatchAtAnyLight) {
  figures_row(
      {colour_group, "probability of seeing a patch in 1e-9 to 1e9 cd/m2", "two sums of Poisson terms in 50 digits",
       "relative"},
      {1e-13, rounding},
      [](Denormals m) {
        double worst = 0;
        for (const double pupil_mm2 : {3.14, 12.0, 47.0}) {
          const isp::SeeingModel model = *isp::seeing_model(pupil_mm2);
          const auto missed = [](const isp::DetectionLimit& limit, double cd_m2) {
            const double mean = limit.patch.dark_counts + cd_m2 * limit.patch.counts_per_cd_m2;
            return mean > 5000 ? 0 : 1 - reference::poisson_at_least(limit.threshold, mean);
          };
          for (const double light : test::ratios(1e-9, 1e9, 2.3)) {
            const double found = in_mode(m, [&] { return isp::probability_of_seeing(model, {light, 2.46 * light}); });
            const double truth = 1 - missed(model.rods, 2.46 * light) * missed(model.cones, light);
            keep_worst(worst, std::abs(found / truth - 1));
          }
        }
        return worst;
      },
      no_image);
}

// Hue angles near their branches: errors of an atan2 of 1e-16 over chroma; 1e-13 of what is 7 or less elsewhere.
TEST(HardCaseColour, Ciede2000AtItsBranches) {
  figures_row(
      {colour_group, "5.3 CIEDE2000: opposite hues, grey, blue's turn, 27 x 27 colours", "50 digits", "CIEDE2000"},
      {5e-13, rounding}, [](Denormals m) {
        std::vector<std::pair<Lab, Lab>> pairs{{{50, 2.49, -0.001}, {50, -2.49, 0.0009}},
                                               {{50, 2.49, -0.001}, {50, -2.49, 0.0011}},
                                               {{50, -0.001, 2.49}, {50, 0.0009, -2.49}},
                                               {{50, -0.001, 2.49}, {50, 0.0011, -2.49}},
                                               {{50, 0, 0}, {50, -1, 2}},
                                               {{50, 2.5, 0}, {50, 0, -2.5}},
                                               {{0, 0, 0}, {100, 0, 0}},
                                               {{22.7233, 20.0904, -46.694}, {23.0331, 14.973, -42.5619}}};
        std::vector<Lab> colours;
        colours.reserve(27);
        colours.reserve(27);
        for (const double l : {0.0, 40.0, 90.0}) {
          for (const double a : {-70.0, 0.0, 55.0}) {
            for (const double b : {-110.0, 0.0, 75.0}) colours.push_back({l, a, b});
          }
        }
        for (const Lab& first : colours) {
          // Opposite hues exactly have two mean hues; rounding chooses, and either is right.
          for (const Lab& second : colours) pairs.push_back({first, {second.l, second.a + 1.3, second.b + 0.7}});
        }
        double worst = 0;
        for (const auto& [first, second] : pairs) {
          const double found = in_mode(m, [&, a = first, b = second] { return isp::ciede2000(a, b); });
          keep_worst(worst, std::abs(found - reference::ciede2000(first, second)));
        }
        return worst;
      });
}

TEST(HardCaseColour, CielabOfNegativeLight) {
  figures_row({colour_group, "5 CIELAB of negative, zero, tiny, 1e6 times white", "50 digits: the line goes on below 0",
               "relative to 8 eps"},
              {1, rounding}, [](Denormals m) {
                double worst = 0;
                for (const double y : {-5.0, -1e-3, 0.0, 1e-12, 0.008, 0.009, 1.0, 1e6}) {
                  const Lab found = in_mode(m, [&] { return isp::lab_of({0.95 * y, y, 1.09 * y}, {0.95, 1, 1.09}); });
                  const double expected = 116 * reference::lab_f(y) - 16;
                  keep_worst(worst, std::abs(found.l - expected) / std::max(16.0, std::abs(expected)) / (8 * eps));
                }
                return worst;
              });
}

TEST(HardCaseColour, ChromaAloneHasNoHueDifference) {
  figures_row({colour_group, "5.2 Delta E 94c where rounding makes dH^2 negative", "closed form: dC / S_C",
               "relative to 32 eps"},
              {1, rounding}, [](Denormals m) {
                double worst = 0;
                for (int i = 1; i < 400; ++i) {
                  const double angle = 0.0157 * i, from = 0.37 * i, to = 0.11 * i;
                  const Lab first{50, from * std::cos(angle), from * std::sin(angle)};
                  const Lab second{50, to * std::cos(angle), to * std::sin(angle)};
                  const double found = in_mode(m, [&] { return isp::delta_e_94c(first, second); });
                  keep_worst(worst, std::abs(found / ((from - to) / (1 + 0.045 * from)) - 1) / (32 * eps));
                }
                return worst;
              });
}

TEST(HardCaseColour, DivergencesOfSpectraWithZeros) {
  figures_row({colour_group, "5.5 Kullback-Leibler of spectra that are 0 in places",
               "sum in 50 digits, floors of 1e-12", "relative"},
              {2e-15, rounding}, [](Denormals m) {
                const std::vector<double> nm{400, 410, 430, 500, 505, 700};
                const std::vector<double> p{0, 1, 3, 0, 2, 0.5}, q{1, 0, 0, 2, 1e-300, 4};
                const Spectrum first = *Spectrum::of(nm, p), second = *Spectrum::of(nm, q);
                const double found = in_mode(m, [&] { return *isp::kullback_leibler(first, second); });
                return std::abs(found / reference::kullback_leibler(nm, p, q, 1e-12) - 1);
              });
}

TEST(HardCaseColour, GamutsWithoutArea) {
  figures_row({colour_group, "5.4 gamuts of no area, of one line, of no colour", "closed form: no value, or 0",
               "wrong results"},
              0, [](Denormals m) {
                return in_mode(m, [] {
                  const isp::GamutBins none;
                  const std::vector<isp::Xy> line{{0, 0}, {1, 1}, {2, 2}}, square{{0, 0}, {1, 0}, {1, 1}, {0, 1}};
                  double wrong = isp::convex_hull(line).empty() && isp::hull_area(line) == 0 ? 0 : 1;
                  wrong += isp::shared_area(isp::convex_hull(square), isp::convex_hull(line)) == 0 ? 0 : 1;
                  wrong += std::isnan(isp::gamut_ratio(none, none).occupancy_percent) ? 0 : 1;
                  wrong += std::isnan(isp::gamut_ratio(none, none).convex_percent) ? 0 : 1;
                  return wrong;
                });
              });
}

// Single precision: 8 products and sums of values up to 65535, and half a code of rounding.
TEST(HardCaseColour, RetargetingToADisplayThatIsNearlyDark) {
  HardCase row({colour_group, "4 retargeted from 250 to 0.05 cd/m2: colours outside of the display's gamut",
                "tetrahedra in plain double; half a code, and float", "codes of 16 bits"});
  row.none(Path::reference, "is the reference itself").none(levels, "input is a finished image");
  isp::RetargetOptions options;
  options.display_cd_m2 = 0.05;
  const auto map = *isp::retargeting(options);
  PoolExecutor pool(2);
  const isp::RetargetTable table = isp::tabulated([&](const Vector3& code) { return map(code).code; }, 9, pool);
  const auto error = [&](Denormals m) {
    std::vector<std::uint16_t> in, out;
    in.reserve(3 * 2197);
    for (int i = 0; i < 3 * 2197; ++i) in.push_back(static_cast<std::uint16_t>((i * 40503U) % 65536U));
    out.resize(in.size());
    in_mode(m, [&] { isp::apply(table, in.data(), static_cast<int>(in.size() / 3), out.data()); });
    double worst = 0;
    for (std::size_t i = 0; i < in.size(); i += 3) {
      const Vector3 expected = reference::looked_up(table, {in[i] / 65535.0, in[i + 1] / 65535.0, in[i + 2] / 65535.0});
      for (std::size_t c = 0; c < 3; ++c) keep_worst(worst, std::abs(out[i + c] - 65535 * expected[c]));
    }
    return worst;
  };
  row.on_each_set(0.5 + 65535 * 16 * 0x1p-24, error)
      .none(Path::file, "the same kernel as in the columns of instruction sets");
  row.none(Path::live, "streams do not support other displays");
}

TEST(HardCaseColour, ColoursOutsideTheGamut) {
  HardCase row({colour_group, "negative and over-white colours moved into the gamut",
                "plain double; float, 1e-6 of the largest term", "of white"});
  row.none(Path::reference, "is the reference itself").none(levels, "looks come after");
  const isp::RgbTransform transform{
      {4, -2.5f, -0.5f, -1.5f, 3, -0.5f, 0.1f, -2.1f, 3}, {0.2126f, 0.7152f, 0.0722f}, 1.0f, true};
  const auto error = [&](Denormals m) { return linear_error({.transform = transform}, m); };
  row.on_each_set({1e-6, rounding}, error);
  row.none(pipelines, "the same kernel as in the columns of instruction sets");
}

}  // namespace
}  // namespace lowlux::hard_cases
